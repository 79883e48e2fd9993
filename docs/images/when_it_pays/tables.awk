# Tables of docs/when_it_pays.md from a sweep: awk -v folder=DIR -f tables.awk sweep.csv writes points.csv, parts.csv and break_even.csv into DIR.
# With -v doubts=1, of a sweep of captures/studies/four_doubts.json: doubts.csv alone, sizes where ours costs less under each doubt.
# A study leaves columns out that are zero everywhere.
function at(name) { return name in column ? $(column[name]) : 0 }
function of(scheme, counter) { return at("baseline." scheme "." counter) }
# Where ours costs less, in px2: all, none, <X, >X, X-Y; between two sizes interpolated, the logarithm of the costs' ratio over that of the size.
function cheaper(place, cost, scheme,   i, n, x, d, last, before, start, inside, text) {
  n = split(sizes_of[place], x, " ")
  for (i = 1; i <= n; ++i) {
    d = log(value[place, cost, ours, x[i]] / value[place, cost, scheme, x[i]])
    if (i == 1 && d < 0) { inside = 1; start = 0 }
    else if (i > 1 && (d < 0) != (before < 0)) {
      if (d < 0) { inside = 1; start = crossing(last, before, x[i], d) }
      else { inside = 0; text = text (text == "" ? "" : "+") (start ? number(start) "-" : "<") number(crossing(last, before, x[i], d)) }
    }
    before = d; last = x[i]
  }
  if (inside) text = text (text == "" ? "" : "+") (start ? ">" number(start) : "all")
  return text == "" ? "none" : text
}
function crossing(a, da, b, db) { return exp(log(a) + (log(b) - log(a)) * da / (da - db)) }
function number(x) { return sprintf(x < 10 ? "%.1f" : "%.0f", x) }
BEGIN {
  FS = ","; ours = "tessera"
  schemes = split("tessera patch-whole post-tessellation post-position deferred-vertex visibility-stream control-list immediate tessellated-in-memory untiled mesh-shader-ring mesh-shader-compact mesh-shader-references", scheme_of, " ")
  points = folder "/points.csv"; parts = folder "/parts.csv"; lines = folder "/break_even.csv"; blur_of[0] = 0; blur_of[1] = 8; blur_of[2] = 32
  head = "layers,attributes,blur,tile,px2,triangles"
  costs_count = split("traffic evaluations cycles energy", costs, " ")
  for (c = 1; c <= costs_count; ++c) for (s = 1; s <= schemes; ++s) head = head "," costs[c] " " scheme_of[s]
  if (!doubts) print head ",finished" > points
  if (!doubts) print "layers,attributes,blur,tile,px2,scheme,lists_written,lists,records,frame,evaluations,bounding_operations,partial_render_at_half,spill_at_half,cycles,energy_nj" > parts
}
function doubt_of() {
  if (at("shader.costs") == "constant") return "constant costs"
  if (at("triangle_setup.triangles_per_clk") == 4) return "set-up x4"
  if (at("energy.bound_pj") != 1000) return at("energy.bound_pj") > 1000 ? "against ours" : "for ours"
  return "as it is"
}
NR == 1 { for (c = 1; c <= NF; ++c) column[$c] = c; next }
at("status") != "ok" { print "a point failed: " $0 > "/dev/stderr"; failed = 1; exit }
{
  if (doubts) {
    place = doubt_of(); px2 = sprintf("%.1f", at("tessellation.target_edge_pixels") ^ 2 / 2)
    if (!(place in known)) { known[place] = 1; place_of[++places] = place }
    sizes_of[place] = sizes_of[place] " " px2
    for (s = 1; s <= schemes; ++s) { n = scheme_of[s]; value[place, "cycles", n, px2] = of(n, "cycles"); value[place, "energy", n, px2] = of(n, "energy_nj") }
    next
  }
  capture = at("capture"); sub(/.*wall_/, "", capture); sub(/\.glb.*/, "", capture)
  layers = capture + 0; attributes = capture ~ /plain/ ? "no" : "yes"; blur = blur_of[at("frame") + 0]; tile = at("tile.width")
  px2 = sprintf("%.1f", at("tessellation.target_edge_pixels") ^ 2 / 2); place = layers "," attributes "," blur "," tile
  if (!(place in known)) { known[place] = 1; place_of[++places] = place }
  if (!((place, px2) in seen)) { seen[place, px2] = 1; sizes_of[place] = sizes_of[place] " " px2 }
  finished = of(ours, "frame_bytes_written")
  row = place "," px2 "," of("post-tessellation", "primitives"); more = ""; times = ""; energies = ""
  for (s = 1; s <= schemes; ++s) {
    n = scheme_of[s]; all = of(n, "dram_bytes"); evaluations = of(n, "position_evaluations") + of(n, "domain_evaluations_cached")
    row = row "," sprintf("%.0f", all); more = more "," sprintf("%.0f", evaluations)
    value[place, "traffic", n, px2] = all - finished; value[place, "evaluations", n, px2] = evaluations
    times = times "," sprintf("%.0f", of(n, "cycles")); value[place, "cycles", n, px2] = of(n, "cycles")
    energies = energies "," sprintf("%.0f", of(n, "energy_nj")); value[place, "energy", n, px2] = of(n, "energy_nj")
    frame = of(n, "frame_bytes_read") + of(n, "frame_bytes_written"); records = of(n, "patch_bytes_cached")
    if (tile == 32 && blur != 8 && (px2 + 0 == 1 || px2 + 0 == 16))
      printf "%s,%s,%s,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f,%.0f\n", place, px2, n, of(n, "queue_bytes_written"), all - frame - records, records, frame, evaluations, of(n, "bounding_operations"), of(n, "partial_render_bytes"), of(n, "spill_bytes"), of(n, "cycles"), of(n, "energy_nj") > parts
  }
  print row more times energies "," sprintf("%.0f", finished) > points
}
END {
  if (failed) exit 1
  head = doubts ? "cost,doubt" : "cost,layers,attributes,blur,tile"; if (doubts) lines = folder "/doubts.csv"
  for (s = 2; s <= schemes; ++s) head = head "," scheme_of[s]
  print head > lines
  for (c = doubts ? 3 : 1; c <= costs_count; ++c)
    for (p = 1; p <= places; ++p) {
      row = costs[c] "," place_of[p]
      for (s = 2; s <= schemes; ++s) row = row "," cheaper(place_of[p], costs[c], scheme_of[s])
      print row > lines
    }
}
