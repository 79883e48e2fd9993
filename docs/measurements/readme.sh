#!/usr/bin/env bash
# The tables and the verdict of README.md, from its frame and from baselines.csv: docs/measurements/readme.sh
# TESSERA_PROGRAM names the program (default: the project's own).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
page=$here/../../README.md
out=$(mktemp -d)
trap 'rm -r "$out"' EXIT
cd "$here/../.."
"${TESSERA_PROGRAM:-./tessera}" replay captures/eggs.glb --baselines --quiet --no-report --out "$out/eggs"
megahertz=$("${TESSERA_PROGRAM:-./tessera}" describe gpu --json | awk '/"default"/ { value = $2 } /"key": "clock.mhz"/ { sub(/,/, "", value); print value; exit }')

# replace NAME: what stands between the page's marks "<!-- NAME -->" and "<!-- end NAME -->", by standard input
replace() {
  cat >"$out/table"
  awk -v name="$1" -v file="$out/table" '
    $0 == "<!-- end " name " -->" { inside = 0 }
    !inside { print }
    $0 == "<!-- " name " -->" { inside = 1; while ((getline line < file) > 0) print line }' "$page" >"$out/page"
  cat "$out/page" >"$page"
}
grouped='function grouped(x,   text) { x = sprintf("%.0f", x); while (length(x) > 3) { text = " " substr(x, length(x) - 2) text; x = substr(x, 1, length(x) - 3) } return x text }'

awk -F, "$grouped"'
  NR == 1 { for (c = 1; c <= NF; ++c) at[$c] = c; next }
  NR == 2 {
    print "| counter | `captures/eggs.glb`, 1280x720, 4 samples |"; print "|---|---:|"
    count = split("frontend.base_patches frontend.sub_patches binner.queue_bytes_peak tilecore.tessellated_sub_patches tilecore.triangles tilecore.samples_visible tilecore.pixel_shader_invocations tilecore.vertex_outputs dram.read_bytes dram.written_bytes timing.cycles", names, " ")
    for (k = 1; k <= count; ++k) print "| `" names[k] "` | " grouped($at[names[k]]) " |"
  }' "$out/eggs/stats.csv" | replace figures

awk -F, -v megahertz="$megahertz" "$grouped"'
  NR == 1 { for (c = 1; c <= NF; ++c) at[$c] = c; print "| machine | kind | peak of lists | all traffic | ms | mJ |"; print "|---|---|---:|---:|---:|---:|"; next }
  $1 != "total" {
    mark = $2 == "tessera" ? "**" : ""
    printf "| %s`%s`%s | %s | %s | %s | %.1f | %.1f |\n", mark, $2, mark, $at["kind"], grouped($at["baseline.queue_bytes_peak"]), grouped($at["baseline.dram_bytes"]), $at["baseline.cycles"] / megahertz / 1000, $at["baseline.energy_nj"] / 1e6
  }' "$out/eggs/baselines.csv" | replace baselines

awk -F, '
  function least(capture, cost, kinds,   best, s) {
    for (s in kind) if (index(kinds, kind[s]) && (s != "immediate" && s != "untiled" || kinds == "shipped") && (!best || value[capture, s, cost] < best)) best = value[capture, s, cost]
    return value[capture, "tessera", cost] / best
  }
  function range(cost, kinds,   c, r, low, high) {
    for (c = 1; c <= captures; ++c) {
      if (name[c] == "serpent") continue
      r = least(name[c], cost, kinds); if (!low || r < low) low = r; if (r > high) high = r
    }
    return sprintf("%.2f to %.2f", low, high)
  }
  NR == 1 { for (c = 1; c <= NF; ++c) at[$c] = c; next }
  {
    if (!($1 in known)) { known[$1] = 1; name[++captures] = $1 }
    kind[$2] = $at["kind"]
    value[$1, $2, "time"] = $at["cycles"]; value[$1, $2, "energy"] = $at["energy_nj"]; value[$1, $2, "traffic"] = $at["dram_bytes"]
  }
  END {
    delete kind["tessera"]; delete kind["patch-whole"]
    printf "**Verdict.** The six captures of patches are compared at frame 5 ([all captures](docs/measurements/baselines.csv)). Beside the best tiled baseline, idealised ones included, `tessera` takes %s of the time and %s of the energy. Beside the best machine that ships, it moves %s of the bytes and takes %s of the energy and %s of the time. On `serpent`, a mesh of triangles, it takes %.2f of the time and %.2f of the energy of the best tiled baseline: a machine for patches gains nothing there.\n",
      range("time", "shipped idealised"), range("energy", "shipped idealised"), range("traffic", "shipped"), range("energy", "shipped"), range("time", "shipped"), least("serpent", "time", "shipped idealised"), least("serpent", "energy", "shipped idealised")
  }' docs/measurements/baselines.csv | replace verdict
