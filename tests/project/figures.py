#!/usr/bin/env python3
"""tests/project/figures.py --program TESSERA [--build FOLDER] [TEST...]   checks published figures.

Pages     in every push: commands of the README work, tables of pages follow from the CSV files beside them, shipped captures
          equal the output of their sources (--build: the folder of tessera_make_captures)
Replays   figures of pages, rendered again; part of ./tessera test --all
Arguments after the options are arguments of Python's unittest: Pages, Replays.test_tour, -k shading, -v.
"""
import csv
import json
import math
import os
import re
import runpy
import subprocess
import sys
import tempfile
import unittest
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
IMAGES = ROOT / "docs/images"
PAYS = IMAGES / "when_it_pays"
program, build = None, None  # set by main()


def page(name):
    return (ROOT / name).read_text()


def rows_of(file):
    with open(file, newline="") as lines:
        return list(csv.DictReader(lines))


def capture(name):
    return str(ROOT / f"captures/{name}.glb")


def run(*arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise AssertionError(f"tessera {' '.join(map(str, arguments))} ends with {done.returncode}\n{done.stderr}")
    return done.stdout


def statistics(*arguments):
    """Statistics of the frames of `tessera replay ARGUMENTS`."""
    with tempfile.TemporaryDirectory() as out:
        run("replay", *arguments, "--quiet", "--no-report", "--out", out)
        return json.loads(Path(out, "stats.json").read_text())


def settings(**values):
    """--set arguments; a key's dot is written as two underscores."""
    return [word for key, value in values.items() for word in ("--set", f"{key.replace('__', '.')}={value}")]


def commands(name, out):
    """Arguments of the program in the shell blocks of a page, with captures where they lie and results below `out`."""
    for block in re.findall(r"^```sh\n(.*?)^```", page(name), re.M | re.S):
        for line in block.splitlines():
            words = line.split(" #")[0].split()
            if words[:1] == ["./tessera"] and words[1:2] != ["test"]:
                yield [f"{ROOT}/{word}" if word.startswith("captures/") else f"{out}/{word}" if (word + "/").startswith("out/") else word
                       for word in words[1:]]


# ---- docs/when_it_pays.md -------------------------------------------------------------------------------------------

# The machines that the study measured.
SCHEMES = ["patch-whole", "post-tessellation", "post-position", "deferred-vertex", "visibility-stream", "control-list", "immediate", "tessellated-in-memory", "untiled", "mesh-shader-ring",
           "mesh-shader-compact", "mesh-shader-references"]
DOUBTS = ["as it is", "constant costs", "set-up x4", "against ours", "for ours"]


def place_of(row):
    return ",".join(row[column] for column in ("layers", "attributes", "blur", "tile"))


def costs_of(points, cost, scheme):
    """Triples of a triangle's size in px², this machine's cost and the other machine's cost."""
    found = []
    for point in points:
        both = float(point["finished"]) if cost == "traffic" else 0  # of this machine and of the others alike
        found.append((float(point["px2"]), float(point[f"{cost} tessera"]) - both, float(point[f"{cost} {scheme}"]) - both))
    return found


def sizes_where_less(costs):
    """Triangle sizes at which the first of two costs is the smaller one, as break_even.csv writes them. The logarithm of the costs'
    ratio is linear in the logarithm of the size."""
    def text_of(x):
        return f"{x:.1f}" if x < 10 else f"{x:.0f}"

    advantages = [math.log(first / second) for _, first, second in costs]
    parts, begin, inside = [], None, advantages[0] < 0
    for (x0, *_), (x1, *_), a, b in zip(costs, costs[1:], advantages, advantages[1:]):
        if (b < 0) != inside:
            line = text_of(x0 * (x1 / x0) ** (a / (a - b)))
            if inside:
                parts.append(f"{begin}-{line}" if begin else f"<{line}")
            begin, inside = line, not inside
    if inside:
        parts.append(f">{begin}" if begin else "all")
    return "+".join(parts) or "none"


def names_no_model(text):
    """Whether a text shows emulated times or energies and names neither the commit nor the model that they are of."""
    shows = re.search(r"[0-9][0-9.,]*( %)? ?(times the|fewer|more|k|M)? ?(cycles|mJ|µJ|nJ)\b", text)
    return bool(shows) and not re.search(r"commit [0-9a-f]{7,}[^.]*machine\.timing|machine\.timing[^.]*commit [0-9a-f]{7,}", text)


def line_of_ranges(points, scheme):
    cells = []
    for cost in ("traffic", "evaluations", "cycles", "energy"):
        ratios = [theirs / ours for _, ours, theirs in costs_of(points, cost, scheme)]
        cells.append(f"{min(ratios):.2f} to {max(ratios):.{2 if max(ratios) < 10 else 1}f}")
    return f"| `{scheme}` | {' | '.join(cells)} |"


@lru_cache(None)
def wall_replay(layers, attributes, blur, tile, px2):
    """Counters of all schemes in the place of a row."""
    frame = {"0": "0:1", "8": "1:2"}.get(blur, "2:3")
    edge = {"0.5": 1, "1.0": 1.414, "4.0": 2.828, "16.0": 5.657, "64.0": 11.314}[px2]
    name = f"studies/wall_{layers}{'' if attributes == 'yes' else '_plain'}"
    keys = settings(parameter_buffer__bytes=268435456, tessellation__target_edge_pixels=edge, tile__width=tile, tile__height=tile)
    frames = statistics(capture(name), "--size", "640x360", "--frames", frame, "--baselines", *keys)["frames"]
    return {scheme: {key.removeprefix("baseline."): value for key, value in counters.items()} for scheme, counters in frames[0]["baselines"].items()}


def replay_of(row):
    return wall_replay(*(row[column] for column in ("layers", "attributes", "blur", "tile", "px2")))


def contradictions(row, schemes):
    """Columns of a row of points.csv that a replay contradicts."""
    measured = {"triangles": schemes["post-tessellation"]["primitives"], "finished": schemes["tessera"]["frame_bytes_written"]}
    for scheme, value in ((scheme, schemes[scheme]) for scheme in ("tessera", *SCHEMES)):
        measured |= {f"traffic {scheme}": value["dram_bytes"], f"evaluations {scheme}": value["position_evaluations"] + value["domain_evaluations_cached"],
                     f"cycles {scheme}": value["cycles"], f"energy {scheme}": value["energy_nj"]}
    return [column for column, value in measured.items() if int(row[column]) != value]


# ---- Tests ----------------------------------------------------------------------------------------------------------


class Pages(unittest.TestCase):
    def test_commands_of_the_readme(self):
        with tempfile.TemporaryDirectory() as out:
            all_of_them = list(commands("README.md", out))
            self.assertGreaterEqual(len(all_of_them), 3)
            for arguments in all_of_them:
                run(*arguments)

    def test_shipped_captures(self):
        with tempfile.TemporaryDirectory() as out:
            made = subprocess.run([ROOT / "captures/make.sh", out], env=os.environ | {"TESSERA_BUILD": build}, capture_output=True, text=True)
            self.assertEqual(made.returncode, 0, made.stderr)
            sizes = []
            for name in ("eggs", "vases", "serpent", "flyby", "stroll", "workshop", "city", "garden", "city_evening", "garden_lamps", "corridor"):
                shipped = Path(capture(name)).read_bytes()
                self.assertTrue(Path(out, f"{name}.glb").read_bytes() == shipped, f"{name} differs: run captures/make.sh")
                sizes.append(len(shipped))
            self.assertLessEqual(sum(sizes[:8]), 3 << 20)
            for size in sizes[8:]:
                self.assertLess(size, 1 << 20)
            for name in ("wall_1", "wall_4", "wall_16", "wall_4_plain"):
                shipped = Path(capture(f"studies/{name}")).read_bytes()
                self.assertTrue(Path(out, f"studies/{name}.glb").read_bytes() == shipped, f"{name} differs: run captures/make.sh")
                self.assertLessEqual(len(shipped), 32 << 10)

    def test_pages_name_the_model_of_their_times_and_energies(self):
        """A page is made on the default model, or says which commit and model its figures are of."""
        self.assertTrue(names_no_model("2.1 times the cycles"))
        self.assertTrue(names_no_model("a frame takes 12.5 mJ"))
        self.assertFalse(names_no_model("0.8 ms, `machine.timing=phases`, commit 0123abc"))
        self.assertFalse(names_no_model("3 MB read"))
        current = {"README.md", "docs/shading.md", "docs/tour.md", "docs/validation.md", "docs/when_it_pays.md", "docs/passes.md", "docs/timing_model.md",
                   "docs/calibration.md"}
        for file in sorted({*ROOT.glob("docs/**/*.md"), *ROOT.glob("*/README.md"), ROOT / "README.md"}):
            name = str(file.relative_to(ROOT))
            if name not in current and not re.search("^(Made by|Generated by|Keys of a `--gpu` file)", file.read_text(), re.M):
                self.assertFalse(names_no_model(file.read_text()), name)

    def test_materials_table(self):
        folder = IMAGES / "materials"
        table, size, credits = "<!-- models -->\n| model | FLIP | Tessera, three.js, FLIP |\n|---|---:|---|\n", 0, (folder / "CREDITS.md").read_text()
        for row in rows_of(folder / "materials.csv"):
            name = row["model"]
            table += f"| {name} | {row['flip']} | ![{name}](images/materials/{name}.webp) |\n"
            self.assertTrue(0 < float(row["flip"]) < 1, name)
            self.assertIn(f"| {name} |", credits)
            size += (folder / f"{name}.webp").stat().st_size
        self.assertIn(table + "<!-- end models -->", page("docs/shading.md"), "run docs/images/materials/make.sh")
        self.assertLess(size, 1500000)

    def test_equal_costs_are_found_between_two_sizes(self):
        self.assertEqual(sizes_where_less([(1, 1, 2), (4, 2, 3)]), "all")
        self.assertEqual(sizes_where_less([(1, 2, 2), (4, 3, 3)]), "none")
        self.assertEqual(sizes_where_less([(1, 1, 2), (4, 2, 1)]), "<2.0")
        self.assertEqual(sizes_where_less([(1, 2, 1), (4, 1, 2), (16, 1, 2)]), ">2.0")
        self.assertEqual(sizes_where_less([(1, 1, 2), (4, 2, 1), (16, 1, 2), (64, 2, 1)]), "<2.0+8.0-32")

    def test_the_verdict_follows_from_the_captures(self):
        rows = rows_of(ROOT / "docs/measurements/baselines.csv")

        def ratio(capture, cost, kinds):
            of = {row["scheme"]: row for row in rows if row["capture"] == capture}
            others = [row for name, row in of.items() if row["kind"] in kinds and (kinds == ["shipped"] or name not in ("immediate", "untiled"))]
            return int(of["tessera"][cost]) / min(int(row[cost]) for row in others)

        def span(cost, *kinds):
            ratios = [ratio(capture, cost, list(kinds)) for capture in ("eggs", "vases", "flyby", "stroll", "city", "garden")]
            return f"{min(ratios):.2f} to {max(ratios):.2f}"

        tiled = ("shipped", "idealised")
        text = re.search(r"^\*\*Verdict\.\*\* .*$", page("README.md"), re.M).group()
        self.assertEqual(re.findall(r"[0-9.]+[0-9] to [0-9.]+[0-9]", text),
                         [span("cycles", *tiled), span("energy_nj", *tiled), span("dram_bytes", "shipped"), span("energy_nj", "shipped"), span("cycles", "shipped")],
                         "run docs/measurements/readme.sh")
        self.assertIn(f"it takes {ratio('serpent', 'cycles', list(tiled)):.2f} of the time and {ratio('serpent', 'energy_nj', list(tiled)):.2f} of the energy", text)

    def test_break_even_follows_from_the_points(self):
        points, lines = rows_of(PAYS / "points.csv"), 0
        for row in rows_of(PAYS / "break_even.csv"):
            here = [point for point in points if place_of(point) == place_of(row)]
            for scheme in row.keys() & {column.removeprefix("traffic ") for column in points[0] if column.startswith("traffic ")}:
                self.assertEqual(row[scheme], sizes_where_less(costs_of(here, row["cost"], scheme)), f"{row['cost']} {place_of(row)} {scheme}")
                lines += 1
        self.assertEqual(lines, 4 * 36 * len(SCHEMES))

    def test_when_it_pays_shows_its_tables(self):
        text, points = page("docs/when_it_pays.md"), rows_of(PAYS / "points.csv")
        names = {"1,yes,0,32": "1 layer", "1,yes,8,32": "1 layer, blur 8", "1,yes,32,32": "1 layer, blur 32", "4,yes,0,32": "4 layers", "16,yes,0,32": "16 layers", "4,yes,8,32": "blur 8",
                 "4,yes,32,32": "blur 32", "4,no,0,32": "plain", "4,yes,0,16": "tiles 16", "4,yes,0,64": "tiles 64"}
        rows = 0
        for row in rows_of(PAYS / "break_even.csv"):
            name = names.get(place_of(row))
            if name and row["cost"] != "evaluations":
                self.assertIn(f"\n| {name} | {' | '.join(row[scheme] for scheme in SCHEMES)} |\n", text, "run docs/images/when_it_pays/make.sh")
                rows += 1
        self.assertEqual(rows, 3 * len(names))
        for scheme in SCHEMES:
            self.assertIn(f"\n{line_of_ranges(points, scheme)}\n", text)

    def test_effects_shows_what_effects_cost(self):
        text, tables, costs = page("docs/shading.md"), runpy.run_path(str(ROOT / "docs/images/effects/tables.py")), page("docs/images/effects/costs.csv")
        self.assertIn(f"<!-- costs -->\n{tables['costs_markdown'](costs)}\n<!-- end costs -->\n", text, "run docs/images/effects/make.sh")
        absent, work = tables["absent_work"](costs)
        self.assertGreater(absent, 100)
        self.assertEqual(work, 0)

    def test_absent_effects_cost_no_instructions(self):
        rows, text = rows_of(ROOT / "docs/images/effects/instructions.csv"), page("docs/shading.md")
        for row in rows:
            self.assertLessEqual(float(row["ratio"]), 1.005, row)
        without = [float(row["ratio"]) for row in rows if row["method"] == "compiled out"]
        self.assertIn(f"| compiled out, four captures | {min(without):.4f} to {max(without):.4f} |", text)
        of = {row["effect"]: float(row["ratio"]) for row in rows}
        self.assertIn(f"| motion; defocus | its functions | {max(of['motion'], of['defocus']):.4f} |", text)
        self.assertIn(f"| displacement | its functions | {of['displacement']:.4f} |", text)
        self.assertEqual({f"{ratio:.4f}" for effect, ratio in of.items() if not re.search("motion|defocus|displacement", effect)}, {"1.0000"})

    def test_accuracy_shows_its_tables(self):
        tables, folder, text = runpy.run_path(str(ROOT / "docs/images/accuracy/tables.py")), ROOT / "docs/images/accuracy", page("docs/accuracy_and_stability.md")
        for name in ("clock", "joint"):
            table = tables[f"{name}_markdown"](rows_of(folder / f"{name}.csv"))
            self.assertIn(f"<!-- {name} -->\n{table}\n<!-- end {name} -->\n", text, "run docs/images/accuracy/make.sh")
        self.assertEqual(tables["joint_plot"](rows_of(folder / "joint.csv")), (folder / "joint.svg").read_text(), "run docs/images/accuracy/make.sh")

    # The tables follow from the results; a capture without results keeps its rows.
    def test_accuracy_keeps_rows_of_captures_that_were_not_measured(self):
        merge = runpy.run_path(str(ROOT / "docs/images/accuracy/tables.py"))["merge"]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "some.csv")
            merge(file, "capture,ms", [["eggs", 1], ["city", 2]], "first")
            merge(file, "capture,ms", [["city", 3]], "second")
            self.assertEqual(file.read_text(), "capture,ms,commit\neggs,1,first\ncity,3,second\n")

    def test_when_it_pays_shows_its_doubts(self):
        text, rows = page("docs/when_it_pays.md"), rows_of(PAYS / "doubts.csv")
        self.assertEqual([(row["cost"], row["doubt"]) for row in rows], [(cost, doubt) for cost in ("cycles", "energy") for doubt in DOUBTS])
        for row in rows:
            self.assertIn(f"\n| {row['cost']} | {row['doubt']} | {' | '.join(row[scheme] for scheme in SCHEMES)} |\n", text, "run docs/images/when_it_pays/make.sh")

    def test_when_it_pays_shows_frames_of_several_passes(self):
        text, rows = page("docs/when_it_pays.md"), rows_of(ROOT / "docs/measurements/pass_baselines.csv")
        for scheme in {row["scheme"] for row in rows}:
            of = [row for row in rows if row["scheme"] == scheme]
            cells = [cell for row in of for cell in (" + ".join(f"{int(row[part]) / 1e6:.1f}" for part in ("map_bytes", "view_bytes", "image_bytes") if int(row[part])),
                                                     row["ms"], row["mj"])]
            self.assertIn(f"\n| `{scheme}` | {of[0]['kind']} | {' | '.join(cells)} |\n", text, "run docs/measurements/pass_baselines.py --table")
        self.assertEqual(len(rows), 3 * len({row["scheme"] for row in rows}))

    def test_passes_shows_shading_paths_of_all_machines(self):
        text, rows = page("docs/passes.md"), rows_of(ROOT / "docs/measurements/path_baselines.csv")
        shown = [(row["scheme"], row["path"]) for row in rows if row["kind"] != "idealised" and row["scheme"] != "patch-whole"]
        for scheme, path in dict.fromkeys(shown):
            cells = [cell for row in rows if (row["scheme"], row["path"]) == (scheme, path)
                     for cell in (f"{int(row['bytes']) / 1e6:.1f}", row["ms"], row["mj"])]
            self.assertIn(f"\n| `{scheme}` | `{path}` | {' | '.join(cells)} |\n", text, "run docs/measurements/pass_baselines.py --paths --table")
        self.assertEqual(len(rows), 3 * 4 * len({row["scheme"] for row in rows}))


