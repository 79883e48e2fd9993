#!/usr/bin/env bash
# npm installs PACKAGES into FOLDER.
#
#   npm_install.sh FOLDER PACKAGE...
#
# Exit status: 0 there · 77 cannot be had here, standard output says why · else a failure.
set -euo pipefail
folder=$1
shift

skip() { echo "$1"; exit 77; }
for program in node npm; do command -v "$program" >/dev/null || skip "$program is not installed"; done
mkdir -p "$folder"
cd "$folder"
[ -f package.json ] || echo '{"private": true}' >package.json
npm install --no-audit --no-fund --silent "$@" >install.log 2>&1 || skip "npm cannot install $*: $(tail -n 1 install.log)"
