#!/usr/bin/env bash
# Measures docs/accuracy.md: a CSV file and a plot per capture, references.csv, convergence.svg: docs/images/accuracy/make.sh [SIZE [SAMPLES [DIR]]]
# DIR keeps what was measured; called again with the same, nothing is measured again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
size=${1:-640x360} samples=${2:-1024} out=${3:-$(mktemp -d)}
# FILE KEY: the number that follows the key first, in the object "reference".
of_reference() { tr -d '\n' <"$1" | sed 's/.*"reference"://' | grep -oE "\"$2\": ?[-0-9.e]+" | head -1 | sed 's/.*: *//'; }
# FILE: knobs without effect, comma, quoted list of knobs that were left out with the reason.
idle_and_left_out() {
  tr -d '\n' <"$1" | grep -oE '"(idle|name|skipped)": ?("[^"]*"|true|false)' | sed 's/"//g' |
    awk -F': *' '$1 == "idle" { idle = $2 } $1 == "name" { name = $2 } $1 == "skipped" { reason = substr($0, index($0, ":") + 1); sub(/^ */, "", reason); if (reason != "") out = out (out == "" ? "" : "; ") name ": " reason
      else if (idle == "true" && name != "joint") none = none (none == "" ? "" : " ") name } END { printf "%s,\"%s\"", none, out }'
}
measure() {  # CAPTURE NAME further arguments
  local begin=$SECONDS command="./tessera tradeoff captures/$1.glb --size $size --reference-samples $samples ${*:3} --out out/$2"
  "$root/tessera" tradeoff "$root/captures/$1.glb" --out "$out/$2" --size "$size" --reference-samples "$samples" --quiet "${@:3}"
  local json=$out/$2/tradeoff.json
  echo "$2,$(grep -oE '"frame": ?[0-9]+' "$json" | head -1 | grep -oE '[0-9]+'),$(of_reference "$json" triangles),$(of_reference "$json" psnr_db),$(of_reference "$json" slope),$((SECONDS - begin)),$(of_reference "$json" seconds),$(idle_and_left_out "$json"),$command" >>"$here/references.csv"
  awk -v title="$2, $size: error against cycles" -f "$here/csv.awk" -f "$here/plot.awk" "$out/$2/tradeoff.csv" >"$here/$2.svg"
  awk -f "$here/csv.awk" -f "$here/tidy.awk" "$out/$2/tradeoff.csv" >"$here/$2.csv"
  # "samples error" of the reference's convergence.
  tr -d ' \n' <"$json" | sed 's/.*"convergence":{"rms_error":\[\([^]]*\)\],"samples":\[\([^]]*\)\].*/\2;\1/' |
    awk -F';' '{ n = split($1, s, ","); split($2, e, ","); for (i = 1; i <= n; ++i) print s[i], e[i] }' >"$out/$2.convergence"
}
echo "capture,frame,reference_triangles,reference_noise_db,convergence_slope,seconds,reference_seconds,idle_knobs,left_out,command" >"$here/references.csv"
measure eggs eggs --joint usual
measure eggs eggs-own-grids --joint usual --reference-edge 0
measure flyby flyby --joint usual
measure serpent serpent --joint usual
measure stroll stroll --joint usual
measure vases vases --joint usual
measure workshop workshop
awk -f "$here/converge.awk" "$out"/{eggs,flyby,serpent,stroll,vases,workshop}.convergence >"$here/convergence.svg"
