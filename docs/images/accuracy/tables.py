"""Tables and plots of docs/accuracy.md from folders of `tessera tradeoff`, one for each capture: tables.py FOLDERS OUT COMMIT."""

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
    """One row for each setting."""
    for knob in result["knobs"]:
        for setting in knob["settings"]:
            error = setting["error"] or {}
            energy = setting["energy_nj"]
            share = setting.get("cycles_error")
            yield [name, knob["name"], setting["label"], str(setting["base"]).lower(), rounded(error.get("psnr_db"), 4), rounded(error.get("ssim"), 5),
                   rounded(error.get("flip"), 4), rounded(setting["ms"], 4), rounded(None if energy is None else energy * 1e-6, 4), setting["dram_bytes"] or "",
                   rounded(setting["host"]["processor_seconds"]["median"], 3), str(setting["front"].get("ms", "")).lower(), rounded(None if share is None else 100 * share, 3)]


def samples_of(result):
    """(ms, dB, whether it is the default) of each number of samples."""
    knob = next(k for k in result["knobs"] if k["name"] == "samples")
    return [(s["ms"], s["error"]["psnr_db"], s["base"]) for s in knob["settings"]]


def clock_rows(name, result):
    """One row for each model of timing: how far off the finest it is, and the host's time for the timing alone."""
    settings = next(k for k in result["knobs"] if k["name"] == "timing")["settings"]
    finest = settings[0]["host"]["processor_seconds"]["median"]
    for s in settings:
        seconds = s["host"]["processor_seconds"]["median"]
        yield [name, s["label"], s["cycles"], f'{100 * s["cycles_error"]:.2f}', f'{s["energy_nj"] * 1e-6:.4g}', f'{100 * s["energy_error"]:.2f}',
               rounded(seconds, 3), rounded(seconds / finest, 3)]


def clock_markdown(text):
    """The table of docs/accuracy.md, from the text of clock.csv."""
    rows = list(csv.DictReader(text.splitlines()))
    models = list(dict.fromkeys(row["model"] for row in rows))[1:]
    lines = ["| capture | " + " | ".join(models) + " |", "|---|" + "---:|" * len(models)]
    for name in CAPTURES:
        of = {row["model"]: row for row in rows if row["capture"] == name}
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
    rest = ["edge " + part if re.fullmatch(r"[0-9.]+ px", part) else re.sub(r"cache, cells of (.*) px", r"cache of \1 px cells", part) for part in rest]
    return ", ".join([f"{samples} sample" + ("" if samples == "1" else "s"), *rest])


def joint_markdown(results):
    """The table of docs/accuracy.md: the default, the cheapest as good, and the best that is no more expensive."""
    lines = ["| capture | default | as good, cheapest | best for the default's ms |", "|---|---:|---|---|"]
    for name, result in results.items():
        front, base = joint_front(result)
        good = next(s for s in front if s["error"]["psnr_db"] >= base["error"]["psnr_db"] - 1e-9)
        best = [s for s in front if s["ms"] <= base["ms"]][-1]
        cell = lambda s: "the default" if s["base"] else f'{s["ms"]:.2f} ms, {s["error"]["psnr_db"]:.1f} dB: {joint_label(s)}'
        lines.append(f'| {name} | {base["ms"]:.2f} ms, {base["error"]["psnr_db"]:.1f} dB | {cell(good)} | {cell(best)} |')
    return "\n".join(lines)


def put_into(page, name, table):
    """Replaces what stands between the page's marks of that name."""
    before, _, rest = page.read_text().partition(f"<!-- {name} -->\n")
    if rest:
        page.write_text(f"{before}<!-- {name} -->\n{table}\n<!-- end {name} -->{rest.partition(f'<!-- end {name} -->')[2]}")


def joint_plot(results):
    """The joint front of each capture; the legend says which combination is as good as the default, and what it costs."""
    lines, notes = {}, {}
    for name, result in results.items():
        front, base = joint_front(result)
        lines[name] = [(s["ms"], s["error"]["psnr_db"], False) for s in front] + [(base["ms"], base["error"]["psnr_db"], True)]
        cheap = next(s for s in front if s["error"]["psnr_db"] >= base["error"]["psnr_db"] - 1e-9)
        notes[name] = f'{base["ms"]:.2f} ms: the default' if cheap["base"] else f'{cheap["ms"]:.2f} instead of {base["ms"]:.2f} ms: {joint_label(cheap).removesuffix(", interpolated")}'
    return plot(lines, "All knobs together: the best of each capture, and its default", notes)


