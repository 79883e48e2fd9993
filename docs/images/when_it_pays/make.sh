#!/usr/bin/env bash
# Runs the studies of docs/when_it_pays.md and makes its tables points.csv, parts.csv, break_even.csv, doubts.csv, its plots and the tables in the page: docs/images/when_it_pays/make.sh [OUT]
# An OUT that holds the finished study is not run again, an unfinished one goes on. TESSERA names the program (default: the project's own).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)}
page=$root/docs/when_it_pays.md
[ -f "$out/sweep.csv" ] || "${TESSERA:-$root/tessera}" sweep "$root/captures/studies/when_it_pays.json" --out "$out"

[ -f "$out/doubts/sweep.csv" ] || "${TESSERA:-$root/tessera}" sweep "$root/captures/studies/four_doubts.json" --out "$out/doubts"

awk -v folder="$here" -f "$here/tables.awk" "$out/sweep.csv"
awk -v folder="$here" -v doubts=1 -f "$here/tables.awk" "$out/doubts/sweep.csv"
for cost in traffic evaluations cycles energy; do
  awk -v cost=$cost -f "$here/plot.awk" "$here/points.csv" >"$here/$cost.svg"
done

# replace NAME FILE: what stands between the page's marks "<!-- NAME -->" and "<!-- end NAME -->"
replace() {
  awk -v name="$1" -v file="$2" '
    $0 == "<!-- end " name " -->" { inside = 0 }
    !inside { print }
    $0 == "<!-- " name " -->" { inside = 1; while ((getline line < file) > 0) print line }' "$page" >"$new"
  cat "$new" >"$page"
}
table=$(mktemp) new=$(mktemp)
trap 'rm -f "$table" "$new"' EXIT
awk -F, -v table=ranges -f "$here/page.awk" "$here/points.csv" >"$table" && replace ranges "$table"
awk -F, -v table=traffic -f "$here/page.awk" "$here/break_even.csv" >"$table" && replace break-even "$table"
awk -F, '{ n = NF; gsub(/,/, " | "); print "| " $0 " |" } NR == 1 { row = "|---|---|"; for (c = 3; c <= n; ++c) row = row "---:|"; print row }' "$here/doubts.csv" >"$table" && replace doubts "$table"
for cost in cycles energy; do
  awk -F, -v table=$cost -f "$here/page.awk" "$here/break_even.csv" >"$table" && replace $cost "$table"
done
