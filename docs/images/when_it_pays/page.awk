# The tables of docs/when_it_pays.md: awk -F, -v table=traffic|cycles|energy -f page.awk break_even.csv or, with table=ranges, points.csv
function bars(   c, row) { row = "|"; for (c = 1; c <= n; ++c) row = row " " cell[c] " |"; return row }
function rule(   c, row) { row = "|"; for (c = 1; c <= n; ++c) row = row "---" (c > 1 ? ":" : "") "|"; return row }
table == "ranges" && NR == 1 {
  n = split("scheme,traffic,evaluations,cycles,energy", cell, ","); print bars(); print rule()
  schemes = (NF - 7) / 4; last = 6 + schemes
  for (c = 8; c <= last; ++c) { scheme[c] = $c; sub(/.* /, "", scheme[c]) }
  next
}
table == "ranges" {
  for (c = 8; c <= last; ++c)
    for (k = 0; k < 4; ++k) {
      both = k ? 0 : $NF; ratio = ($(c + schemes * k) - both) / ($(7 + schemes * k) - both)
      if (NR == 2 || ratio < least[c, k]) least[c, k] = ratio
      if (NR == 2 || ratio > most[c, k]) most[c, k] = ratio
    }
}
table != "ranges" && (NR == 1 || $1 == table) {
  n = NF - 4; cell[1] = ""
  for (c = 6; c <= NF; ++c) cell[c - 4] = NR == 1 ? "`" $c "`" : $c
  if (NR == 1) { print bars(); print rule() } else cells[$2 "," $3 "," $4 "," $5] = bars()
}
# One thing changes at a time, around 4 layers.
function show(name, place) { sub(/^\|  \|/, "| " name " |", cells[place]); print cells[place] }
END {
  for (c = 8; table == "ranges" && c <= last; ++c) {
    cell[1] = "`" scheme[c] "`"
    for (k = 0; k < 4; ++k) cell[2 + k] = sprintf("%.2f to " (most[c, k] < 10 ? "%.2f" : "%.1f"), least[c, k], most[c, k])
    print bars()
  }
  if (table == "ranges") exit
  show("1 layer", "1,yes,0,32"); show("1 layer, blur 8", "1,yes,8,32"); show("1 layer, blur 32", "1,yes,32,32")
  show("4 layers", "4,yes,0,32"); show("16 layers", "16,yes,0,32"); show("blur 8", "4,yes,8,32"); show("blur 32", "4,yes,32,32")
  show("plain", "4,no,0,32"); show("tiles 16", "4,yes,0,16"); show("tiles 64", "4,yes,0,64")
}