class Replays(unittest.TestCase):
    def test_baselines_of_frames_of_several_passes(self):
        frame = statistics(capture("corridor"), "--frames", "0:1", "--size", "320x180", "--baselines")["frames"][0]
        rows = [row for row in rows_of(ROOT / "docs/measurements/pass_baselines.csv") if row["capture"] == "corridor"]
        self.assertEqual({row["scheme"] for row in rows}, set(frame["baselines"]))
        for row in rows:
            of = frame["baselines"][row["scheme"]]
            self.assertEqual(sum(int(row[part]) for part in ("map_bytes", "view_bytes", "image_bytes")),
                             of["baseline.dram_bytes"] + of["baseline.texture_bytes"], row["scheme"])
            self.assertEqual((int(row["list_bytes"]), int(row["cycles"])), (of["baseline.queue_bytes_peak"], of["baseline.cycles"]), row["scheme"])

    def test_baselines_along_a_gbuffer(self):
        frame = statistics(capture("corridor"), "--frames", "0:1", "--size", "320x180", "--baselines", "--set", "shading.path=gbuffer",
                           "--set", "gbuffer.layout=packed")["frames"][0]
        for row in rows_of(ROOT / "docs/measurements/path_baselines.csv"):
            if (row["capture"], row["path"]) != ("corridor", "gbuffer"):
                continue
            of = frame["baselines"][row["scheme"]]
            self.assertEqual((int(row["bytes"]), int(row["cycles"])),
                             (of["baseline.dram_bytes"] + of["baseline.texture_bytes"], of["baseline.cycles"]), row["scheme"])

    def test_hard_cases(self):
        with tempfile.TemporaryDirectory() as out:
            run("selfcheck", "--stability", "--out", out)
            self.assertIn(f"<!-- cases -->\n{Path(out, 'stability.md').read_text()}<!-- end cases -->", page("docs/hard_cases.md"),
                          "run docs/images/stability/make.sh")
            shown = {file.name: file.read_bytes() for file in (IMAGES / "stability").glob("*.webp")}
            self.assertEqual(shown, {file.name: file.read_bytes() for file in Path(out).glob("*.webp")}, "run docs/images/stability/make.sh")

    @staticmethod
    @lru_cache(None)
    def readme_statistics():
        all_of_it = statistics(capture("eggs"), "--baselines")
        return all_of_it["total"] | {"kinds": all_of_it["baseline_kinds"]}

    def test_readme(self):
        text, total = page("README.md"), self.readme_statistics()
        values = total["counters"] | {"timing.cycles": total["timing"]["cycles"]}
        counters = [(name, digits) for name, digits in re.findall(r"^\| `([a-z_.]+)` \| ([0-9 ]+) \|$", text, re.M) if name in values]
        self.assertGreaterEqual(len(counters), 5)
        self.assertIn("timing.cycles", dict(counters))
        for name, digits in counters:
            self.assertEqual(int(digits.replace(" ", "")), values[name], name)
        megahertz = next(key for key in json.loads(run("describe", "gpu", "--json")) if key["key"] == "clock.mhz")["default"]
        shown = {row[0]: row[1:] for row in re.findall(r"^\| \**`([a-z-]+)`\** \| ([a-z]+) \| ([0-9 ]+) \| ([0-9 ]+) \| ([0-9.]+) \| ([0-9.]+) \|$", text, re.M)}
        self.assertEqual(shown.keys(), total["baselines"].keys(), "every scheme")
        for scheme, (kind, peak, traffic, milliseconds, millijoules) in shown.items():
            self.assertEqual(kind, total["kinds"][scheme])
            value = total["baselines"][scheme]
            self.assertEqual(int(peak.replace(" ", "")), value["baseline.queue_bytes_peak"], scheme)
            self.assertEqual(int(traffic.replace(" ", "")), value["baseline.dram_bytes"], scheme)
            self.assertAlmostEqual(float(milliseconds), value["baseline.cycles"] / megahertz / 1000, delta=0.051, msg=scheme)
            self.assertAlmostEqual(float(millijoules), value["baseline.energy_nj"] / 1e6, delta=0.051, msg=scheme)

    def test_lists_are_one_to_two_orders_of_magnitude_smaller_than_those_of_triangles(self):
        """The purpose of the project. A smaller ratio is a fault of the binner, a larger one means that a cost was forgotten."""
        schemes = self.readme_statistics()["baselines"]
        for counter in ("queue_bytes_written", "queue_bytes_read", "queue_bytes_peak"):
            ratio = schemes["post-tessellation"][f"baseline.{counter}"] / schemes["tessera"][f"baseline.{counter}"]
            self.assertTrue(10 <= ratio <= 1000, f"{counter}: {ratio}")

    def test_shading(self):
        rows = [row for row in rows_of(IMAGES / "shading/rates.csv") if row["rate"] == "cache"]
        self.assertEqual(len(rows), 4)
        for row in rows:
            counters = statistics(capture(row["capture"]), *settings(shading__rate="cache"))["total"]["counters"]
            for column, counter in (("samples_visible", "samples_visible"), ("invocations", "pixel_shader_invocations"),
                                    ("invocations_saved", "pixel_shader_invocations_saved")):
                self.assertEqual(int(row[column]), counters[f"tilecore.{counter}"], f"{row['capture']}, {column}: run docs/images/shading/make.sh")

    @staticmethod
    def binning(tile, depth, *more):
        keys = settings(frontend__split_pixels=16, tile__width=tile, tile__height=tile, frontend__split_depth=depth, parameter_buffer__bytes=16777216)
        return statistics(capture("eggs"), "--size", "640x360", *keys, *more)["frames"][0]

    def test_binning_study_tiles(self):
        rows = rows_of(IMAGES / "studies/tiles.csv")
        self.assertEqual(len(rows), 4)
        for row in rows:
            schemes = self.binning(int(row["tile"]), 0, "--baselines")["baselines"]
            for column, scheme in (("pre", "tessera"), ("patch_whole", "patch-whole"), ("post", "post-tessellation")):
                self.assertEqual(int(row[f"{column}_queue_bytes"]), schemes[scheme]["baseline.queue_bytes_peak"])
                self.assertEqual(int(row[f"{column}_traffic_bytes"]), schemes[scheme]["baseline.dram_bytes"])
            for column, among, error in (("queues", "queue_bytes", 0.051), ("traffic", "traffic_bytes", 0.0051)):
                self.assertAlmostEqual(float(row[f"post_over_pre_{column}"]), int(row[f"post_{among}"]) / int(row[f"pre_{among}"]), delta=error)

    def test_binning_study_depths(self):
        rows = rows_of(IMAGES / "studies/depths.csv")
        self.assertEqual(len(rows), 5)
        for row in rows:
            frame = self.binning(32, int(row["depth"]))
            for column, counter in (("sub_patches", "frontend.sub_patches"), ("entries", "binner.entries"),
                                    ("queue_bytes_peak", "binner.queue_bytes_peak"), ("domain_evaluations", "tilecore.domain_evaluations")):
                self.assertEqual(int(row[column]), frame["counters"][counter], f"{column}: run docs/images/studies/make.sh")
            # The front end bounds sub-patches by its tables of heights.
            self.assertEqual(int(row["traffic_bytes"]), sum(part["read_bytes"] + part["written_bytes"] for part in frame["dram"]
                                                            if part["purpose"] != "texture" or part["unit"] == "frontend"))

    def test_when_it_pays_points(self):
        again = {"1,yes,8,16 4.0", "4,no,0,32 16.0", "4,yes,32,64 1.0", "16,yes,0,32 64.0"}
        rows = [row for row in rows_of(PAYS / "points.csv") if f"{place_of(row)} {row['px2']}" in again]
        self.assertEqual(len(rows), len(again))
        for row in rows:
            schemes = replay_of(row)
            self.assertLessEqual({"tessera", *SCHEMES}, schemes.keys())  # machines that came later are not part of the study
            self.assertEqual(contradictions(row, schemes), [], "run docs/images/when_it_pays/make.sh")
            self.assertEqual(contradictions(row | {"traffic control-list": "1"}, schemes), ["traffic control-list"], "the twin")

    def test_when_it_pays_parts(self):
        """Parts of the traffic in 4 layers of triangles of 1 px²."""
        rows = [row for row in rows_of(PAYS / "parts.csv") if place_of(row) == "4,yes,0,32" and row["px2"] == "1.0"]
        self.assertEqual(len(rows), 1 + len(SCHEMES))
        for row in rows:
            value = replay_of(row)[row["scheme"]]
            frame, records = value["frame_bytes_read"] + value["frame_bytes_written"], value["patch_bytes_cached"]
            for column, measured in (("lists", value["dram_bytes"] - frame - records), ("records", records), ("frame", frame),
                                     ("lists_written", value["queue_bytes_written"]), ("bounding_operations", value["bounding_operations"]),
                                     ("partial_render_at_half", value["partial_render_bytes"]), ("spill_at_half", value["spill_bytes"]),
                                     ("cycles", value["cycles"]), ("energy_nj", value["energy_nj"])):
                self.assertEqual(int(row[column]), measured, f"{row['scheme']}, {column}: run docs/images/when_it_pays/make.sh")

    def test_tour(self):
        text = page("docs/tour.md")
        with tempfile.TemporaryDirectory() as out:
            all_of_them = list(commands("docs/tour.md", out))
            self.assertGreaterEqual(len(all_of_them), 8)
            for arguments in all_of_them:
                run(*arguments)
            machines = {row["gpu"]: row for row in rows_of(Path(out, "out/tour/machines/sweep.csv"))}
            smallest = rows_of(Path(out, "out/tour/smallest/sweep.csv"))
        shown = re.findall(r"^\| `([a-z-]+)` \| ([0-9.]+) \| ([0-9.]+) \| ([0-9.]+) \| ([0-9.]+) \|$", text, re.M)
        self.assertEqual(len(shown), 3)
        clock = next(key for key in json.loads(run("describe", "gpu", "--json")) if key["key"] == "clock.mhz")
        for name, milliseconds, millijoules, watts, area in shown:
            row = machines[name]
            megahertz = clock["presets"].get(name, clock["default"])
            energy = float(row["energy.total_nj"]) * 1e-6
            self.assertAlmostEqual(float(row["timing.cycles"]) / megahertz * 1e-3, float(milliseconds), delta=0.05)
            self.assertAlmostEqual(energy, float(millijoules), delta=0.05)
            self.assertAlmostEqual(float(row["energy.power_w"]), float(watts), delta=0.005)
            self.assertAlmostEqual(float(row["area.total_mm2"]), float(area), delta=0.05)
        least = min(float(row["area.total_mm2"]) for row in smallest if float(row["timing.time_ms"]) <= 16.666666)
        self.assertAlmostEqual(least, float(re.search(r"do it on ([0-9.]+) mm²", text)[1]), delta=0.05)


if __name__ == "__main__":
    words = sys.argv[1:]
    if "--help" in words or "-h" in words:
        sys.exit(print(__doc__))
    options = {}
    while words[:1] and words[0] in ("--program", "--build"):
        options[words[0]] = words[1]
        words = words[2:]
    program = str(Path(options["--program"]).resolve())
    build = options.get("--build", str(Path(program).parent))
    unittest.main(argv=[sys.argv[0], *words])
