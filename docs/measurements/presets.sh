#!/usr/bin/env bash
# This machine over the best tiled baseline, by preset, frame 5 of the captures of surfaces, 1280x720:
# docs/measurements/presets.sh > docs/measurements/presets.csv
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
# city_evening, garden_lamps and corridor have frames of several passes: docs/measurements/pass_baselines.py measures them.
echo "preset,capture,cycles,energy_nj,dram_bytes,cycles_over_best,best_in_cycles,energy_over_best,best_in_energy"
for preset in entry-mobile mid-mobile high-mobile v3d; do
  for capture in eggs vases flyby stroll serpent city garden; do
    "${TESSERA_PROGRAM:-./tessera}" replay "captures/$capture.glb" --gpu "$preset" --frames 5:6 --size 1280x720 --baselines --quiet --no-report --out "$out"
    awk -F, -v preset="$preset" -v capture="$capture" '
      NR == 1 { for (k = 1; k <= NF; ++k) at[$k] = k; next }
      $1 == 5 {
        cycles = $at["baseline.cycles"]; energy = $at["baseline.energy_nj"]
        if ($3 == "ours" && $2 == "tessera") { own_cycles = cycles; own_energy = energy; bytes = $at["baseline.dram_bytes"] }
        if ($3 == "ours" || $2 == "immediate" || $2 == "untiled") next
        if (best_cycles == 0 || cycles < best_cycles) { best_cycles = cycles; in_cycles = $2 }
        if (best_energy == 0 || energy < best_energy) { best_energy = energy; in_energy = $2 } }
      END { printf "%s,%s,%d,%d,%d,%.3f,%s,%.3f,%s\n", preset, capture, own_cycles, own_energy, bytes, own_cycles / best_cycles, in_cycles, own_energy / best_energy, in_energy }' "$out/baselines.csv"
  done
done
