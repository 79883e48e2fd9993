#!/usr/bin/env bash
# Measures what each effect of the shipped captures costs, 640x360 on the default machine: costs.csv, and its table in docs/shading.md.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)}
for capture in eggs vases stroll flyby serpent city garden workshop; do
  "${TESSERA:-$root/tessera}" tradeoff "$root/captures/$capture.glb" --out "$out/$capture" --effects --quiet >/dev/null
done
python3 "$here/tables.py" "$out" "$here" "$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)"
