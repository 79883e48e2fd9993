# The tables of docs/when_it_pays.md: awk -F, -v table=traffic|evaluations -f page.awk break_even.csv, with table=parts of parts.csv, with table=ranges and finished=BYTES of points.csv
function bars(   c, row) { row = "|"; for (c = 1; c <= n; ++c) row = row " " cell[c] " |"; return row }
function rule(   c, row) { row = "|"; for (c = 1; c <= n; ++c) row = row "---" (c > 1 ? ":" : "") "|"; return row }
NR == 1 && table == "parts" { n = split("scheme,lists,records,frame,evaluations,bounds,written,partial,spill", cell, ","); print bars(); print rule(); next }
table == "parts" && $1 == 4 && $2 == "yes" && $3 == 0 && $5 == 1 {
  cell[1] = "`" $6 "`"; cell[2] = sprintf("%.2f", $8 / 1e6); cell[3] = sprintf("%.2f", $9 / 1e6); cell[4] = sprintf("%.2f", $10 / 1e6)
  cell[5] = sprintf("%.0f", $11 / 1e3); cell[6] = sprintf("%.1f", $12 / 1e3); cell[7] = sprintf("%.3f", $7 / 1e6)
  cell[8] = sprintf("%.1f", $13 / 1e6); cell[9] = sprintf("%.2f", $14 / 1e6); print bars()
}
table == "ranges" && NR == 1 {
  n = split("scheme,traffic,evaluations", cell, ","); print bars(); print rule()
  for (c = 8; c <= 14; ++c) { scheme[c] = $c; sub(/.* /, "", scheme[c]) }
  next
}
table == "ranges" {
  for (c = 8; c <= 14; ++c)
    for (k = 0; k < 2; ++k) {
      both = k ? 0 : finished; ratio = ($(c + 8 * k) - both) / ($(7 + 8 * k) - both)
      if (NR == 2 || ratio < least[c, k]) least[c, k] = ratio
      if (NR == 2 || ratio > most[c, k]) most[c, k] = ratio
    }
}
(table == "traffic" || table == "evaluations") && (NR == 1 || $1 == table) {
  n = NF - 4; cell[1] = ""
  for (c = 6; c <= NF; ++c) cell[c - 4] = NR == 1 ? "`" $c "`" : $c
  if (NR == 1) { print bars(); print rule() } else cells[$2 "," $3 "," $4 "," $5] = bars()
}
# One thing changes at a time, around 4 layers.
function show(name, place) { sub(/^\|  \|/, "| " name " |", cells[place]); print cells[place] }
END {
  for (c = 8; table == "ranges" && c <= 14; ++c) {
    cell[1] = "`" scheme[c] "`"
    for (k = 0; k < 2; ++k) cell[2 + k] = sprintf("%.2f to %.1f", least[c, k], most[c, k])
    print bars()
  }
  if (table == "ranges" || table == "parts") exit
  show("1 layer", "1,yes,0,32"); show("4 layers", "4,yes,0,32"); show("16 layers", "16,yes,0,32")
  if (table == "traffic") show("blur 8", "4,yes,8,32")
  show("blur 32", "4,yes,32,32")
  if (table == "evaluations") exit
  show("plain", "4,no,0,32"); show("tiles 16", "4,yes,0,16"); show("tiles 64", "4,yes,0,64")
}
