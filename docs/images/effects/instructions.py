#!/usr/bin/env python3
"""The cost of the code of effects in frames that have none of them, in instructions of the host: instructions.csv.

  docs/images/effects/instructions.py PROGRAM STATIC_PROGRAM   a release build, and one of -DTESSERA_EFFECTS=static

Valgrind counts Device::render alone, on one thread, the machine's model off. Rows `compiled out` compare the two builds, which give the
same image, on captures whose effects are turned off. The other rows add up the functions that only an effect needs, in a frame
without the effect and in one with it; code that the compiler inlined into others is not among them.
"""

import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
SIZE = "320x180"
OFF = [f"effects.{name}=off" for name in ("motion", "defocus", "displacement")]
PLAIN = ("stroll", ["frame_buffer.compression=none"], "0:1")  # no effect runs in its first frame
# Effect: functions that only it needs, and where it runs (capture, settings, frames); None: in no shipped capture.
EFFECTS = {
    "motion": (r"MotionMeter|MotionBvh|whole_motion|make_times_and_lens|Effects<true", ("serpent", [], "0:1")),
    "defocus": (r"lens_variant|fill_lens|BundleFrustum|make_times_and_lens|Effects<(true|false), (true|false), true", ("eggs", [], "0:1")),
    "displacement": (r"[Dd]isplace|WindowTable|MinMaxPyramid|height_normals", ("eggs", [], "0:1")),
    "alpha_test": (r"AlphaTest|AlphaDraw|MaskSink|may_fail_alpha", ("garden", [], "0:1")),
    "blending": (r"collect_layers|blend_layers|drop_hidden_layers", None),
    "procedures": (r"SamplingController|[Pp]rocedure|ParameterMaps|ParameterCell|ArrayProgram", ("workshop", [], "0:1")),
    "layers of materials": (r"[Ll]ayered|N_\w+::\w*Layer", None),
    "environment_image": (r"EnvironmentImage|RadianceImage", None),
    "frame_buffer_compression": (r"compressed_b|plan_compressed|compressed_block", ("stroll", [], "0:1")),
    "desampling, advection, foveation": (r"Advect|RateSelector|[Ss]tencils|Reconstruct|Discrepan|MotionField|EdgeDetector|ResolvePlan|Velocity|BlockContrast",
                                         ("stroll", ["resolve.desampling=adaptive"], "0:2")),
}


def profile(program, capture, sets, frames, folder, functions=True):
    """(instructions of Device::render, {function: its own})."""
    out = folder / "callgrind.out"
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", "--toggle-collect=tessera::gpu::Device::render(int)", program, "replay",
               ROOT / "captures" / f"{capture}.glb", "--size", SIZE, "--frames", frames, "--threads", "1", "--quiet", "--no-report", "--set", "output.machine_model=off",
               *[word for text in sets for word in ("--set", text)], "--out", folder / "replay"]
    said = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stderr
    total = int(re.search(r"Collected : (\d+)", said).group(1))
    if not functions:
        return total, {}
    table = subprocess.run(["callgrind_annotate", "--threshold=100", str(out)], check=True, capture_output=True, text=True).stdout
    found = re.findall(r"^ *([\d,]+) \([^)]*\)\s+\S*?:(.*?)(?: \[[^\]]*\])?$", table, re.M)
    return total, {name: int(count.replace(",", "")) for count, name in found}


def main():
    program, static_program = sys.argv[1:3]
    commit = sys.argv[3] if len(sys.argv) > 3 else subprocess.run(["git", "-C", str(ROOT), "describe", "--always", "--dirty"], capture_output=True, text=True).stdout.strip()
    lines = ["effect,method,frame,instructions,of_the_effect,ratio,with_it_in,of_the_effect_there,commit"]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for capture in ("vases", "stroll", "flyby", "serpent"):
            general, without = (profile(which, capture, OFF, "0:1", folder, functions=False)[0] for which in (program, static_program))
            lines.append(f'"motion, defocus, displacement",compiled out,{capture},{general},{general - without},{general / without:.5f},,,{commit}')
        total, functions = profile(program, *PLAIN, folder)
        own = lambda pattern, table: sum(count for function, count in table.items() if re.search(pattern, function))
        profiles = {}
        for effect, (pattern, place) in EFFECTS.items():
            here = own(pattern, functions)
            key = str(place)
            if place and key not in profiles:
                profiles[key] = profile(program, *place, folder)[1]
            there = own(pattern, profiles[key]) if place else ""
            lines.append(f'"{effect}",its functions,{PLAIN[0]},{total},{here},{total / (total - here):.5f},{place[0] if place else ""},{there},{commit}')
    (pathlib.Path(__file__).parent / "instructions.csv").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
