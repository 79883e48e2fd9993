#!/usr/bin/env python3
"""The plot of docs/validation.md from what `tessera selfcheck --json` prints: plot.py SELFCHECK.json OUT writes judges.csv and judges.svg into OUT."""
import json
import math
import pathlib
import re
import sys

# A word of the check's name; its label; the published value; the range that counts as agreement.
JUDGES = [("lpddr4x-4266", "JEDEC, LPDDR4X-4266, GB/s", 34.1, 0.9, 1), ("lpddr5-6400", "JEDEC, LPDDR5-6400, GB/s", 51.2, 0.9, 1),
          ("lpddr5x-8533", "JEDEC, LPDDR5X-8533, GB/s", 68.3, 0.9, 1), ("immediate", "Antochi 2004, immediate over tiled traffic", 1.96, 0.7, 1.3),
          ("deferred-vertex", "Arm, saving of deferred-vertex, %", 33.5, 13 / 33.5, 82 / 33.5),
          ("texture blocks", "DTM-NUCA, blocks that several cores ask for, %", 84.6, 64.6 / 84.6, 104.6 / 84.6)]
LEFT, RIGHT, TOP, ROW = 330, 660, 40, 36
TICKS = (0.25, 0.5, 1, 2, 4)


def rows_of(checks):
    """For each judge, each capture or the single result: label, capture, value, published value, ends of the range."""
    for word, label, published, low, high in JUDGES:
        got = next(check["got"] for check in checks if word in check["name"])
        values = re.findall(r"([a-z]+) ([0-9.]+)", got.partition("(")[2]) or [("", re.match(r"[0-9.]+", got)[0])]
        for capture, value in values:
            yield [label, capture, value, published, f"{low:.3f}", f"{high:.3f}"]


def plot(rows):
    def x(ratio):
        return LEFT + (RIGHT - LEFT) * (math.log2(ratio) + 2.2) / 4.4

    labels = list(dict.fromkeys(row[0] for row in rows))
    bottom = TOP + ROW * len(labels)
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {RIGHT + 30} {bottom + 50}" font-family="sans-serif" font-size="12">'
             f'<rect width="{RIGHT + 30}" height="{bottom + 50}" fill="#fff"/>', f'<text x="{LEFT}" y="22" font-size="14">Measured over published</text>']
    lines += [f'<path d="M{x(tick):.1f} {TOP}V{bottom}" stroke="{"#888" if tick == 1 else "#ddd"}"/>'
              f'<text x="{x(tick):.1f}" y="{bottom + 17}" text-anchor="middle">{tick}</text>' for tick in TICKS]
    for k, label in enumerate(labels):
        own, y = [row for row in rows if row[0] == label], TOP + ROW * (k + 0.5)
        lines.append(f'<text x="{LEFT - 10}" y="{y + 4:.1f}" text-anchor="end">{label}</text>')
        lines.append(f'<rect x="{x(float(own[0][4])):.1f}" y="{y - 9:.1f}" width="{x(float(own[0][5])) - x(float(own[0][4])):.1f}" height="18" fill="#cfe3cf"/>')
        lines += [f'<circle cx="{x(float(row[2]) / row[3]):.1f}" cy="{y:.1f}" r="4" fill="#1f4e8c" fill-opacity="0.8"><title>{row[1] or label}: {row[2]}</title></circle>' for row in own]
    lines.append(f'<text x="{RIGHT}" y="{bottom + 40}" text-anchor="end">green: the range that counts as agreement (Antochi, DTM-NUCA: of the mean); a dot: a capture or a memory</text></svg>')
    return "\n".join(lines) + "\n"


def main():
    checks, out = json.loads(pathlib.Path(sys.argv[1]).read_text()), pathlib.Path(sys.argv[2])
    rows = list(rows_of(checks))
    (out / "judges.csv").write_text("judge,capture,measured,published,agrees_from,agrees_to\n" + "".join(",".join(f'"{c}"' if "," in str(c) else str(c) for c in row) + "\n" for row in rows))
    (out / "judges.svg").write_text(plot(rows))


if __name__ == "__main__":
    main()
