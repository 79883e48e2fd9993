#!/usr/bin/python3
"""Prints the counters of the first frame of a capture."""
import sys

import tessera

scene = tessera.Scene(sys.argv[1] if len(sys.argv) > 1 else "captures/eggs.glb")
gpu = tessera.Gpu("small", tile__width=32)
device = tessera.Device(scene, gpu, width=160, height=90, shading__rate="sample")
frame = device.render(scene.frames[0])
for name, value in frame.counters.items():
    print(name, value)
