#!/usr/bin/env bash
# Makes the images and figures of the materials in docs/shading.md: models of single material extensions as Tessera and as three.js draw them, from the same camera.
#   docs/images/materials/make.sh [MODELS [NPM [OUT]]]
# MODELS: folder of .glb files (default: materials in ../shared beside the project); NPM: where `npm install three@0.170 puppeteer-core` was run (default: npm in ../shared beside the project);
# OUT: folder for what is in between (default: a temporary one). TESSERA names the program (default: the project's own), REFERENCE the script that draws with three.js.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
models=${1:-$root/../shared/materials}
npm=${2:-$root/../shared/npm}
out=${3:-$(mktemp -d)}
reference=${REFERENCE:-$root/../shared/tools/three_reference/render.js}
page=$root/docs/shading.md
width=480 height=270

skip() {
  echo "skipped: $1" >&2
  exit 0
}
command -v node >/dev/null || skip "no node"
command -v python3 >/dev/null || skip "no python3"
[ -x "${CHROMIUM:-/usr/bin/chromium}" ] || skip "no Chromium"
[ -d "$npm/node_modules/three" ] && [ -d "$npm/node_modules/puppeteer-core" ] || skip "no three.js in $npm: npm install three@0.170 puppeteer-core"
[ -f "$reference" ] || skip "no $reference"
compgen -G "$models/*.glb" >/dev/null || skip "no models in $models"

mkdir -p "$out/models" "$out/reference"
for model in "$models"/*.glb; do
  python3 "$here/camera.py" "$model" "$out/models/$(basename "$model")" "$(awk "BEGIN { print $width / $height }")"
done
node "$reference" "$npm" "$out/reference" "$out"/models/*.glb >&2

echo "model,flip" >"$out/materials.csv"
for model in "$out"/models/*.glb; do
  name=$(basename "$model" .glb)
  "${TESSERA:-$root/tessera}" replay "$model" --size ${width}x$height --spp 16 --no-report --quiet --out "$out/$name"
  flip=$("${TESSERA:-$root/tessera}" compare "$out/reference/$name.png" "$out/$name/frame_0000.png" --mask "$out/reference/$name.mask.png" \
    --flip-map "$out/$name/flip.png" --json | awk '/"flip"/ { printf "%.3f", $2 }')
  node "$here/beside.js" "$npm" "$here/$name.webp" "$out/$name/frame_0000.png" "$out/reference/$name.png" "$out/$name/flip.png"
  echo "$name,$flip" >>"$out/materials.csv"
done
cp "$out/materials.csv" "$here/materials.csv"

# The page's table: what stands between its marks.
awk -F, -v csv="$here/materials.csv" '
  $0 == "<!-- end models -->" { inside = 0 }
  !inside { print }
  $0 == "<!-- models -->" {
    inside = 1
    print "| model | FLIP | Tessera, three.js, FLIP |"
    print "|---|---:|---|"
    while ((getline line < csv) > 0) {
      split(line, cell, ",")
      if (cell[1] != "model") printf "| %s | %s | ![%s](images/materials/%s.webp) |\n", cell[1], cell[2], cell[1], cell[1]
    }
  }' "$page" >"$out/page.md"
cp "$out/page.md" "$page"
