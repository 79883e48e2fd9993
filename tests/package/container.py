#!/usr/bin/env python3
"""tests/package/container.py WORK   runs the steps of Containerfile on a clean Debian 12.

Where docker or podman answers, it builds the image and runs its command. Elsewhere, as root, debootstrap makes a minimal Debian 12
below WORK, and the steps run in it by chroot. Where neither is possible, it says so and passes.
"""
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RELEASE = "bookworm"
# The environment of a container's commands; nothing of the host's.
CLEAN = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LC_ALL": "C.UTF-8"}
# Outputs of the image's command.
RESULTS = ("out/report.html", "out/frame_0014.png", "out/baselines/report.html", "out/baselines/stats.json")


class Failed(Exception):
    pass


def steps(text):
    """Instructions and their arguments, comments left out and continued lines joined."""
    joined = re.sub(r"\\\n\s*", "", re.sub(r"^\s*#.*\n", "", text, flags=re.M))
    found = [tuple(line.split(None, 1)) for line in joined.splitlines() if line.strip()]
    for step in found:
        if step[0] not in ("FROM", "RUN", "WORKDIR", "COPY", "CMD") or len(step) < 2:
            raise Failed(f"the test does not know the instruction {' '.join(step)}")
    if [found[0][0], found[-1][0]] != ["FROM", "CMD"] or f"debian:{RELEASE}" not in found[0][1]:
        raise Failed(f"the Containerfile does not begin with Debian's {RELEASE} and end with a command")
    return found


def run(command, **options):
    print("+", command if isinstance(command, str) else " ".join(map(str, command)), flush=True)
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", **options)
    if done.returncode:
        raise Failed(f"status {done.returncode}:\n{done.stdout[-4000:]}")
    return done.stdout


def answers(engine):
    if not shutil.which(engine):
        return False
    return subprocess.run([engine, "info"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def in_engine(engine):
    run([engine, "build", "-f", "Containerfile", "-t", "tessera-test", "."], cwd=ROOT)
    listing = "&& ls -s " + " ".join(RESULTS)
    command = json.loads(steps((ROOT / "Containerfile").read_text())[-1][1])
    run([engine, "run", "--rm", "tessera-test", "sh", "-c", " ".join(command) + listing])


def copy_tree(target):
    """What COPY takes: everything but what .dockerignore names."""
    ignored = (ROOT / ".dockerignore").read_text().split()
    excludes = [f"--exclude={name[3:] if name.startswith('**/') else './' + name}" for name in ignored]
    target.mkdir(parents=True, exist_ok=True)
    with subprocess.Popen(["tar", "-C", ROOT, *excludes, "-cf", "-", "."], stdout=subprocess.PIPE) as packed:
        run(["tar", "-C", target, "-xf", "-", "--no-same-owner"], stdin=packed.stdout)


def in_root(root, command, folder):
    """A command in the clean root, with its own /proc, which goes when the command ends."""
    script = 'mount -t proc proc "$1/proc" 2>/dev/null; exec chroot "$1" sh -c "cd \\"\\$1\\" && exec sh -c \\"\\$2\\"" sh "$2" "$3"'
    unshared = ["unshare", "--mount", "--fork"]
    if subprocess.run([*unshared, "true"], stderr=subprocess.DEVNULL).returncode:
        unshared = []
        script = script.split("; ", 1)[1]
    return run([*unshared, "sh", "-c", script, "sh", root, folder, command], env=CLEAN)


def in_chroot(work):
    root = work / "root"
    if root.exists():
        shutil.rmtree(root)
    cache = work / "packages"
    cache.mkdir(parents=True, exist_ok=True)
    try:
        run(["debootstrap", "--variant=minbase", f"--cache-dir={cache}", RELEASE, root], env={**os.environ, **CLEAN})
    except Failed as failed:
        print(f"skipped: no clean Debian 12 for the steps of Containerfile: debootstrap failed, {str(failed).splitlines()[-1]}")
        return
    # Names are looked up as on the host.
    shutil.copyfile("/etc/resolv.conf", root / "etc/resolv.conf")
    folder = "/"
    for kind, rest in steps((ROOT / "Containerfile").read_text()):
        if kind == "WORKDIR":
            folder = rest
            (root / folder.lstrip("/")).mkdir(parents=True, exist_ok=True)
        elif kind == "COPY":
            if rest.split() != [".", "."]:
                raise Failed(f"the test copies the whole tree alone, not {rest}")
            copy_tree(root / folder.lstrip("/"))
        elif kind == "RUN":
            in_root(root, rest, folder)
        elif kind == "CMD":
            print(in_root(root, " ".join(json.loads(rest)), folder)[-1500:])
    for name in RESULTS:
        if not (root / folder.lstrip("/") / name).stat().st_size:
            raise Failed(f"{name} is empty")
    shutil.rmtree(root)


def main():
    work = Path(sys.argv[1])
    engines = [engine for engine in ("docker", "podman") if answers(engine)]
    try:
        if engines:
            in_engine(engines[0])
        elif os.getuid() != 0:
            print("skipped: the steps of Containerfile: no container engine answers, and a chroot needs root")
        elif not shutil.which("debootstrap"):
            print("skipped: the steps of Containerfile: no container engine answers, and there is no debootstrap")
        else:
            in_chroot(work)
    except (Failed, OSError) as failed:
        sys.exit(f"container.py: {failed}")


if __name__ == "__main__":
    main()
