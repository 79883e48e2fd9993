#!/usr/bin/env python3
"""Time over the width of a G-buffer on chip, beside Imagination's curve: a CSV on standard output.

docs/measurements/gbuffer_width.py [--program TESSERA] > docs/measurements/gbuffer_width.csv

Tiles of 8x8 pixels with one sample, whose memory holds 256 bits of G-buffer and 32 of depth; what is wider spills.
"""

import argparse
import os

from shading_paths import ROOT, measured

# PowerVR GX6250: ms a frame over bits of the G-buffer, beside a depth of 32 bits (Imagination's documentation).
POWERVR_MS = {96: 20, 128: 21, 160: 23, 192: 24, 224: 28, 256: 29, 288: 39}
CAPTURES = ["city_evening", "corridor"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=os.path.join(ROOT, "build", "release", "tessera"))
    arguments = parser.parse_args()
    print("capture,bits,tile_bytes,spilled_bytes,ms,over_96_bits,powervr_over_96_bits", flush=True)
    for capture in CAPTURES:
        narrow = None
        for bits, powervr in POWERVR_MS.items():
            stats = measured(arguments.program, capture, "640x360", [
                "tile.fit=true", "tilecore.memory_bytes=2304", "sampling.samples_per_pixel=1", "shading.path=gbuffer",
                "gbuffer.layout=packed", f"gbuffer.bits={bits}"])
            frame = stats["frames"][0]
            ms = frame["timing"]["time_ms"]
            narrow = narrow or ms
            print(f"{capture},{bits},{frame['counters']['gbuffer.tile_bytes']},"
                  f"{frame['counters'].get('gbuffer.spilled_bytes', 0)},{ms:.3f},{ms / narrow:.3f},"
                  f"{powervr / POWERVR_MS[96]:.3f}", flush=True)


if __name__ == "__main__":
    main()
