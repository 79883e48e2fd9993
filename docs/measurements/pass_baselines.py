#!/usr/bin/env python3
"""All schemes on frames of several passes: a CSV on standard output, or with --table the table of docs/when_it_pays.md.

docs/measurements/pass_baselines.py [--program TESSERA] [--size 320x180] [--table] > docs/measurements/pass_baselines.csv

Frame 0 of each capture on mid-mobile with four samples per pixel. Bytes are all traffic, textures included, by the passes
that draw shadow maps, the pass that draws the camera's view, and the passes over images.
"""

import argparse
import json
import os
import subprocess
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CAPTURES = ["city_evening", "garden_lamps", "corridor"]


def kind_of(name):
    if name.startswith("shadow "):
        return "maps"
    return "view" if name == "main" else "images"


def measured(program, capture, size):
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, "replay", os.path.join(ROOT, "captures", capture + ".glb"), "--frames", "0:1", "--size", size,
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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=os.path.join(ROOT, "build", "release", "tessera"))
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--table", action="store_true")
    arguments = parser.parse_args()
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
