#!/usr/bin/env bash
# Measures docs/accuracy.md on the default machine: docs/images/accuracy/make.sh [DIR [SIZE [SAMPLES]]] writes all.csv, answers.csv, references.csv,
# clock.csv and its table in the page, joint.csv, samples.svg and joint.svg. References are those of captures/references, which are rendered anew where they are old.
# DIR keeps what was measured; called again with the same, nothing is measured again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)} size=${2:-320x180} samples=${3:-256}
for capture in eggs vases stroll flyby serpent city garden workshop; do
  # NAME ARGUMENTS: measures and keeps the result as NAME.json.
  measure() {
    "${TESSERA:-$root/tessera}" tradeoff "$root/captures/$capture.glb" --out "$out/$capture" --size "$size" --reference-samples "$samples" --rounds 1 --quiet --reference-folder "$root/captures/references" "${@:2}" >/dev/null
    cp "$out/$capture/tradeoff.json" "$out/$1.json"
  }
  measure "$capture" --knobs samples,edge,shading,surface,frame_buffer,weight_bits,timing
  measure "$capture-joint" --knobs samples,edge,shading,surface --joint samples,edge,shading,surface --max-points 2000
  for decibels in 30 35 40; do measure "$capture-$decibels" --min-psnr $decibels; done
done
python3 "$here/tables.py" "$out" "$here" "$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)"
