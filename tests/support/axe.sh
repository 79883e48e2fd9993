#!/usr/bin/env bash
# axe-core, which npm installs into FOLDER, once: the path of its script is printed.
#
#   axe.sh FOLDER
#
# Exit status: 0 there · 77 cannot run here, standard output says why · else a failure.
set -euo pipefail
folder=$1
script=$folder/node_modules/axe-core/axe.min.js

[ -f "$script" ] || bash "$(dirname "${BASH_SOURCE[0]}")/npm_install.sh" "$folder" axe-core@4
echo -n "$script"
