#!/usr/bin/env bash
# Makes the plots of docs/accuracy.md and prints its tables: docs/images/accuracy/make.sh [SIZE [SAMPLES [DIR]]]
# DIR keeps what was measured; called again with the same, nothing is measured again.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
size=${1:-640x360} samples=${2:-1024} out=${3:-$(mktemp -d)}
measure() {  # CAPTURE NAME further arguments
  "$root/tessera" tradeoff "$root/captures/$1.glb" --out "$out/$2" --size "$size" --reference-samples "$samples" --quiet "${@:3}"
  awk -v title="$2, $size: error against cycles" -f "$here/csv.awk" -f "$here/plot.awk" "$out/$2/tradeoff.csv" > "$here/$2.svg"
  # "samples error" of the reference's convergence.
  tr -d ' \n' < "$out/$2/tradeoff.json" | sed 's/.*"convergence":{"rms_error":\[\([^]]*\)\],"samples":\[\([^]]*\)\].*/\2;\1/' |
    awk -F';' '{ n = split($1, s, ","); split($2, e, ","); for (i = 1; i <= n; ++i) print s[i], e[i] }' > "$out/$2.convergence"
  printf '\n## %s\n' "$2"
  awk -f "$here/csv.awk" -f "$here/table.awk" "$out/$2/tradeoff.csv"
}
measure eggs eggs --joint usual
measure eggs eggs-own-grids --joint usual --reference-edge 0
measure flyby flyby --joint usual
measure serpent serpent --joint usual
measure stroll stroll --joint usual
measure vases vases --joint usual
measure workshop workshop
awk -f "$here/converge.awk" "$out"/{eggs,flyby,serpent,stroll,vases,workshop}.convergence > "$here/convergence.svg"
