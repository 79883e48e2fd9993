# Pixel-shader invocations against the shutter as SVG: awk -f plot.awk blur.csv
function px(shutter) { return 80 + 420 * shutter }
function py(count) { return 320 - 270 * count / 1000000 }
function curve(capture, name, values, color, dash,   i, path) {
  for (i = 1; i <= rows; ++i) if (of[i] == capture) path = path (path == "" ? "M" : "L") px(shutter[i]) " " py(values[i])
  printf "<path d=\"%s\" fill=\"none\" stroke=\"%s\" stroke-width=\"2\"%s/>\n", path, color, dash == "" ? "" : " stroke-dasharray=\"" dash "\""
  printf "<path d=\"M520 %dh24\" stroke=\"%s\" stroke-width=\"2\"%s/><text x=\"552\" y=\"%d\">%s: %s</text>\n", 60 + 20 * lines, color, dash == "" ? "" : " stroke-dasharray=\"" dash "\"", 64 + 20 * lines, capture, name
  ++lines
}
BEGIN { FS = "," }
NR > 1 { ++rows; of[rows] = $1; shutter[rows] = $2; pixel[rows] = $4; cache[rows] = $5 }
END {
  print "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 740 370\" font-family=\"sans-serif\" font-size=\"12\"><rect width=\"740\" height=\"370\" fill=\"#fff\"/><text x=\"80\" y=\"24\" font-size=\"14\">Pixel-shader invocations against the shutter, 1280x720</text>"
  for (i = 0; i <= 4; ++i) printf "<path d=\"M%.1f 50V320\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"336\" text-anchor=\"middle\">%.2f</text>\n", px(i / 4), px(i / 4), i / 4
  for (i = 0; i <= 1000000; i += 250000) printf "<path d=\"M80 %.1fH500\" stroke=\"#ddd\"/><text x=\"74\" y=\"%.1f\" text-anchor=\"end\">%dk</text>\n", py(i), py(i) + 4, i / 1000
  print "<text x=\"290\" y=\"358\" text-anchor=\"middle\">shutter, frames</text>"
  curve("serpent", "per pixel", pixel, "#0072b2", ""); curve("serpent", "cache", cache, "#d55e00", "")
  curve("flyby", "per pixel", pixel, "#0072b2", "6 4"); curve("flyby", "cache", cache, "#d55e00", "6 4")
  print "</svg>"
}
