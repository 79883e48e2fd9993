#!/usr/bin/env python3
"""tests/project/tidy.py BUILD [SOURCE...]   runs clang-tidy 14 with the tree's .clang-tidy over the libraries and the program.

BUILD is a build with Clang (build/clang of ./tessera test --all). Its sources are compiled in batches, so a batch is checked at a
time: headers are read once for 32 sources. Sources that are compiled once for each SIMD target are checked as scalar code. With
SOURCE, only batches that have one of these files are checked.

A batch that had no complaint is not checked again until a file changes that it reads, the options or .clang-tidy: BUILD/tidy has
a file for each batch that passed, which is named after all of them.
"""
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROOMS = ("base", "shaders_cpp", "scene", "memory", "hardware", "timing", "frontend", "binner", "tilecore", "gpu", "baselines",
         "reference", "replay")
# Other people's code, and the code that writes tables when the program is built.
LEFT_OUT = ("tinygltf_implementation.cpp", "stencil_table_generator.cpp")
# A twin: a copy that a check must find.
TWIN = "#include <string>\n#include <vector>\nint f(const std::vector<std::string>& v) { int n = 0; for (std::string s : v) n += s.empty(); return n; }\n"


def arguments_of(entry):
    """The command without the precompiled header, which sources do not need, and with kernels as scalar code."""
    words, out = shlex.split(entry["command"]), []
    k = 0
    while k < len(words):
        if words[k] == "-Xclang":
            k += 4 if words[k + 1] in ("-include", "-include-pch") else 2
            continue
        if words[k].startswith(("-Winvalid-pch", "-fpch-")) or words[k] == "-Werror":
            k += 1
            continue
        out.append("-DHWY_COMPILE_ONLY_STATIC" if words[k].startswith("-DHWY_COMPILE_ALL_ATTAINABLE") else words[k])
        k += 1
    return out


def units(build):
    """Compiled files of the rooms, but for LEFT_OUT: directory, file, arguments, output."""
    found = []
    for entry in json.loads((build / "compile_commands.json").read_text()):
        arguments = arguments_of(entry)
        output = arguments[arguments.index("-o") + 1]
        if output.split("/")[0] in ROOMS and not entry["file"].endswith(LEFT_OUT) and not re.search(r"cmake_pch", entry["file"]):
            found.append({"directory": entry["directory"], "file": entry["file"], "arguments": arguments, "output": output})
    return found


def what_objects_read(build):
    """Files of the project that ninja knows each object to read, through its precompiled header as well."""
    reads, current = {}, None
    for line in subprocess.run(["ninja", "-C", build, "-t", "deps"], capture_output=True, text=True, check=True).stdout.splitlines():
        if line.startswith("    ") and current is not None:
            current.add(line.strip())
        elif ": #deps" in line:
            current = reads.setdefault(line.split(": #deps")[0], set())
    for _ in range(3):
        for files in reads.values():
            for name in [name for name in files if name.endswith(".pch")]:
                files |= reads.get(name, set())
    return reads


def digest(unit, reads, version, cache={}):
    """None if ninja does not know the inputs of the object."""
    files = reads.get(unit["output"])
    if not files:
        return None
    sha = hashlib.sha256("\0".join([version, (ROOT / ".clang-tidy").read_text(), *unit["arguments"]]).encode())
    for name in sorted(files):
        path = Path(unit["directory"], name).resolve()
        # The system's headers change with the compiler, whose version is part of the text.
        if ROOT not in path.parents or name.endswith(".pch"):
            continue
        if path not in cache:
            cache[path] = hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""
        sha.update(f"{path.relative_to(ROOT)} {cache[path]}\n".encode())
    return sha.hexdigest()


def tidy(arguments, **options):
    return subprocess.run(["clang-tidy", "--quiet", f"--config-file={ROOT}/.clang-tidy", *arguments], capture_output=True, text=True, **options)


def complaints(done):
    """Warnings and errors that name a file, once each; without a status of nothing."""
    lines = [line for line in done.stdout.splitlines() if re.search(r": (warning|error): ", line)]
    return lines or ([f"clang-tidy ends with {done.returncode}: {done.stderr[-400:]}"] if done.returncode else [])


def main():
    build, sources = Path(sys.argv[1]).resolve(), [str(Path(name).resolve()) for name in sys.argv[2:]]
    try:
        version = subprocess.run(["clang-tidy", "--version"], capture_output=True, text=True).stdout
    except FileNotFoundError:
        version = ""
    if "version 14." not in version:
        print("skipped: no clang-tidy 14")
        return 0
    if not (build / "compile_commands.json").exists():
        print(f"skipped: clang-tidy wants a build with Clang in {build}: ./tessera test --all makes it")
        return 0
    work = build / "tidy"
    work.mkdir(exist_ok=True)
    twin = work / "twin.cpp"
    twin.write_text(TWIN)
    if not complaints(tidy([str(twin), "--", "-std=c++20"])):
        print("the twin, a source with a copy in a loop, is not caught")
        return 1
    reads, todo, passed, before = what_objects_read(build), [], set(), 0
    for unit in units(build):
        name = digest(unit, reads, version)
        if name is not None:
            passed.add(name)
        if sources and not any(source in (str(Path(unit["directory"], name).resolve()) for name in reads.get(unit["output"], ())) or source == unit["file"]
                               for source in sources):
            continue
        if name is None or not (work / f"{name}.passed").exists():
            todo.append((unit, name))
        else:
            before += 1
    for old in work.glob("*.passed"):
        if old.stem not in passed:
            old.unlink()
    (work / "compile_commands.json").write_text(json.dumps([unit for unit, _ in todo]))

    def check(item):
        unit, name = item
        wrong = complaints(tidy(["-p", str(work), unit["file"]]))
        if not wrong and name is not None:
            (work / f"{name}.passed").touch()
        return wrong

    # The longest first.
    todo.sort(key=lambda item: "unity" not in item[0]["file"])
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        wrong = sorted({line.replace(f"{ROOT}/", "") for lines in threads.map(check, todo) for line in lines})
    print("\n".join(wrong) or f"checked: {len(todo)}, as before: {before}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
