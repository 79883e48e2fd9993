# Cells of a line of tradeoff.csv, in cell[1] and up; names of columns in column[NAME] after the first line.
function split_csv(line, cell,   n, c, k, quoted, text) {
  n = 1; text = ""; quoted = 0
  for (k = 1; k <= length(line); ++k) {
    c = substr(line, k, 1)
    if (c == "\"") { if (quoted && substr(line, k + 1, 1) == "\"") { text = text c; ++k } else quoted = !quoted }
    else if (c == "," && !quoted) { cell[n++] = text; text = "" }
    else text = text c
  }
  cell[n] = text
  return n
}
NR == 1 { count = split_csv($0, cell); for (k = 1; k <= count; ++k) column[cell[k]] = k; next }
