"""Tables and plots of docs/accuracy_and_stability.md from the results of `tessera tradeoff`: tables.py RESULTS OUT COMMIT.

OUT's CSV files get the rows of the captures whose results are in RESULTS; those of the others stay. Tables and plots follow from the CSV files."""

import csv
import json
import math
import pathlib
import re
import sys

CAPTURES = ["eggs", "vases", "stroll", "flyby", "serpent", "city", "garden", "workshop"]
OUTLINE = ' stroke="#000"'
COLORS = ["#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#000000", "#8c6d1f"]


def quoted(value):
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"') else text


def rounded(value, digits):
    return "" if value is None else f"{value:.{digits}g}"


def rows_of(name, result):
    """One row for each setting of a knob that does something."""
    for knob in result["knobs"]:
        if knob["idle"]:
            continue
        for setting in knob["settings"]:
            error = setting["error"] or {}
            energy = setting["energy_nj"]
            share = setting.get("cycles_error")
            yield [name, knob["name"], setting["label"], str(setting["base"]).lower(), rounded(error.get("psnr_db"), 4), rounded(error.get("ssim"), 5),
                   rounded(error.get("flip"), 4), rounded(setting["ms"], 4), rounded(None if energy is None else energy * 1e-6, 4), setting["dram_bytes"] or "",
                   rounded(setting["host"]["processor_seconds"]["median"], 3), str(setting["front"].get("ms", "")).lower(), rounded(None if share is None else 100 * share, 3)]


def is_true(text):
    return text == "true"


def samples_of(rows):
    """(ms, dB, whether it is the default) of each number of samples."""
    return [(float(row["ms"]), float(row["psnr_db"]), is_true(row["default"])) for row in rows if row["knob"] == "samples"]


def clock_rows(name, result):
    """One row for each model of timing: how far off the finest it is, and the host's time for the timing alone."""
    settings = next(k for k in result["knobs"] if k["name"] == "timing")["settings"]
    finest = settings[0]["host"]["processor_seconds"]["median"]
    for s in settings:
        seconds = s["host"]["processor_seconds"]["median"]
        yield [name, s["label"], s["cycles"], f'{100 * s["cycles_error"]:.2f}', f'{s["energy_nj"] * 1e-6:.4g}', f'{100 * s["energy_error"]:.2f}',
               rounded(seconds, 3), rounded(seconds / finest, 3)]


def clock_markdown(rows):
    """The table of docs/accuracy_and_stability.md, from the rows of clock.csv."""
    models = list(dict.fromkeys(row["model"] for row in rows))[1:]
    lines = ["| capture | " + " | ".join(models) + " |", "|---|" + "---:|" * len(models)]
    for name, own in by_capture(rows).items():
        of = {row["model"]: row for row in own}
        cells = [f'{float(of[m]["cycles_error_percent"]):+.1f} %, {float(of[m]["energy_error_percent"]):+.1f} %, {float(of[m]["share_of_finest"]):.2f}' for m in models]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def joint_front(result):
    """The combinations that none beats in PSNR and ms, by ms; and the default's."""
    settings = next(k for k in result["knobs"] if k["name"] == "joint")["settings"]
    front, best = [], -math.inf
    for s in sorted(settings, key=lambda s: (s["ms"], -s["error"]["psnr_db"], not s["base"])):
        if s["error"]["psnr_db"] > best:
            front.append(s)
            best = s["error"]["psnr_db"]
    return front, next(s for s in settings if s["base"])


def joint_label(setting):
    samples, *rest = setting["label"].split(" | ")
    named = {"off": None, "adaptive": "adaptive desampling", "fixed_8": "8 of 16 pixels", "fixed_4": "4 of 16 pixels"}
    rest = ["edge " + part if re.fullmatch(r"[0-9.]+ px", part) else re.sub(r"cache, cells of (.*) px", r"cache of \1 px cells", part) for part in rest]
    rest = [named.get(part, part) for part in rest]
    return ", ".join([f"{samples} sample" + ("" if samples == "1" else "s"), *filter(None, rest)])


def joint_rows(name, result):
    front, base = joint_front(result)
    for s in front + ([] if base in front else [base]):
        yield [name, joint_label(s), str(s["base"]).lower(), rounded(s["error"]["psnr_db"], 4), rounded(s["error"]["flip"], 4), rounded(s["ms"], 4),
               rounded(s["energy_nj"] * 1e-6, 4), s["dram_bytes"], s["arguments"].replace("--set ", "")]


