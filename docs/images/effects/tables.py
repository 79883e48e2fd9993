"""costs.csv from folders of `tessera tradeoff --effects`, one for each capture, and its table in docs/shading.md: tables.py FOLDERS OUT COMMIT."""

import csv
import pathlib
import sys

CAPTURES = ["eggs", "vases", "stroll", "flyby", "serpent", "city", "garden", "workshop"]


def costs_markdown(text):
    """A row for each effect that ran in a capture: its share of ms and mJ, and decibels of the image without it."""
    rows = list(csv.DictReader(text.splitlines()))
    lines = ["| effect | capture | ms | mJ | DRAM bytes | host s | image without it |", "|---|---|---:|---:|---:|---:|---:|"]
    share = lambda row, name: f'{float(row[name]):.3g} ({100 * float(row[name]) / float(row["frame_" + name]):+.1f} %)'
    for effect in dict.fromkeys(row["effect"] for row in rows):
        for row in rows:
            if row["effect"] == effect and row["ran"] == "true":
                cells = [share(row, "ms"), share(row, "mj"), f'{int(row["dram_bytes"])} ({100 * int(row["dram_bytes"]) / int(row["frame_dram_bytes"]):+.1f} %)',
                         share(row, "processor_seconds"), f'{float(row["psnr_db"]):.1f} dB' if row["psnr_db"] else "the same"]
                lines.append(f'| `{effect}` | {row["capture"]} | ' + " | ".join(cells) + " |")
    return "\n".join(lines)


def absent_work(text):
    """(how many effects of all captures did not run, the sum of the counters of their work)."""
    absent = [row for row in csv.DictReader(text.splitlines()) if row["ran"] == "false"]
    return len(absent), sum(int(row["work"]) for row in absent)


def main():
    folders, out, commit = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    lines = []
    for name in CAPTURES:
        head, *rows = (folders / name / "effects.csv").read_text().splitlines()
        lines += ([head + ",commit"] if not lines else []) + [f"{row},{commit}" for row in rows]
    text = "\n".join(lines) + "\n"
    (out / "costs.csv").write_text(text)
    page = out.parent.parent / "shading.md"  # where OUT is docs/images/effects
    if page.exists():
        before, _, rest = page.read_text().partition("<!-- costs -->\n")
        if rest:
            page.write_text(f"{before}<!-- costs -->\n{costs_markdown(text)}\n<!-- end costs -->{rest.partition('<!-- end costs -->')[2]}")


if __name__ == "__main__":
    main()
