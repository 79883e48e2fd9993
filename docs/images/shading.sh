#!/usr/bin/env bash
# Prints the tables of docs/shading.md: docs/images/shading.sh
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)/../..
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

replay() { # NAME CAPTURE ARGUMENTS...
  local name=$1 capture=$2
  shift 2
  "$root/tessera" replay "$capture" --quiet --out "$out/$name" "$@"
}
count() { # NAME COUNTER -> its total, digits in groups of three
  grep -o "\"tilecore.$2\": [0-9]*" "$out/$1/stats.json" | tail -1 | grep -o '[0-9]*$' | sed -E ':a; s/([0-9])([0-9]{3})($| )/\1 \2\3/; ta'
}
error() { # REFERENCE NAME -> "PSNR | FLIP", or nothing for the reference itself
  [ "$1" != "$2" ] || { echo "|"; return; }
  "$root/tessera" compare "$out/$1" "$out/$2" | awk '/^frame_/ {printf "%.1f dB | %.4f", $2, $5; exit}'
}
capture() { echo "$root/captures/$1.glb"; }

echo "| capture | rate | visible samples | invocations | saved | PSNR | FLIP |"
echo "|---|---|---:|---:|---:|---:|---:|"
for name in eggs serpent flyby vases; do
  for rate in sample pixel cache; do
    replay "$name.$rate" "$(capture $name)" --set shading.rate=$rate
    echo "| $name | $rate | $(count $name.$rate samples_visible) | $(count $name.$rate pixel_shader_invocations) | $(count $name.$rate pixel_shader_invocations_saved) | $(error $name.sample $name.$rate) |"
  done
done

echo
echo "| capture | shutter, frames | sample | pixel | cache | cache, groups of 4x4 tiles |"
echo "|---|---:|---:|---:|---:|---:|"
for name in serpent flyby; do
  for shutter in 0 0.125 0.25 0.5 1; do
    "$root/tessera" pack "$(capture $name)" "$out/$name.glb" --shutter 0:$shutter >"$out/pack.log" 2>&1
    row="| $name | $shutter |"
    for rate in sample pixel cache; do
      replay blur "$out/$name.glb" --set shading.rate=$rate
      row+=" $(count blur pixel_shader_invocations) |"
    done
    replay blur "$out/$name.glb" --set shading.rate=cache --set shading_cache.group=4 --set shading_cache.entries=16384
    echo "$row $(count blur pixel_shader_invocations) |"
  done
done

echo
echo "| tiles | group | 64 entries | 256 | 1 024 | 4 096 | 16 384 |"
echo "|---:|---:|---:|---:|---:|---:|---:|"
for machine in "16 1" "32 1" "32 2" "32 4" "32 8" "64 1"; do
  read -r tile group <<<"$machine"
  row="| ${tile}x$tile | ${group}x$group |"
  for entries in 64 256 1024 4096 16384; do
    replay room "$(capture eggs)" --set shading.rate=cache --set tile.width=$tile --set tile.height=$tile --set shading_cache.group=$group --set shading_cache.entries=$entries
    row+=" $(count room pixel_shader_invocations) |"
  done
  echo "$row"
done

echo
echo "| cell, pixels | invocations | PSNR | FLIP |"
echo "|---:|---:|---:|---:|"
for cell in 0.5 1 2 4; do
  replay cell "$(capture eggs)" --set shading.rate=cache --set shading.cell_pixels=$cell
  echo "| $cell | $(count cell pixel_shader_invocations) | $(error eggs.sample cell) |"
done
