#!/usr/bin/env bash
# How far the coarser models of time are from the default one: docs/measurements/models.sh [MACHINE ...] > docs/measurements/models.csv
# Cycles of frame 5 of each capture at two sizes, by each model over the cycles of the default model. A few minutes for a machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
tessera=${TESSERA_PROGRAM:-./tessera}
machines=("$@")
[ $# -gt 0 ] || machines=(mid-mobile high-mobile v3d entry-mobile)

# cycles ARGUMENT...   of a record
cycles() {
  "$tessera" time "$out/frame.record" --json "$out/time.json" "$@" >"$out/said"
  python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["total"]["timing"]["cycles"])' "$out/time.json"
}

echo "capture,machine,size,cycles,fluid,fluid_constant,phases"
for capture in eggs vases flyby stroll serpent city garden workshop; do
  for machine in "${machines[@]}"; do
    for size in 640x360 1280x720; do
      "$tessera" replay "captures/$capture.glb" --frames 5:6 --size "$size" --gpu "$machine" --record "$out/frame.record" --quiet --no-report --out "$out/replay"
      finest=$(cycles)
      fluid=$(cycles --set memory.model=fluid)
      constant=$(cycles --set memory.model=fluid --set shader.costs=constant)
      phases=$(cycles --set machine.timing=phases --set tessellator.domain_shading=unit)
      python3 -c 'import sys; f = int(sys.argv[1]); print(*sys.argv[5:], f, *(f"{int(c) / f:.3f}" for c in sys.argv[2:5]), sep=",")' \
        "$finest" "$fluid" "$constant" "$phases" "$capture" "$machine" "$size"
    done
  done
done
