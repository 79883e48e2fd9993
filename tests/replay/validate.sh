#!/usr/bin/env bash
# Errors that the Khronos glTF validator finds in FILES, a line each: FILE, tab, code, tab, pointer, tab, message.
#
#   validate.sh FOLDER FILES...
#
# npm installs the validator into FOLDER, once. Exit status: 0 all were read · 77 cannot run here, standard output says why · else a failure.
set -euo pipefail
folder=$1
shift

command -v node >/dev/null || { echo "node is not installed"; exit 77; }
[ -d "$folder/node_modules/gltf-validator" ] ||
  bash "$(dirname "${BASH_SOURCE[0]}")/../support/npm_install.sh" "$folder" gltf-validator@2.0.0-dev.3.10
export NODE_PATH=$folder/node_modules
node - "$@" <<'END'
const fs = require('fs'), path = require('path'), validator = require('gltf-validator');
const kError = 0;
(async () => {
  for (const file of process.argv.slice(2)) {
    const beside = uri => new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri))));
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
      uri: path.basename(file), maxIssues: 200, externalResourceFunction: async uri => beside(uri)});
    for (const issue of report.issues.messages)
      if (issue.severity === kError) console.log([file, issue.code, issue.pointer ?? issue.offset, issue.message].join('\t'));
  }
})().catch(error => { console.error(error); process.exit(1); });
END
