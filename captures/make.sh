#!/usr/bin/env bash
# Makes the shipped captures from their sources: captures/make.sh [OUTDIR]   (default: the folder of this script)
# TESSERA_BUILD names the build folder (default: build/release).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=${TESSERA_BUILD:-$here/../build/release}
out=${1:-$here}
sources=$(mktemp -d)
trap 'rm -rf "$sources"' EXIT
"$build/tessera_make_captures" "$sources"
for name in eggs vases serpent flyby stroll workshop city garden; do
  "$build/tessera" pack "$sources/$name.gltf" "$out/$name.glb"
done
for name in city_evening garden_lamps corridor; do
  "$build/tessera" pack "$sources/$name.gltf" "$out/$name.glb" --webp 85
done
mkdir -p "$out/studies"
for name in wall_1 wall_4 wall_16 wall_4_plain; do
  "$build/tessera" pack "$sources/$name.gltf" "$out/studies/$name.glb"
done
