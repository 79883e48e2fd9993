# Markdown tables of tradeoff.csv, one per knob: awk -f csv.awk -f table.awk tradeoff.csv
NR > 1 {
  split_csv($0, cell)
  if (cell[column["knob"]] == "joint") next
  if (cell[column["knob"]] != knob) {
    knob = cell[column["knob"]]
    printf "\n| `%s` | PSNR, dB | SSIM | FLIP | largest | cycles | DRAM bytes | energy, uJ | CPU, s | front |\n|---|---:|---:|---:|---:|---:|---:|---:|---:|:---:|\n", knob
  }
  machine = cell[column["cycles"]] != ""
  printf "| %s%s | %.2f | %.4f | %.4f | %.3f | %s | %s | %s | %.3f | %s |\n", cell[column["setting"]], cell[column["base"]] == "true" ? " (default)" : "", cell[column["psnr_db"]], cell[column["ssim"]], cell[column["flip"]],
    cell[column["max_error"]], machine ? cell[column["cycles"]] : "-", machine ? cell[column["dram_bytes"]] : "-", machine ? sprintf("%.1f", cell[column["energy_nj"]] / 1000) : "-", cell[column["processor_seconds_median"]],
    cell[column["front_cycles"]] == "true" ? "*" : ""
}
