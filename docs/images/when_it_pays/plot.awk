# Cost over triangle size as SVG, a panel for each case: awk -v cost=traffic|evaluations -f plot.awk points.csv
function px(size) { return left + 150 * log(size / 0.5) / log(128) }
function py(value) { return top + 130 * (1 - log(value / low) / log(high / low)) }
function text(x, y, anchor, words) { printf "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">%s</text>\n", x, y, anchor, words }
function panel(title, wanted,   s, r, path, v) {
  left = 70 + 200 * (panels % 4); top = 50 + 190 * int(panels / 4); ++panels
  printf "<rect x=\"%d\" y=\"%d\" width=\"150\" height=\"130\" fill=\"none\" stroke=\"#999\"/>\n", left, top
  text(left + 75, top - 8, "middle", title)
  for (v = 0.5; v < 65; v *= v < 1 ? 2 : 4) text(px(v), top + 144, "middle", v)
  for (v = low; v <= high * 1.01; v *= 10) { printf "<path d=\"M%d %.1fh150\" stroke=\"#ddd\"/>\n", left, py(v); if (panels % 4 == 1) text(left - 6, py(v) + 4, "end", v >= 1e6 ? v / 1e6 "M" : v / 1e3 "k") }
  for (s = 1; s <= schemes; ++s) {
    path = ""
    for (r = 1; r <= rows; ++r) if (place[r] == wanted) path = path (path == "" ? "M" : "L") sprintf("%.1f %.1f", px(px2[r]), py(value[r, s]))
    printf "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"%s\"/>\n", path, color[s], s == 1 ? 3 : 1.5
  }
}
BEGIN { FS = ","; schemes = split("#d55e00 #e69f00 #004d7a #0072b2 #56b4e9 #009e73 #cc79a7 #7a7f87", color, " ") }
NR == 1 { first = cost == "traffic" ? 7 : 7 + schemes; for (s = 1; s <= schemes; ++s) { scheme[s] = $(first + s - 1); sub(/.* /, "", scheme[s]) } next }
{
  place[++rows] = $1 "," $2 "," $3 "," $4; px2[rows] = $5
  for (s = 1; s <= schemes; ++s) { v = $(first + s - 1) - (cost == "traffic" ? finished : 0); value[rows, s] = v; if (!least || v < least) least = v; if (v > most) most = v }
}
END {
  for (low = 1; low * 10 <= least;) low *= 10
  for (high = low; high < most;) high *= 10
  print "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 880 480\" font-family=\"sans-serif\" font-size=\"11\"><rect width=\"880\" height=\"480\" fill=\"#fff\"/>"
  text(20, 20, "start", cost == "traffic" ? "Bytes over the memory interface without the finished frame, over px² of a triangle" : "Vertices evaluated, over px² of a triangle")
  panel("1 layer", "1,yes,0,32"); panel("4 layers", "4,yes,0,32"); panel("16 layers", "16,yes,0,32"); panel("4 layers, no attributes", "4,no,0,32")
  panel("4 layers, blur 8", "4,yes,8,32"); panel("4 layers, blur 32", "4,yes,32,32"); panel("4 layers, tiles 16", "4,yes,0,16"); panel("4 layers, tiles 64", "4,yes,0,64")
  for (s = 1; s <= schemes; ++s) { printf "<path d=\"M%d %dh20\" stroke=\"%s\" stroke-width=\"%s\"/>\n", 70 + 200 * ((s - 1) % 4), 434 + 22 * int((s - 1) / 4), color[s], s == 1 ? 3 : 1.5; text(96 + 200 * ((s - 1) % 4), 438 + 22 * int((s - 1) / 4), "start", scheme[s]) }
  print "</svg>"
}
