#!/usr/bin/python3
"""Renders a frame with tiles of several sizes, plots counters over the size and maps the work of each tile.

    python3 python/examples/tile_map.py captures/eggs.glb tile_map.png
"""

import sys

import tessera

try:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
except ImportError:
    sys.exit("tile_map.py: needs matplotlib; install Debian's package python3-matplotlib")

COUNTERS = ["binner.entries", "tilecore.tessellated_sub_patches", "dram.read_bytes"]
SIZES = [8, 16, 32, 64]
MAP = "triangle_tests"


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: tile_map.py CAPTURE IMAGE")
    scene = tessera.Scene(sys.argv[1])
    frames = []
    for size in SIZES:
        gpu = tessera.Gpu("mid-mobile", tile__width=size, tile__height=size)
        frames.append(tessera.Device(scene, gpu, width=640, height=360).render(scene.frames[0]))
    figure, (image, work, plot) = pyplot.subplots(1, 3, figsize=(16, 3.6), layout="constrained")
    image.imshow(frames[2].display())
    image.set_title(f"frame {frames[2].number}")
    shown = work.imshow(frames[2].tile_maps[MAP])
    work.set_title(f"{MAP}, tiles of {SIZES[2]} pixels")
    figure.colorbar(shown, ax=work)
    for name in COUNTERS:
        values = [frame.counters[name] for frame in frames]
        plot.plot(SIZES, [value / values[-1] for value in values], marker="o", label=name)
    plot.set_xscale("log", base=2)
    plot.set_xlabel("tile side, pixels")
    plot.set_ylabel(f"relative to {SIZES[-1]} pixels")
    plot.legend()
    figure.savefig(sys.argv[2])


if __name__ == "__main__":
    main()
