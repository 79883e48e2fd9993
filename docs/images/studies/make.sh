#!/usr/bin/env bash
# Runs the study of docs/study_binning.md, makes its pictures (Debian's chromium) and prints its tables: docs/images/studies/make.sh [OUT]
# An OUT that holds the finished study is not run again. TESSERA names the program (default: the project's own).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)}
[ -f "$out/sweep.csv" ] || "${TESSERA:-$root/tessera}" sweep "$root/captures/studies/binning.json" --out "$out"

# picture NAME HEIGHT ADDRESS: one section of the page
picture() {
  chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$(mktemp -d)" --virtual-time-budget=60000 --window-size=980,"$2" --screenshot="$here/$1.png" \
    "file://$(realpath "$out")/report.html#$3" 2>/dev/null
}
picture queues 640 'section=curves&curves.along=tile.width&curves.lines=scheme&curves.column=baseline.pre-tessellation.queue_bytes_peak&curves.log=on&curves.parameter_buffer.bytes=16777216&curves.frontend.split_depth=0'
picture depth 640 'section=curves&curves.along=frontend.split_depth&curves.lines=tile.width&curves.column=baseline.pre-tessellation.dram_bytes&curves.parameter_buffer.bytes=16777216'
picture front 740 'section=pareto&pareto.across=baseline.pre-tessellation.queue_bytes_peak&pareto.up=baseline.pre-tessellation.dram_bytes&pareto.colour=parameter_buffer.bytes&pareto.log=on'

awk -F, '
  function spaced(n,  tail) { n = n ""; tail = ""; while (length(n) > 3) { tail = " " substr(n, length(n) - 2) tail; n = substr(n, 1, length(n) - 3) } return n tail }
  function at(name) { return $(column[name]) }
  function of(scheme, counter) { return at("baseline." scheme "." counter) }
  NR == 1 { for (c = 1; c <= NF; ++c) column[$c] = c; next }
  at("parameter_buffer.bytes") == 16777216 && at("frontend.split_depth") == 0 {
    pre = of("pre-tessellation", "queue_bytes_peak"); post = of("post-tessellation", "queue_bytes_peak"); pre_all = of("pre-tessellation", "dram_bytes"); post_all = of("post-tessellation", "dram_bytes")
    tiles = tiles sprintf("| %d | %s | %s | %s | %.1f | %s | %s | %s | %.2f |\n", at("tile.width"), spaced(pre), spaced(of("patch-whole", "queue_bytes_peak")), spaced(post), post / pre, spaced(pre_all),
      spaced(of("patch-whole", "dram_bytes")), spaced(post_all), post_all / pre_all)
  }
  at("parameter_buffer.bytes") == 16777216 && at("tile.width") == 32 {
    depths = depths sprintf("| %d | %s | %s | %s | %s | %s | %s | %s | %s |\n", at("frontend.split_depth"), spaced(at("frontend.sub_patches")), spaced(at("binner.entries")), spaced(at("binner.queue_bytes_peak")),
      spaced(of("pre-tessellation", "domain_evaluations")), spaced(at("tilecore.domain_evaluations")), spaced(at("dram.binner.tile_queue.written_bytes") + at("dram.tilecore.tile_queue.read_bytes")), spaced(at("dram.tilecore.patch_data.read_bytes")),
      spaced(of("pre-tessellation", "dram_bytes")))
  }
  at("tile.width") == 16 && (at("frontend.split_depth") == 0 || at("frontend.split_depth") == 6) {
    depth = at("frontend.split_depth"); bytes = at("parameter_buffer.bytes")
    partial[depth, bytes] = at("binner.partial_renders"); all[depth, bytes] = of("pre-tessellation", "dram_bytes"); over[bytes] = of("post-tessellation", "buffer_overflows"); post_of[bytes] = of("post-tessellation", "dram_bytes")
  }
  END {
    printf "tiles:\n%s\ndepths:\n%s\nbuffers:\n", tiles, depths
    for (bytes = 65536; bytes <= 16777216; bytes *= 4)
      printf "| %s | %d | %s | %d | %s | %d | %s |\n", spaced(bytes), partial[0, bytes], spaced(all[0, bytes]), partial[6, bytes], spaced(all[6, bytes]), over[bytes], spaced(post_of[bytes])
  }' "$out/sweep.csv"
