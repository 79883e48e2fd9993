#!/usr/bin/env bash
# Runs the study of docs/bounds_and_binning.md and makes its plots (Debian's chromium) and its tables tiles.csv, depths.csv, buffers.csv: docs/images/studies/make.sh [OUT]
# An OUT that holds the finished study is not run again. TESSERA names the program (default: the project's own).
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$here/../../..
out=${1:-$(mktemp -d)}
[ -f "$out/sweep.csv" ] || "${TESSERA:-$root/tessera}" sweep "$root/captures/studies/binning.json" --out "$out"

# plot NAME HEIGHT ADDRESS: one section of the page
plot() {
  chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --user-data-dir="$(mktemp -d)" --virtual-time-budget=60000 --window-size=980,"$2" --screenshot="$here/$1.png" \
    "file://$(realpath "$out")/report.html#$3" 2>/dev/null
}
plot queues 640 'section=curves&curves.along=tile.width&curves.lines=scheme&curves.column=baseline.tessera.queue_bytes_peak&curves.log=on&curves.parameter_buffer.bytes=16777216&curves.frontend.split_depth=0'
plot depth 640 'section=curves&curves.along=frontend.split_depth&curves.lines=tile.width&curves.column=baseline.tessera.dram_bytes&curves.parameter_buffer.bytes=16777216'
plot front 740 'section=pareto&pareto.across=baseline.tessera.queue_bytes_peak&pareto.up=baseline.tessera.dram_bytes&pareto.colour=parameter_buffer.bytes&pareto.log=on'

awk -F, -v folder="$here" '
  function at(name) { return $(column[name]) }
  function of(scheme, counter) { return at("baseline." scheme "." counter) }
  BEGIN {
    tiles = folder "/tiles.csv"; depths = folder "/depths.csv"; buffers = folder "/buffers.csv"
    print "tile,pre_queue_bytes,patch_whole_queue_bytes,post_queue_bytes,post_over_pre_queues,pre_traffic_bytes,patch_whole_traffic_bytes,post_traffic_bytes,post_over_pre_traffic" > tiles
    print "depth,sub_patches,entries,queue_bytes_peak,domain_evaluations_uncached,domain_evaluations,queue_traffic_bytes,patch_data_bytes,traffic_bytes" > depths
    print "buffer_bytes,partial_renders_depth_0,traffic_depth_0,partial_renders_depth_6,traffic_depth_6,post_overflows,post_traffic" > buffers
  }
  NR == 1 { for (c = 1; c <= NF; ++c) column[$c] = c; next }
  at("parameter_buffer.bytes") == 16777216 && at("frontend.split_depth") == 0 {
    pre = of("tessera", "queue_bytes_peak"); post = of("post-tessellation", "queue_bytes_peak"); pre_all = of("tessera", "dram_bytes"); post_all = of("post-tessellation", "dram_bytes")
    printf "%d,%d,%d,%d,%.1f,%d,%d,%d,%.2f\n", at("tile.width"), pre, of("patch-whole", "queue_bytes_peak"), post, post / pre, pre_all, of("patch-whole", "dram_bytes"), post_all, post_all / pre_all > tiles
  }
  at("parameter_buffer.bytes") == 16777216 && at("tile.width") == 32 {
    printf "%d,%d,%d,%d,%d,%d,%d,%d,%d\n", at("frontend.split_depth"), at("frontend.sub_patches"), at("binner.entries"), at("binner.queue_bytes_peak"), of("tessera", "domain_evaluations"), at("tilecore.domain_evaluations"),
      at("dram.binner.tile_queue.written_bytes") + at("dram.tilecore.tile_queue.read_bytes"), at("dram.tilecore.patch_data.read_bytes"), of("tessera", "dram_bytes") > depths
  }
  at("tile.width") == 16 && (at("frontend.split_depth") == 0 || at("frontend.split_depth") == 6) {
    depth = at("frontend.split_depth"); bytes = at("parameter_buffer.bytes")
    partial[depth, bytes] = at("binner.partial_renders"); all[depth, bytes] = of("tessera", "dram_bytes"); over[bytes] = of("post-tessellation", "buffer_overflows"); post_of[bytes] = of("post-tessellation", "dram_bytes")
  }
  END {
    for (bytes = 65536; bytes <= 16777216; bytes *= 4)
      printf "%d,%d,%d,%d,%d,%d,%d\n", bytes, partial[0, bytes], all[0, bytes], partial[6, bytes], all[6, bytes], over[bytes], post_of[bytes] > buffers
  }' "$out/sweep.csv"
