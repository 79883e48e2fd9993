# Convergence of a reference as SVG, from the lines "samples error" of several captures: awk -f converge.awk FILE...
function px(v) { return 70 + 500 * (log(v) - log(16)) / log(64) }
function py(v) { return 40 + 280 * (log(top) - log(v)) / (log(top) - log(low)) }
FNR == 1 { ++files; split(FILENAME, part, "/"); name[files] = part[length(part)]; sub(/\..*/, "", name[files]) }
{ count[files]++; sx[files, count[files]] = $1; sy[files, count[files]] = $2; if (top == "" || $2 > top) top = $2; if (low == "" || $2 < low) low = $2 }
END {
  split("#0072b2 #e69f00 #009e73 #d55e00 #cc79a7 #56b4e9 #000000", color, " ")
  print "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 760 370\" font-family=\"sans-serif\" font-size=\"12\"><rect width=\"760\" height=\"370\" fill=\"#fff\"/><text x=\"70\" y=\"24\" font-size=\"14\">Error of the reference over its samples</text>"
  for (v = 16; v <= 1024; v *= 2) printf "<path d=\"M%.1f 40V320\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"336\" text-anchor=\"middle\">%d</text>", px(v), px(v), v
  printf "<text x=\"320\" y=\"358\" text-anchor=\"middle\">samples per pixel</text><text x=\"64\" y=\"%.1f\" text-anchor=\"end\">%.4f</text><text x=\"64\" y=\"%.1f\" text-anchor=\"end\">%.4f</text>", py(top) + 4, top, py(low) + 4, low
  for (f = 1; f <= files; ++f) {
    path = ""; for (i = 1; i <= count[f]; ++i) path = path (i == 1 ? "M" : "L") px(sx[f, i]) " " py(sy[f, i])
    printf "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"2\"/>", path, color[f]
    printf "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\" stroke-dasharray=\"4 4\"/>", px(sx[f, 1]), py(sy[f, 1]), px(sx[f, count[f]]), py(sy[f, 1] * sqrt(sx[f, 1] / sx[f, count[f]])), color[f]
    printf "<circle cx=\"590\" cy=\"%d\" r=\"4\" fill=\"%s\"/><text x=\"600\" y=\"%d\">%s</text>\n", 40 + 18 * f, color[f], 44 + 18 * f, name[f]
  }
  print "<text x=\"590\" y=\"200\">dashed: power -0.5</text></svg>"
}
