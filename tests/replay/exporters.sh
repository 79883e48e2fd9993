#!/usr/bin/env bash
# Compresses a model with today's exporters: FOLDER/MODEL.WAY.glb for every way that gltf-transform and gltfpack have.
#
#   exporters.sh FOLDER MODEL.gltf...
#
# Both are installed by npm into FOLDER, once. Exit status: 0 all written · 77 cannot run here, standard output says why · else a failure.
set -euo pipefail
folder=$1
shift

command -v node >/dev/null || { echo "node is not installed"; exit 77; }
if [ ! -x "$folder/node_modules/.bin/gltfpack" ] || [ ! -x "$folder/node_modules/.bin/gltf-transform" ]; then
  bash "$(dirname "${BASH_SOURCE[0]}")/../support/npm_install.sh" "$folder" @gltf-transform/cli@4 gltfpack@1
fi
cd "$folder"

# Writes each file once: a file of an earlier run stays.
write() { # OUTPUT COMMAND...
  [ -f "$1" ] && return
  "${@:2}" >"$1.log" 2>&1 || { cat "$1.log" >&2; rm -f "$1"; exit 1; }
}
for model in "$@"; do
  name=$(basename "$model" .gltf)
  for way in optimize draco meshopt quantize webp; do
    options=()
    [ $way != optimize ] || options=(--texture-compress webp)
    write "$name.transform_$way.glb" node_modules/.bin/gltf-transform $way "$model" "$name.transform_$way.glb" "${options[@]}"
  done
  # Plain; compressed; more; by the Khronos extension (version 1 of attributes, colour filter); with fallback; interleaved; normalised and
  # float positions; few bits; many bits of normals.
  while read -r way options; do
    # shellcheck disable=SC2086
    write "$name.pack_$way.glb" node_modules/.bin/gltfpack -i "$model" -o "$name.pack_$way.glb" $options
  done <<'END'
plain
c -c
cc -cc
khr -cc -ce khr
fallback -cf
interleaved -c -vi
normalized -c -vpn
float -c -vpf -vtf -vnf
few_bits -c -vp 8 -vt 8 -vn 4
normals -cc -ce khr -vn 12 -vc 12
unquantized -c -noq
END
done
