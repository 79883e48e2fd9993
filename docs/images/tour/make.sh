#!/usr/bin/env bash
# Runs the commands of docs/tour.md and takes its screenshots (Debian's chromium): docs/images/tour/make.sh
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
cd "$root"
sed -n '/^```sh$/,/^```$/p' docs/tour.md | grep '^\./tessera' | sed 's/ *#.*//' | bash -ex

# screenshot NAME HEIGHT ADDRESS
screenshot() {
  chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --disable-background-networking --user-data-dir="$(mktemp -d)" --virtual-time-budget=60000 \
    --window-size=1100,"$2" --screenshot="$here/$1.png" "file://$(realpath out/tour/entry/report.html)#$3" 2>/dev/null
}
screenshot first 1080 ''
screenshot tiles 1000 'section=frames'
