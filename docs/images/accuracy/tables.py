"""Tables and the plot of docs/accuracy.md from folders of `tessera tradeoff`, one for each capture: tables.py FOLDERS OUT COMMIT."""

import json
import math
import pathlib
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


def plot(lines, title):
    xs = [x for line in lines.values() for x, _, _ in line]
    ys = [y for line in lines.values() for _, y, _ in line]
    low_x, high_x, low_y, high_y = math.log(min(xs) * 0.9), math.log(max(xs) * 1.1), math.floor(min(ys) - 1), math.ceil(max(ys) + 1)
    px = lambda x: 60 + 520 * (math.log(x) - low_x) / (high_x - low_x)
    py = lambda y: 350 - 300 * (y - low_y) / (high_y - low_y)
    out = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 780 400" font-family="sans-serif" font-size="12"><rect width="780" height="400" fill="#fff"/>',
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
        out.append(f'<path d="M{"L".join(f"{px(x):.1f} {py(y):.1f}" for x, y, _ in line)}" fill="none" stroke="{color}" stroke-width="2"/>')
        for x, y, base in line:
            out.append(f'<circle cx="{px(x):.1f}" cy="{py(y):.1f}" r="{6 if base else 3}" fill="{color}"{OUTLINE if base else ""}/>')
        out.append(f'<circle cx="600" cy="{60 + 20 * number}" r="4" fill="{color}"/><text x="610" y="{64 + 20 * number}">{name}</text>')
    out.append('<circle cx="600" cy="240" r="6" fill="#fff" stroke="#000"/><text x="610" y="244">the default, 4 samples</text><text x="594" y="264">1 to 64 samples a pixel</text></svg>')
    return "\n".join(out) + "\n"


def main():
    folders, out, commit = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    results = {name: json.loads((folders / f"{name}.json").read_text()) for name in CAPTURES}
    head = "capture,knob,setting,default,psnr_db,ssim,flip,ms,mj,dram_bytes,cpu_seconds,front,cycles_error_percent,commit\n"
    rows = [",".join(quoted(cell) for cell in row + [commit]) for name, result in results.items() for row in rows_of(name, result)]
    (out / "all.csv").write_text(head + "\n".join(rows) + "\n")
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
