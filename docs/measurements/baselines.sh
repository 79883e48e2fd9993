#!/usr/bin/env bash
# All schemes on frame 5 of the captures of surfaces, 1280x720, machine mid-mobile: docs/measurements/baselines.sh > docs/measurements/baselines.csv
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
# city_evening, garden_lamps and corridor have frames of several passes: docs/measurements/pass_baselines.py measures them.
columns=queue_bytes_written,queue_bytes_read,queue_bytes_peak,smallest_buffer_bytes,partial_render_bytes,spill_bytes,position_evaluations,domain_evaluations,domain_evaluations_cached,pixel_shader_invocations,frame_bytes_read,frame_bytes_written,dram_bytes,dram_bytes_uncached,cycles,energy_nj,texture_bytes
echo "capture,scheme,kind,$columns"
for capture in eggs vases flyby stroll serpent city garden; do
  "${TESSERA_PROGRAM:-./tessera}" replay "captures/$capture.glb" --frames 5:6 --size 1280x720 --baselines --quiet --no-report --out "$out"
  awk -F, -v capture="$capture" -v columns="$columns" '
    NR == 1 { for (k = 1; k <= NF; ++k) at[$k] = k; count = split(columns, names, ","); next }
    $1 == 5 { row = capture "," $2 "," $3; for (k = 1; k <= count; ++k) row = row "," $at["baseline." names[k]]; print row }' "$out/baselines.csv"
done