def joint_choices(rows):
    """Of a capture's rows of joint.csv: the default, the cheapest that is as good, and the best that is no more expensive."""
    ms, db = lambda row: float(row["ms"]), lambda row: float(row["psnr_db"])
    base = next(row for row in rows if is_true(row["default"]))
    good = min((row for row in rows if db(row) >= db(base)), key=lambda row: (ms(row), not is_true(row["default"])))
    best = max((row for row in rows if ms(row) <= ms(base)), key=lambda row: (db(row), is_true(row["default"])))
    return base, good, best


def joint_markdown(rows):
    """The table of docs/accuracy_and_stability.md."""
    lines = ["| capture | default | as good, cheapest | best for the default's ms |", "|---|---:|---|---|"]
    for name, own in by_capture(rows).items():
        base, good, best = joint_choices(own)
        figures = lambda row: f'{float(row["ms"]):.2f} ms, {float(row["psnr_db"]):.1f} dB'
        cell = lambda row: "the default" if row is base else f'{figures(row)}: {row["setting"]}'
        lines.append(f"| {name} | {figures(base)} | {cell(good)} | {cell(best)} |")
    return "\n".join(lines)


def put_into(page, name, table):
    """Replaces what stands between the page's marks of that name."""
    before, _, rest = page.read_text().partition(f"<!-- {name} -->\n")
    if rest:
        page.write_text(f"{before}<!-- {name} -->\n{table}\n<!-- end {name} -->{rest.partition(f'<!-- end {name} -->')[2]}")


def joint_plot(rows):
    """The joint front of each capture; the legend says which combination is as good as the default, and what it costs."""
    lines, notes = {}, {}
    for name, own in by_capture(rows).items():
        base, good, _ = joint_choices(own)
        point = lambda row, is_base: (float(row["ms"]), float(row["psnr_db"]), is_base)
        front, highest = [], -math.inf
        for row in sorted(own, key=lambda row: float(row["ms"])):
            if float(row["psnr_db"]) > highest:
                front.append(point(row, False))
                highest = float(row["psnr_db"])
        lines[name] = front + [point(base, True)]
        notes[name] = f'{float(base["ms"]):.2f} ms: the default' if good is base else f'{float(good["ms"]):.2f} instead of {float(base["ms"]):.2f} ms: {good["setting"].replace(", interpolated", "")}'
    return plot(lines, "All knobs together: the best of each capture, and its default", notes)


