#!/usr/bin/env python3
"""All schemes on frames of several passes: a CSV on standard output, or with --table the table of docs/when_it_pays.md.

docs/measurements/pass_baselines.py [--program TESSERA] [--size 320x180] [--table] > docs/measurements/pass_baselines.csv
docs/measurements/pass_baselines.py --paths [...] > docs/measurements/path_baselines.csv

Frame 0 of each capture on mid-mobile with four samples per pixel. Bytes are all traffic, textures included, by the passes
that draw shadow maps, the pass that draws the camera's view, and the passes over images. With --paths the frames are
shaded along each path, with the packed G-buffer, and the table is of docs/passes.md.
"""

import argparse
import json
import os
import subprocess
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CAPTURES = ["city_evening", "garden_lamps", "corridor"]
PATHS = ["visibility", "prepass", "gbuffer", "gbuffer_external"]


def kind_of(name):
    if name.startswith("shadow "):
        return "maps"
    return "view" if name == "main" else "images"


def measured(program, capture, size, path="visibility"):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "replay", os.path.join(ROOT, "captures", capture + ".glb"), "--frames", "0:1", "--size", size,
                        "--set", f"shading.path={path}", *(["--set", "gbuffer.layout=packed"] if "gbuffer" in path else []),
                        "--baselines", "--quiet", "--no-report", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "stats.json")) as file:
            return json.load(file)


def rows(stats):
    frame, mhz = stats["frames"][0], stats["gpu"]["clock"]["mhz"]
    for scheme, counters in frame["baselines"].items():
        moved = dict.fromkeys(["maps", "view", "images"], 0)
        for part in frame["baseline_passes"]:
            of = part["baselines"][scheme]
            moved[kind_of(part["name"])] += of["baseline.dram_bytes"] + of["baseline.texture_bytes"]
        yield [scheme, stats["baseline_kinds"][scheme], *moved.values(), counters["baseline.queue_bytes_peak"],
               counters["baseline.cycles"], f"{counters['baseline.cycles'] / mhz / 1e3:.3f}",
               f"{counters['baseline.energy_nj'] / 1e6:.3f}"]


def table(found):
    """Rows by scheme: MB of maps, view and images, ms and mJ of each capture."""
    print("| scheme | kind | " + " | ".join(f"`{capture}`: MB | ms | mJ" for capture in CAPTURES) + " |")
    print("|---|---|" + "---:|" * (3 * len(CAPTURES)))
    order = sorted(found[CAPTURES[0]], key=lambda row: row[6])
    for scheme, kind in [(row[0], row[1]) for row in order]:
        cells = []
        for capture in CAPTURES:
            row = next(row for row in found[capture] if row[0] == scheme)
            cells += [" + ".join(f"{part / 1e6:.1f}" for part in row[2:5] if part > 0), row[7], row[8]]
        print(f"| `{scheme}` | {kind} | " + " | ".join(cells) + " |")


def path_rows(program, size):
    """Rows of --paths: all bytes, time and energy of each capture, path and scheme."""
    for capture in CAPTURES:
        for path in PATHS:
            stats = measured(program, capture, size, path)
            mhz = stats["gpu"]["clock"]["mhz"]
            for scheme, counters in stats["frames"][0]["baselines"].items():
                yield [capture, path, scheme, stats["baseline_kinds"][scheme],
                       counters["baseline.dram_bytes"] + counters["baseline.texture_bytes"], counters["baseline.cycles"],
                       f"{counters['baseline.cycles'] / mhz / 1e3:.3f}", f"{counters['baseline.energy_nj'] / 1e6:.3f}"]


def path_table(found):
    """Rows by scheme that a product has, and path: MB, ms and mJ of each capture."""
    print("| machine | path | " + " | ".join(f"`{capture}`: MB | ms | mJ" for capture in CAPTURES) + " |")
    print("|---|---|" + "---:|" * (3 * len(CAPTURES)))
    by_name = {(row[0], row[1], row[2]): row for row in found}
    for scheme in dict.fromkeys(row[2] for row in found if row[3] != "idealised" and row[2] != "patch-whole"):
        for path in PATHS:
            rows_of = [by_name[capture, path, scheme] for capture in CAPTURES]
            print(f"| `{scheme}` | `{path}` | " + " | ".join(f"{row[4] / 1e6:.1f} | {row[6]} | {row[7]}" for row in rows_of) + " |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=os.path.join(ROOT, "build", "release", "tessera"))
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--paths", action="store_true")
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
    if arguments.paths:
        measured_rows = path_rows(arguments.program, arguments.size)
        if arguments.table:
            return path_table(list(measured_rows))
        print("capture,path,scheme,kind,bytes,cycles,ms,mj", flush=True)
        for row in measured_rows:
            print(",".join(map(str, row)), flush=True)
        return
    found = {}
    if not arguments.table:
        print("capture,scheme,kind,map_bytes,view_bytes,image_bytes,list_bytes,cycles,ms,mj", flush=True)
    for capture in CAPTURES:
        found[capture] = list(rows(measured(arguments.program, capture, arguments.size)))
        if not arguments.table:
            for row in found[capture]:
                print(",".join(map(str, [capture, *row])), flush=True)
    if arguments.table:
        table(found)


main()
