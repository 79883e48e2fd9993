#!/bin/sh
# Measures the hard cases again, renders their images, and writes their tables into docs/hard_cases.md.
set -eu
cd "$(dirname "$0")/../../.."
folder=docs/images/stability
rm -f $folder/*.webp
${TESSERA:-./tessera} selfcheck --stability --out $folder
python3 - <<'PYTHON'
import re
from pathlib import Path

page, tables = Path("docs/hard_cases.md"), Path("docs/images/stability/stability.md")
before, after = re.fullmatch("(.*<!-- cases -->\n).*(<!-- end cases -->.*)", page.read_text(), re.S).groups()
page.write_text(before + tables.read_text() + after)
tables.unlink()
PYTHON