def plot(lines, title, notes=None):
    xs = [x for line in lines.values() for x, _, _ in line]
    ys = [y for line in lines.values() for _, y, _ in line]
    low_x, high_x, low_y, high_y = math.log(min(xs) * 0.9), math.log(max(xs) * 1.1), math.floor(min(ys) - 1), math.ceil(max(ys) + 1)
    px = lambda x: 60 + 520 * (math.log(x) - low_x) / (high_x - low_x)
    py = lambda y: 350 - 300 * (y - low_y) / (high_y - low_y)
    width = 1130 if notes else 780
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} 400" font-family="sans-serif" font-size="12"><rect width="{width}" height="400" fill="#fff"/>',
           f'<text x="60" y="26" font-size="14">{title}</text>']
    for value in (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50):
        if low_x < math.log(value) < high_x:
            out.append(f'<path d="M{px(value):.1f} 50V350" stroke="#ddd"/><text x="{px(value):.1f}" y="367" text-anchor="middle">{value:g}</text>')
    for value in range(int(low_y) // 5 * 5, int(high_y) + 1, 5):
        if low_y <= value <= high_y:
            out.append(f'<path d="M60 {py(value):.1f}H580" stroke="#ddd"/><text x="54" y="{py(value) + 4:.1f}" text-anchor="end">{value}</text>')
    out.append('<text x="320" y="390" text-anchor="middle">emulated ms of the frame (logarithmic)</text>'
               '<text x="16" y="200" transform="rotate(-90 16 200)" text-anchor="middle">PSNR, dB</text>')
    for number, (name, line) in enumerate(lines.items()):
        color = COLORS[number]
        joined = [(x, y) for x, y, base in line if not (notes and base)]
        out.append(f'<path d="M{"L".join(f"{px(x):.1f} {py(y):.1f}" for x, y in joined)}" fill="none" stroke="{color}" stroke-width="2"/>')
        for x, y, base in line:
            out.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="{6 if base else 2 if notes else 3}" fill="{color}"{OUTLINE if base else ""}/>')
        y = 60 + (34 if notes else 20) * number
        out.append(f'<circle cx="600" cy="{y}" r="4" fill="{color}"/><text x="610" y="{y + 4}">{name}</text>')
        if notes:
            out.append(f'<text x="610" y="{y + 18}" font-size="11" fill="#444">{notes[name]}</text>')
    y = 346 if notes else 240
    out.append(f'<circle cx="600" cy="{y}" r="6" fill="#fff" stroke="#000"/><text x="610" y="{y + 4}">the default, 4 samples</text>')
    out.append(f'<text x="594" y="{y + 20}">{"Grey: the cheapest that is as good as the default." if notes else "1 to 64 samples a pixel"}</text></svg>')
    return "\n".join(out) + "\n"


def reference_rows(name, result):
    r, slope = result["reference"], result["reference"]["convergence"]["slope"]
    yield [name, result["frame"], f'{result["size"][0]}x{result["size"][1]}', r["samples"], r["asked_samples"], r["triangles"], f'{r["psnr_db"]:.1f}', "" if slope is None else f"{slope:.3f}",
           f'{r["host"]["seconds"]:.1f}']


def answer_rows(name, result, answers):
    base = next(s for k in result["knobs"] if not k["timed"] for s in k["settings"] if s["base"])
    for decibels, answer in answers.items():
        s = answer["cheapest"]["setting"] or answer["cheapest"]["missed"]
        yield [name, decibels, str(answer["cheapest"]["setting"] is not None).lower(), s["arguments"].replace("--set ", ""), rounded(s["error"]["psnr_db"], 4), rounded(s["error"]["flip"], 4),
               rounded(s["ms"], 4), rounded(s["energy_nj"] * 1e-6, 4), rounded(base["error"]["psnr_db"], 4), rounded(base["ms"], 4)]


def by_capture(rows):
    return {name: own for name in CAPTURES if (own := [row for row in rows if row["capture"] == name])}


def merge(file, head, rows, commit):
    """Puts the captures' rows, which get the commit, in place of theirs in the file. Its rows, as dictionaries."""
    columns = head.split(",") + ["commit"]
    new = by_capture([dict(zip(columns, [*(str(cell) for cell in row), commit])) for row in rows])
    old = by_capture(list(csv.DictReader(file.read_text().splitlines()))) if file.exists() else {}
    merged = [row for name in CAPTURES for row in new.get(name, old.get(name, []))]
    file.write_text("\n".join([",".join(columns)] + [",".join(quoted(row.get(column, "")) for column in columns) for row in merged]) + "\n")
    return merged


def main():
    folder, out, commit = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    results, joints, answers = {}, {}, {}
    for name in CAPTURES:
        read = lambda suffix: json.loads((folder / f"{name}{suffix}.json").read_text())
        has = lambda suffix: (folder / f"{name}{suffix}.json").exists()
        if has(""):
            results[name] = read("")
        if has("-joint"):
            joints[name] = read("-joint")
        if has("") and all(has(f"-{decibels}") for decibels in (30, 35, 40)):
            answers[name] = {decibels: read(f"-{decibels}") for decibels in (30, 35, 40)}
    rows = lambda make, found: [row for name, result in found.items() for row in make(name, result)]
    every = merge(out / "all.csv", "capture,knob,setting,default,psnr_db,ssim,flip,ms,mj,dram_bytes,cpu_seconds,front,cycles_error_percent", rows(rows_of, results), commit)
    clock = merge(out / "clock.csv", "capture,model,cycles,cycles_error_percent,mj,energy_error_percent,cpu_seconds,share_of_finest", rows(clock_rows, results), commit)
    joint = merge(out / "joint.csv", "capture,setting,default,psnr_db,flip,ms,mj,dram_bytes,arguments", rows(joint_rows, joints), commit)
    merge(out / "references.csv", "capture,frame,size,samples,asked_samples,triangles,noise_db,slope,seconds", rows(reference_rows, results), commit)
    merge(out / "answers.csv", "capture,min_psnr_db,found,setting,psnr_db,flip,ms,mj,default_psnr_db,default_ms",
          [row for name in answers for row in answer_rows(name, results[name], answers[name])], commit)
    (out / "samples.svg").write_text(plot({name: samples_of(own) for name, own in by_capture(every).items()}, "What samples buy, and what they cost"))
    (out / "joint.svg").write_text(joint_plot(joint))
    page = out.parent.parent / "accuracy_and_stability.md"  # where OUT is docs/images/accuracy
    if page.exists():
        put_into(page, "clock", clock_markdown(clock))
        put_into(page, "joint", joint_markdown(joint))


if __name__ == "__main__":
    main()
