#!/usr/bin/env python3
"""Shading paths over tile memory, width of the G-buffer and number of lights: a CSV on standard output.

docs/measurements/shading_paths.py [TESSERA] > docs/measurements/shading_paths.csv

Frame 0 of three captures at 320x180, tiles as the tile memory allows (tile.fit).
"""

import json
import os
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
WAYS = [("visibility", "exact"), ("prepass", "exact"), ("gbuffer", "packed"), ("gbuffer", "exact"),
        ("gbuffer_external", "packed")]
CASES = [("corridor", "ranged"), ("corridor", "off"), ("garden_lamps", "ranged"), ("city_evening", "ranged")]
MEMORIES = [64, 256]


def measured(program, capture, lists, memory, path, layout):
    with tempfile.TemporaryDirectory() as folder:
        sets = ["tile.fit=true", f"tilecore.memory_bytes={memory << 10}", f"shading.path={path}", f"gbuffer.layout={layout}",
                f"shading.light_lists={lists}"]
        command = [program, "replay", os.path.join(ROOT, "captures", capture + ".glb"), "--frames", "0:1", "--size", "320x180",
                   "--quiet", "--out", folder] + [part for key in sets for part in ("--set", key)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "stats.json")) as file:
            return json.load(file)


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build", "release", "tessera")
    print("capture,lights,memory_kib,path,layout,tile,external_bytes,ms,mj,shader_fill", flush=True)
    for capture, lists in CASES:
        for memory in MEMORIES:
            for path, layout in WAYS:
                stats = measured(program, capture, lists, memory, path, layout)
                frame = stats["frames"][0]
                counters, timing = frame["counters"], frame["timing"]
                moved = sum(t["read_bytes"] + t["written_bytes"] for t in frame["dram"])
                tile = stats["gpu"]["tile"]
                warps = counters["tilecore.warps"] + counters.get("gbuffer.light_warps", 0)
                lanes = counters["tilecore.pixel_shader_invocations"] + counters.get("gbuffer.filled", 0)
                row = [capture, "list" if lists == "ranged" else "all", memory, path,
                       layout if path.startswith("gbuffer") else "", f"{tile['width']}x{tile['height']}", moved,
                       f"{timing['time_ms']:.3f}", f"{frame['energy']['total_nj'] / 1e6:.3f}",
                       f"{lanes / (warps * 32):.3f}"]
                print(",".join(map(str, row)), flush=True)


main()
