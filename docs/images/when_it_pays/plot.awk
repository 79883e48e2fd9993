# Cost of the other schemes over ours against triangle size as SVG, a panel for each case: awk -v cost=traffic|evaluations|cycles|energy -f plot.awk points.csv
function px(size) { return left + 150 * log(size / 0.5) / log(128) }
function py(ratio) { return top + 130 * (1 - log(ratio / low) / log(high / low)) }
function text(x, y, anchor, words) { printf "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>\n", x, y, anchor, words }
# The power of ten, in halves, below x.
function below(x,   h) { h = int(2 * log(x) / log(10)); return h - (h > 2 * log(x) / log(10)) }
function panel(title, wanted,   s, r, path, v) {
  left = 50 + 205 * (panels % 4); top = 50 + 190 * int(panels / 4); ++panels
  printf "<rect x=\"%d\" y=\"%d\" width=\"150\" height=\"130\" fill=\"none\" stroke=\"#999\"/>\n", left, top
  text(left + 75, top - 8, "middle", title)
  for (v = 0.5; v < 65; v *= v < 1 ? 2 : 4) text(px(v), top + 144, "middle", v)
  for (v = 0.01; v <= high; v *= 10) if (v >= low) { printf "<path d=\"M%d %.1fh150\" stroke=\"%s\"/>\n", left, py(v), (v > 0.9 && v < 1.1 ? "#000" : "#ddd"); text(left - 6, py(v) + 4, "end", v) }
  for (s = 2; s <= schemes; ++s) {
    path = ""
    for (r = 1; r <= rows; ++r) if (place[r] == wanted) path = path (path == "" ? "M" : "L") sprintf("%.1f %.1f", px(px2[r]), py(ratio[r, s]))
    printf "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\"/>\n", path, color[s]
  }
}
BEGIN { FS = ","; schemes = split("#000 #e69f00 #004d7a #0072b2 #d55e00 #009e73 #cc79a7 #7a7f87 #8b5a2b #b8a000 #56b4e9 #a05195 #665191", color, " ") }
NR == 1 { split("traffic evaluations cycles energy", costs, " "); for (s = 1; s <= 4; ++s) if (costs[s] == cost) first = 7 + (s - 1) * schemes; for (s = 1; s <= schemes; ++s) { scheme[s] = $(first + s - 1); sub(/.* /, "", scheme[s]) } next }
{
  place[++rows] = $1 "," $2 "," $3 "," $4; px2[rows] = $5; both = cost == "traffic" ? $NF : 0
  for (s = 2; s <= schemes; ++s) { v = ($(first + s - 1) - both) / ($first - both); ratio[rows, s] = v; if (!least || v < least) least = v; if (v > most) most = v }
}
END {
  low = 10 ^ (below(least) / 2); high = 10 ^ (below(most) / 2 + 0.5)
  print "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 500\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"860\" height=\"500\" fill=\"#fff\"/>"
  text(20, 20, "start", (cost == "traffic" ? "Traffic without the finished frame" : cost == "evaluations" ? "Vertices evaluated" : cost == "cycles" ? "Cycles" : "Energy") ", of other schemes over ours, against px² of a triangle: above 1 ours costs less")
  panel("1 layer", "1,yes,0,32"); panel("4 layers", "4,yes,0,32"); panel("16 layers", "16,yes,0,32"); panel("4 layers, plain", "4,no,0,32")
  panel("4 layers, blur 8", "4,yes,8,32"); panel("4 layers, blur 32", "4,yes,32,32"); panel("4 layers, tiles 16", "4,yes,0,16"); panel("4 layers, tiles 64", "4,yes,0,64")
  for (s = 2; s <= schemes; ++s) { printf "<path d=\"M%d %dh20\" stroke=\"%s\" stroke-width=\"2\"/>\n", 50 + 205 * ((s - 2) % 4), 434 + 22 * int((s - 2) / 4), color[s]; text(76 + 205 * ((s - 2) % 4), 438 + 22 * int((s - 2) / 4), "start", scheme[s]) }
  print "</svg>"
}
