#!/usr/bin/env bash
# All schemes on frame 5 of the captures of surfaces, 1280x720, machine mid-mobile: docs/measurements/baselines.sh > docs/measurements/baselines.csv
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
for capture in eggs vases flyby stroll serpent city garden; do
  "${TESSERA_PROGRAM:-./tessera}" replay "captures/$capture.glb" --frames 5:6 --size 1280x720 --baselines --quiet --no-report --out "$out"
  awk -F, -v OFS=, -v name="$capture" 'NR == 1 { if (name == "eggs") { $1 = "capture"; print } next } { $1 = name; print }' "$out/baselines.csv"
done
