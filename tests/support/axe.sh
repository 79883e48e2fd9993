#!/usr/bin/env bash
# axe-core, which npm installs into FOLDER, once: the path of its script is printed.
#
#   axe.sh FOLDER
#
# Exit status: 0 there · 77 cannot run here, standard output says why · else a failure.
set -euo pipefail
folder=$1
script=$folder/node_modules/axe-core/axe.min.js

skip() { echo "$1"; exit 77; }
if [ ! -f "$script" ]; then
  for program in node npm; do command -v "$program" >/dev/null || skip "$program is not installed"; done
  mkdir -p "$folder"
  cd "$folder"
  [ -f package.json ] || echo '{"private": true}' >package.json
  npm install --no-audit --no-fund --silent axe-core@4 >install.log 2>&1 || skip "npm cannot install axe-core: $(tail -n 1 install.log)"
fi
echo -n "$script"
