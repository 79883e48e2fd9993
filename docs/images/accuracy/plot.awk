# Plot of tradeoff.csv as SVG, error against cycles with the front of all settings: awk -v title=T -f csv.awk -f plot.awk tradeoff.csv
function px(cycles) { return 70 + 560 * (log(cycles) - lx) / (hx - lx) }
function py(flip) { return 360 - 320 * (flip - ly) / (hy - ly) }
NR > 1 {
  split_csv($0, cell)
  if (cell[column["cycles"]] == "" || cell[column["knob"]] == "joint") next
  ++n; x[n] = cell[column["cycles"]] + 0; y[n] = cell[column["flip"]] + 0; knob_of[n] = cell[column["knob"]]; setting_of[n] = cell[column["setting"]]
  if (!(knob_of[n] in color)) { order[++knobs] = knob_of[n]; color[knob_of[n]] = palette(knobs) }
  if (n == 1) { lx = hx = log(x[n]); ly = hy = y[n] }
  if (log(x[n]) < lx) lx = log(x[n]); if (log(x[n]) > hx) hx = log(x[n]); if (y[n] < ly) ly = y[n]; if (y[n] > hy) hy = y[n]
}
function palette(i,   p) { split("#0072b2 #e69f00 #009e73 #d55e00 #56b4e9 #cc79a7 #8c6d1f #7a7f87 #004d7a #f0c36d #a23b72 #3b8c6e #b8860b #5b5ea6 #9b2335 #333333 #88b04b #955251", p, " "); return p[(i - 1) % 18 + 1] }
END {
  pad = (hx - lx) * 0.04 + 1e-9; lx -= pad; hx += pad; pad = (hy - ly) * 0.06 + 1e-9; ly -= pad; hy += pad
  print "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 830 410\" font-family=\"sans-serif\" font-size=\"12\"><rect width=\"830\" height=\"410\" fill=\"#fff\"/>"
  printf "<text x=\"70\" y=\"24\" font-size=\"14\">%s</text><rect x=\"70\" y=\"40\" width=\"560\" height=\"320\" fill=\"none\" stroke=\"#999\"/>", title
  for (e = 3; e <= 9; ++e) for (m = 1; m <= 5; m += (m == 2 ? 3 : 1)) { v = m * 10 ^ e; if (log(v) > lx && log(v) < hx) printf "<path d=\"M%.1f 40V360\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"376\" text-anchor=\"middle\">%s</text>", px(v), px(v), (v < 1000000 ? v / 1000 "k" : v / 1000000 "M") }
  for (i = 0; i <= 5; ++i) { v = ly + (hy - ly) * i / 5; printf "<text x=\"64\" y=\"%.1f\" text-anchor=\"end\">%.3f</text>", py(v) + 4, v }
  print "<text x=\"350\" y=\"398\" text-anchor=\"middle\">cycles of the frame (logarithmic)</text><text x=\"16\" y=\"200\" transform=\"rotate(-90 16 200)\" text-anchor=\"middle\">mean FLIP</text>"
  # The front, from the cheapest on.
  path = ""; best = 1e9; last = 0
  while (1) {
    nearest = 0
    for (i = 1; i <= n; ++i) if (y[i] < best && (nearest == 0 || x[i] < x[nearest] || (x[i] == x[nearest] && y[i] < y[nearest]))) nearest = i
    if (nearest == 0) break
    path = path (path == "" ? "M" px(x[nearest]) " " py(y[nearest]) : "H" px(x[nearest]) "V" py(y[nearest])); best = y[nearest]; front[nearest] = 1
  }
  printf "<path d=\"%s\" fill=\"none\" stroke=\"#000\" stroke-width=\"1.5\"/>\n", path
  for (i = 1; i <= n; ++i) printf "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%s\" fill=\"%s\"%s><title>%s: %s</title></circle>\n", px(x[i]), py(y[i]), front[i] ? 5 : 3.5, color[knob_of[i]], front[i] ? " stroke=\"#000\"" : "", knob_of[i], setting_of[i]
  for (i = 1; i <= knobs; ++i) printf "<circle cx=\"650\" cy=\"%d\" r=\"4\" fill=\"%s\"/><text x=\"660\" y=\"%d\">%s</text>\n", 40 + 18 * i, color[order[i]], 44 + 18 * i, order[i]
  print "</svg>"
}