def plot(lines, title, notes=None):
    xs = [x for line in lines.values() for x, _, _ in line]
    ys = [y for line in lines.values() for _, y, _ in line]
    low_x, high_x, low_y, high_y = math.log(min(xs) * 0.9), math.log(max(xs) * 1.1), math.floor(min(ys) - 1), math.ceil(max(ys) + 1)
    px = lambda x: 60 + 520 * (math.log(x) - low_x) / (high_x - low_x)
    py = lambda y: 350 - 300 * (y - low_y) / (high_y - low_y)
    width = 1040 if notes else 780
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


def main():
    folders, out, commit = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    results = {name: json.loads((folders / f"{name}.json").read_text()) for name in CAPTURES}
    head = "capture,knob,setting,default,psnr_db,ssim,flip,ms,mj,dram_bytes,cpu_seconds,front,cycles_error_percent,commit\n"
    rows = [",".join(quoted(cell) for cell in row + [commit]) for name, result in results.items() for row in rows_of(name, result)]
    (out / "all.csv").write_text(head + "\n".join(rows) + "\n")
    clock = "capture,model,cycles,cycles_error_percent,mj,energy_error_percent,cpu_seconds,share_of_finest,commit\n" + "".join(
        ",".join(quoted(cell) for cell in row + [commit]) + "\n" for name, result in results.items() for row in clock_rows(name, result))
    (out / "clock.csv").write_text(clock)
    joint = {name: json.loads((folders / f"{name}-joint.json").read_text()) for name in CAPTURES}
    rows = [",".join(quoted(cell) for cell in [name, joint_label(s), str(s["base"]).lower(), rounded(s["error"]["psnr_db"], 4), rounded(s["error"]["flip"], 4), rounded(s["ms"], 4),
                                               rounded(s["energy_nj"] * 1e-6, 4), s["dram_bytes"], s["arguments"].replace("--set ", ""), commit])
            for name, result in joint.items() for front, base in [joint_front(result)] for s in front + ([] if base in front else [base])]
    (out / "joint.csv").write_text("capture,setting,default,psnr_db,flip,ms,mj,dram_bytes,arguments,commit\n" + "\n".join(rows) + "\n")
    (out / "joint.svg").write_text(joint_plot(joint))
    page = out.parent.parent / "accuracy.md"  # where OUT is docs/images/accuracy
    if page.exists():
        put_into(page, "clock", clock_markdown(clock))
        put_into(page, "joint", joint_markdown(joint))
    lines = ["capture,frame,size,samples,asked_samples,triangles,noise_db,slope,seconds,commit"]
    for name, result in results.items():
        r = result["reference"]
        slope = r["convergence"]["slope"]
        lines.append(f'{name},{result["frame"]},{result["size"][0]}x{result["size"][1]},{r["samples"]},{r["asked_samples"]},{r["triangles"]},'
                     f'{r["psnr_db"]:.1f},{"" if slope is None else f"{slope:.3f}"},{r["host"]["seconds"]:.1f},{commit}')
    (out / "references.csv").write_text("\n".join(lines) + "\n")
    answers = ["capture,min_psnr_db,found,setting,psnr_db,flip,ms,mj,default_psnr_db,default_ms,commit"]
    for name, result in results.items():
        base = next(s for k in result["knobs"] if not k["timed"] for s in k["settings"] if s["base"])
        for decibels in (30, 35, 40):
            cheapest = json.loads((folders / f"{name}-{decibels}.json").read_text())["cheapest"]
            s = cheapest["setting"] or cheapest["missed"]
            answers.append(",".join(quoted(cell) for cell in [name, decibels, str(cheapest["setting"] is not None).lower(), s["arguments"].replace("--set ", ""), rounded(s["error"]["psnr_db"], 4),
                                    rounded(s["error"]["flip"], 4), rounded(s["ms"], 4), rounded(s["energy_nj"] * 1e-6, 4), rounded(base["error"]["psnr_db"], 4), rounded(base["ms"], 4), commit]))
    (out / "answers.csv").write_text("\n".join(answers) + "\n")
    (out / "samples.svg").write_text(plot({name: samples_of(result) for name, result in results.items()}, "What samples buy, and what they cost"))


if __name__ == "__main__":
    main()
