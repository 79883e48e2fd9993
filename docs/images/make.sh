#!/usr/bin/env bash
# Makes the images of the README: docs/images/make.sh (its tables: docs/measurements/readme.sh)
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../..
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
"$root/tessera" replay "$root/captures/eggs.glb" --size 960x540 --spp 64 --quiet --out "$out/eggs"
cp "$out"/eggs/frame_*.png "$here/eggs.png"
for name in vases serpent flyby; do
  "$root/tessera" replay "$root/captures/$name.glb" --size 480x270 --spp 64 --quiet --out "$out/$name"
  cp "$out/$name"/frame_*.png "$here/$name.png"
done
for name in city garden garden_lamps; do
  "$root/tessera" replay "$root/captures/$name.glb" --size 480x270 --spp 16 --quiet --out "$out/$name"
  cp "$out/$name"/frame_*.png "$here/$name.png"
done
"$root/tessera" replay "$root/captures/city_evening.glb" --frames 0:1 --size 480x270 --spp 16 --quiet --out "$out/city_evening"
cp "$out"/city_evening/frame_*.png "$here/city_evening.png"
"$root/tessera" replay "$root/captures/corridor.glb" --frames 0:1 --size 480x270 --spp 16 --quiet --out "$out/corridor"
cp "$out"/corridor/frame_*.png "$here/corridor.png"
"$root/tessera" replay "$root/captures/workshop.glb" --size 960x540 --spp 64 --quiet --out "$out/workshop"
cp "$out"/workshop/frame_*.png "$here/workshop.png"
"$root/tessera" replay "$root/captures/workshop.glb" --size 960x540 --spp 16 --set procedures.style=lines --quiet --out "$out/lines"
cp "$out"/lines/frame_*.png "$here/workshop-lines.png"
