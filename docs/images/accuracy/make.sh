#!/usr/bin/env bash
# Measures docs/accuracy_and_stability.md on the default machine: docs/images/accuracy/make.sh [DIR [SIZE [SAMPLES]]] writes all.csv, answers.csv, references.csv,
# clock.csv, joint.csv, the tables of the page, samples.svg and joint.svg. References are those of captures/references, which are rendered anew where they are old.
# DIR keeps what was measured; called again with the same, nothing is measured again. A task of a Slurm array, or a call with CAPTURES="eggs city", measures
# its captures alone and writes no tables: the last call writes them, and measures what is missing.
# TABLES=only writes the tables from what is in DIR; rows of captures that were not measured stay as they are.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)} size=${2:-320x180} samples=${3:-256}
captures=(eggs vases stroll flyby serpent city garden workshop)
if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then CAPTURES=${captures[SLURM_ARRAY_TASK_ID]}; fi
if [ "${TABLES:-}" = only ]; then captures=(); elif [ -n "${CAPTURES:-}" ]; then read -ra captures <<<"$CAPTURES"; fi
for capture in ${captures[@]+"${captures[@]}"}; do
  # NAME ARGUMENTS: measures and keeps the result as NAME.json.
  measure() {
    "${TESSERA:-$root/tessera}" tradeoff "$root/captures/$capture.glb" --out "$out/$capture" --size "$size" --reference-samples "$samples" --rounds 1 --quiet --reference-folder "$root/captures/references" "${@:2}" >/dev/null
    cp "$out/$capture/tradeoff.json" "$out/$1.json"
  }
  # All of these captures are packed already: draco_bits and meshopt_bits would leave them as they are.
  measure "$capture" --knobs samples,edge,shading,surface,frame_buffer,weight_bits,geometry,texture_format,desampling,timing
  measure "$capture-joint" --knobs samples,edge,shading,surface,desampling --joint samples,edge,shading,surface,desampling --max-points 4000
  for decibels in 30 35 40; do measure "$capture-$decibels" --min-psnr $decibels; done
done
if [ -n "${CAPTURES:-}" ]; then exit; fi
python3 "$here/tables.py" "$out" "$here" "$(git -C "$root" describe --always --dirty 2>/dev/null || echo unknown)"
