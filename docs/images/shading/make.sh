#!/usr/bin/env bash
# Measures docs/shading.md: rates.csv, blur.csv, room.csv, cells.csv and blur.svg beside this script: docs/images/shading/make.sh
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

replay() { # NAME CAPTURE ARGUMENTS...
  local name=$1 capture=$2
  shift 2
  "$root/tessera" replay "$capture" --quiet --out "$out/$name" "$@"
}
count() { # NAME COUNTER -> its total
  grep -o "\"tilecore.$2\": [0-9]*" "$out/$1/stats.json" | tail -1 | grep -o '[0-9]*$'
}
error() { # REFERENCE NAME -> "PSNR,FLIP", or nothing for the reference itself
  [ "$1" != "$2" ] || { echo ","; return; }
  "$root/tessera" compare "$out/$1" "$out/$2" | awk '/^frame_/ {printf "%.1f,%.4f", $2, $5; exit}'
}
capture() { echo "$root/captures/$1.glb"; }

{
  echo "capture,rate,samples_visible,invocations,invocations_saved,psnr_db,flip"
  for name in eggs serpent flyby vases; do
    for rate in sample primitive pixel cache; do
      replay "$name.$rate" "$(capture $name)" --set shading.rate=$rate
      echo "$name,$rate,$(count $name.$rate samples_visible),$(count $name.$rate pixel_shader_invocations),$(count $name.$rate pixel_shader_invocations_saved),$(error $name.sample $name.$rate)"
    done
  done
} >"$here/rates.csv"

{
  echo "capture,shutter_frames,sample,pixel,cache"
  for name in serpent flyby; do
    for shutter in 0 0.125 0.25 0.5 1; do
      "$root/tessera" pack "$(capture $name)" "$out/$name.glb" --shutter 0:$shutter >"$out/pack.log" 2>&1
      row="$name,$shutter"
      for rate in sample pixel cache; do
        replay blur "$out/$name.glb" --set shading.rate=$rate
        row+=",$(count blur pixel_shader_invocations)"
      done
      echo "$row"
    done
  done
} >"$here/blur.csv"
awk -f "$here/plot.awk" "$here/blur.csv" >"$here/blur.svg"

{
  echo "tiles,entries_64,entries_256,entries_1024,entries_4096,entries_16384"
  for tile in 16 32 64; do
    row="${tile}x$tile"
    for entries in 64 256 1024 4096 16384; do
      replay room "$(capture eggs)" --set shading.rate=cache --set tile.width=$tile --set tile.height=$tile --set shading_cache.entries=$entries
      row+=",$(count room pixel_shader_invocations)"
    done
    echo "$row"
  done
} >"$here/room.csv"

{
  echo "cell_pixels,invocations,psnr_db,flip"
  for cell in 0.5 1 2 4; do
    replay cell "$(capture eggs)" --set shading.rate=cache --set shading.cell_pixels=$cell
    echo "$cell,$(count cell pixel_shader_invocations),$(error eggs.sample cell)"
  done
} >"$here/cells.csv"
