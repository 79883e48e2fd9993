# The columns of tradeoff.csv that docs/accuracy.md is about, as CSV: awk -f csv.awk -f tidy.awk tradeoff.csv
function quoted(text) { if (text ~ /[,"]/) { gsub(/"/, "\"\"", text); return "\"" text "\"" } return text }
BEGIN { print "knob,setting,default,psnr_db,ssim,flip,max_error,cycles,dram_bytes,energy_uj,cpu_seconds,front" }
NR > 1 {
  split_csv($0, cell)
  if (cell[column["knob"]] == "joint") next
  machine = cell[column["cycles"]] != ""
  printf "%s,%s,%s,%.2f,%.4f,%.4f,%.3f,%s,%s,%s,%.3f,%s\n", cell[column["knob"]], quoted(cell[column["setting"]]), cell[column["base"]] == "true" ? "true" : "false", cell[column["psnr_db"]], cell[column["ssim"]],
    cell[column["flip"]], cell[column["max_error"]], cell[column["cycles"]], machine ? cell[column["dram_bytes"]] : "", machine ? sprintf("%.1f", cell[column["energy_nj"]] / 1000) : "",
    cell[column["processor_seconds_median"]], cell[column["front_cycles"]] == "true" ? "true" : "false"
}
