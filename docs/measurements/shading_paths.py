#!/usr/bin/env python3
"""Shading paths over tile memory, width of the G-buffer and number of lights: a CSV on standard output.

docs/measurements/shading_paths.py [--program TESSERA] [--only fitted|fixed] > docs/measurements/shading_paths.csv
docs/measurements/shading_paths.py [--program TESSERA] --presets > docs/measurements/shading_paths_presets.csv

fitted: frame 0 at 320x180, tiles as the tile memory allows (tile.fit). fixed: at 640x360, tiles of one size on all paths, in a
memory that holds them. --presets: frame 0 at 320x180 on every preset, tiles as its own tile memory allows, with light lists.
"""

import argparse
import json
import os
import subprocess
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
WAYS = [("visibility", "exact"), ("prepass", "exact"), ("gbuffer", "packed"), ("gbuffer", "exact"), ("gbuffer_external", "packed")]
CASES = [("corridor", "ranged"), ("corridor", "off"), ("garden_lamps", "ranged"), ("city_evening", "ranged")]
MEMORIES_KIB = [64, 256]
SIDES = [16, 32]
PRESETS = ["entry-mobile", "mid-mobile", "high-mobile", "v3d"]
PRESET_WAYS = [("visibility", "exact"), ("prepass", "exact"), ("gbuffer", "packed"), ("gbuffer_external", "packed")]


def measured(program, capture, size, sets, preset="mid-mobile"):
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "replay", os.path.join(ROOT, "captures", capture + ".glb"), "--frames", "0:1", "--size", size, "--gpu", preset,
                   "--quiet", "--no-report", "--out", folder] + [part for key in sets for part in ("--set", key)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "stats.json")) as file:
            return json.load(file)


def row(program, capture, lists, path, layout, size, memory, sets):
    stats = measured(program, capture, size, sets + [
        f"tilecore.memory_bytes={memory << 10}", f"shading.path={path}", f"gbuffer.layout={layout}",
        f"shading.light_lists={lists}"])
    frame = stats["frames"][0]
    counters, tile = frame["counters"], stats["gpu"]["tile"]
    moved = sum(t["read_bytes"] + t["written_bytes"] for t in frame["dram"])
    warps = counters["tilecore.warps"] + counters.get("gbuffer.light_warps", 0)
    lanes = counters["tilecore.pixel_shader_invocations"] + counters.get("gbuffer.filled", 0)
    return [capture, "list" if lists == "ranged" else "all", size, memory, path,
            layout if path.startswith("gbuffer") else "", f"{tile['width']}x{tile['height']}", moved,
            f"{frame['timing']['time_ms']:.3f}", f"{frame['energy']['total_nj'] / 1e6:.3f}", f"{lanes / (warps * 32):.3f}"]


def by_preset(program):
    print("preset,capture,path,tile,external_bytes,ms,mj", flush=True)
    for preset in PRESETS:
        for capture in ["corridor", "garden_lamps", "city_evening"]:
            for path, layout in PRESET_WAYS:
                stats = measured(program, capture, "320x180", ["tile.fit=true", f"shading.path={path}", f"gbuffer.layout={layout}"],
                                 preset)
                frame, tile = stats["frames"][0], stats["gpu"]["tile"]
                moved = sum(t["read_bytes"] + t["written_bytes"] for t in frame["dram"])
                print(f"{preset},{capture},{path},{tile['width']}x{tile['height']},{moved},{frame['timing']['time_ms']:.3f},"
                      f"{frame['energy']['total_nj'] / 1e6:.3f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=os.path.join(ROOT, "build", "release", "tessera"))
    parser.add_argument("--only", choices=["fitted", "fixed"])
    parser.add_argument("--presets", action="store_true")
    arguments = parser.parse_args()
    if arguments.presets:
        return by_preset(arguments.program)
    print("capture,lights,size,memory_kib,path,layout,tile,external_bytes,ms,mj,warp_fill", flush=True)
    for capture, lists in CASES:
        for path, layout in WAYS:
            if arguments.only != "fixed":
                for memory in MEMORIES_KIB:
                    found = row(arguments.program, capture, lists, path, layout, "320x180", memory, ["tile.fit=true"])
                    print(",".join(map(str, found)), flush=True)
            if arguments.only != "fitted":
                for side in SIDES:
                    found = row(arguments.program, capture, lists, path, layout, "640x360", 1024,
                                [f"tile.width={side}", f"tile.height={side}"])
                    print(",".join(map(str, found)), flush=True)


if __name__ == "__main__":
    main()
