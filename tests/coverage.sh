#!/usr/bin/env bash
# tests/coverage.sh BUILD   line coverage of the libraries after the runs of BUILD (configured with -DTESSERA_COVERAGE=ON), by room
#
#   cmake --preset release -B build/coverage -DTESSERA_TESTS=ON -DTESSERA_COVERAGE=ON && cmake --build build/coverage
#   ctest --test-dir build/coverage -j2 --label-exclude '-all$|^shards'; tests/coverage.sh build/coverage
#   ctest --test-dir build/coverage -j2 --label-regex '-all$' --label-exclude '^shards'; tests/coverage.sh build/coverage   # adds the other tier
#
# Programs write the counts to files at their end, so a limit on the size of files cuts them off. Leave that test out: -E
# ALimitOnTheSizeOfFiles
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$(cd "$1" && pwd)
find "$build" -name '*.gcda' -path '*tessera_*' -print0 | xargs -0 -n 20 gcov --json-format --stdout 2>/dev/null |
  python3 -c '
import collections, json, sys
root = sys.argv[1] + "/"
hits = collections.defaultdict(dict)  # a header or a kernel is compiled many times: a line ran if any of them did
decoder = json.JSONDecoder()
for text in sys.stdin:
    for source in json.loads(text)["files"]:
        name = source["file"]
        name = name[len(root):] if name.startswith(root) else name
        if name.startswith(("/", "build/", "tests/", "generated/")) or "/" not in name: continue
        lines = hits[name]
        for line in source["lines"]:
            number = line["line_number"]
            lines[number] = lines.get(number, False) or line["count"] > 0
rooms = collections.Counter(); ran = collections.Counter()
for name, lines in hits.items():
    room = name.split("/")[0]
    rooms[room] += len(lines); ran[room] += sum(lines.values())
for room in sorted(rooms): print(f"{room:12} {ran[room]:6} of {rooms[room]:6} lines  {100 * ran[room] / rooms[room]:5.1f} %")
print(f"all          {sum(ran.values()):6} of {sum(rooms.values()):6} lines  {100 * sum(ran.values()) / sum(rooms.values()):6.2f} %")
' "$root"
