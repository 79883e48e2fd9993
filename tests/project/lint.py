#!/usr/bin/env python3
"""tests/project/lint.py [--program TESSERA] [--tests FOLDER...] [--format]   checks the project's own rules in about a second.

--program  also checks that generated pages are what this program prints; with --write writes them instead
--tests    also checks that documents name tests that the programs below these folders have (lists that CMake wrote there)
--format   only asks clang-format 14 whether every source is formatted
--prose    only lists lines whose English reads like a translation, and long sentences

Every rule is a function that returns complaints, and has a twin in twins(): a text that breaks the rule must be complained about.
"""
import argparse
import json
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# In the order in which they may include each other.
ROOMS = ["base", "shaders_cpp", "scene", "memory", "hardware", "timing", "frontend", "binner", "tilecore", "gpu", "baselines",
         "reference", "replay"]
OTHERS = ["include", "python", "tests", "bench", "captures"]
TOP_LEVEL = {*ROOMS, *OTHERS, "cmake", "docs", "build", "out", "CMakeLists.txt", "CMakePresets.json", "README.md", "CONTRIBUTING.md", "CHANGELOG.md",
             "CITATION.cff", "Containerfile", "tessera"}
WITH_README = ["base", "hardware", "shaders_cpp", "frontend", "binner", "tilecore", "replay", "python", "tests", "bench", "captures"]
# A unit of the machine is found by its name: in one file, whose path or text says it.
UNITS = {
    "coverage": "binner/coverage.h",
    "device": "gpu/device.h",
    "dither": "tilecore/resolve/pattern_dither.h",
    "front end": "frontend/front_end.h",
    "L2": "memory/l2.h",
    "list builder": "binner/binner.h",
    "parameter buffer": "binner/parameter_buffer.h",
    "raster path": "tilecore/visibility/raster_kernel.cpp",
    "ray path": "tilecore/visibility/ray-inl.h",
    "resolve unit": "tilecore/resolve/resolve_unit.h",
    "sampling controller": "tilecore/procedural/sampling_controller.h",
    "shading cache": "tilecore/shading/shading_cache.h",
    "splitter": "frontend/patch_splitter.h",
    "stencil": "tilecore/visibility/stencil.h",
    "temporal reprojection": "tilecore/resolve/advection.h",
    "tessellator": "tilecore/tessellation/tessellator.h",
    "texture cache": "tilecore/shading/texture_unit.h",
    "tile core": "tilecore/tile_core.h",
    "tile scheduler": "gpu/tile_scheduler.h",
    "timing": "timing/timing_model.h",
}
SOURCES = (".h", ".cpp", ".inc", ".c")
WITH_WORDS = (*SOURCES[:3], ".def", ".js", ".py", ".sh", ".cmake", ".md")


# ---- Files --------------------------------------------------------------------------------------------------------


def project_files():
    """Path from the root and text of every file with words, except built and hidden files."""
    files = {}
    for folder, folders, names in os.walk(ROOT):
        top = Path(folder) == ROOT
        folders[:] = sorted(f for f in folders if not f.startswith(".") and f != "__pycache__" and not (top and f in ("build", "out")))
        for name in names:
            if name.endswith((*WITH_WORDS, ".c")) or name == "CMakeLists.txt":
                path = Path(folder, name)
                files[str(path.relative_to(ROOT))] = path.read_text(errors="replace")
    return files


def documents(files):
    return {path: text for path, text in files.items() if path.endswith(".md")}


def sources(files, folders=(*ROOMS, *OTHERS)):
    return {path: text for path, text in files.items() if path.endswith(SOURCES) and path.split("/")[0] in folders}


# ---- Layout -------------------------------------------------------------------------------------------------------


def may_include(room, other):
    """Scenes know nothing of the machine, timing nothing of scenes and shaders; baselines and the reference observe the machine,
    not each other."""
    if room == other:
        return True
    if room in ("memory", "hardware", "timing"):
        return other == "base" or (room != "memory" and other == "memory") or (room == "timing" and other == "hardware")
    if (room, other) == ("reference", "baselines"):
        return False
    return other in ROOMS and ROOMS.index(other) < ROOMS.index(room)


def wrong_includes(path, text):
    room = path.split("/")[0]
    allowed = (lambda other: may_include(room, other)) if room in ROOMS else lambda other: room not in ("include", "python") or other == "python"
    return [f"{path} includes {other}" for other in sorted(set(re.findall(r'#include "([a-z_]+)/', text))) if not allowed(other)]


def function_lengths(text):
    """Lines and first line of each function's body, by the braces that the formatter puts at the margin."""
    found, begin, head = [], 0, ""
    for number, line in enumerate(text.split("\n")):
        if not line or line[0] in " #/":
            continue
        if line[0] == "}":
            if head:
                found.append((number - begin, head))
            head = ""
        else:
            head = "" if line.startswith(("namespace", "class ", "struct ", "enum ")) else line
            begin = number
    return found


def too_long(path, text):
    lines = text.count("\n")
    wrong = [f"{path} has {lines} lines: a source has at most 800"] if lines > 800 else []
    return wrong + [f"{path} has a function of {n} lines, at most are 100: {head}" for n, head in function_lengths(text) if n > 100]


# A loop keeps alive the result of the last call alone: of a call's result it may not be an element.
LOOP_OVER_ELEMENT = re.compile(r"for \([^;()]* : [\w:]+\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\)(?:\[[^\]]*\])+(?:\.items\(\))?\)")


def loops_over_what_is_gone(path, text):
    return [f"{path} loops over an element of a result that is destroyed before: {loop}" for loop in LOOP_OVER_ELEMENT.findall(text)]


def wrong_names_at_the_top(names):
    return [f"{name}: no file or folder of this name is expected in the root" for name in names if not name.startswith(".") and name not in TOP_LEVEL]


def unit_not_found(unit, path, files):
    plain = (path + files.get(path, "")).lower().replace("_", " ")
    return [] if path in files and unit.lower() in plain else [f"{path}: the unit '{unit}' is not found there"]


# ---- Documents ----------------------------------------------------------------------------------------------------


def broken_links(path, text):
    wrong = []
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text):
        if "://" not in target and not (ROOT / path).parent.joinpath(target).exists():
            wrong.append(f"{path} links to {target}")
    for name in re.findall(r"`((?:%s)/[A-Za-z0-9_./-]*)`" % "|".join([*ROOMS, *OTHERS, "cmake", "docs"]), text):
        if not (ROOT / name).exists():
            wrong.append(f"{path} names {name}")
    return wrong


def retired_phrases():
    """tests/project/retired_words.txt: a phrase as a regular expression and, after a tab, its replacement. Whole words, capitals
    or not. With the letters that every match begins with: searching them first saves most of the time."""
    lines = (ROOT / "tests/project/retired_words.txt").read_text().splitlines()
    return [(re.match(r"(?:[A-Za-z ](?!\?))*", phrase)[0].lower(), re.compile(r"\b(?:%s)\b" % phrase, re.I), instead)
            for phrase, instead in (line.split("\t") for line in lines)]


def retired_words(path, text, phrases):
    """Lines that say a retired phrase. Names are not words: code marks of documents, quoted tokens of sources."""
    document, low = path.endswith(".md"), text.lower()
    phrases = [phrase for phrase in phrases if phrase[0] in low]
    if not phrases:
        return []
    fewer = re.sub(r"^```.*?^```", lambda block: "\n" * block[0].count("\n"), text, flags=re.M | re.S) if document else text
    prose = re.sub(r"`[^`\n]*`" if document else r"""(["'])[A-Za-z0-9_.:/%=&?*#+-]*\1""", " ", fewer)
    return [f"{path}:{prose.count(chr(10), 0, match.start()) + 1}: {match[0]} (say: {instead})"
            for _, phrase, instead in phrases for match in phrase.finditer(prose)]


def declared_invariants(text):
    """Numbers that a text declares: "//   PB1  law" in a header, "| M1 | law |" in docs/architecture.md."""
    return [a or b for a, b in re.findall(r"^ *//   ([A-Z]+[0-9]+)  [^ ].*$|^\| (M[0-9]+) \| .*$", text, re.M)]


def cited_invariants(text):
    """Capitals and digits that are not inside a word; a test's name may begin with them."""
    runs = re.finditer(r"(?:^|[^A-Za-z0-9_])((?:(?:And)?[A-Z]+[0-9]+(?:And)?)+)", text, re.M)
    return {number for run in runs for number in re.findall(r"[A-Z]+[0-9]+", run[1])}


def wrong_invariants(declarations, cited):
    """declarations: pairs of a number and the file that declares it."""
    wrong, places, units = [], {}, {}
    for number, path in declarations:
        if number in places:
            wrong.append(f"{number} is declared by {places[number]} and {path}")
        places[number] = path
        prefix = number.rstrip("0123456789")
        if units.setdefault(prefix, path) != path:
            wrong.append(f"the prefix {prefix} names two units: {units[prefix]} and {path}")
    return wrong + [f"{number} of {path} is cited by no test" for number, path in places.items() if number not in cited]


def repeated_programs(readme, files):
    return [f"README.md does not show {path} as it is tested" for path in ("tests/package/consumer/main.cpp", "tests/package/counters.py")
            if (ROOT / path).read_text() + "```" not in readme]


# ---- Plain English ------------------------------------------------------------------------------------------------

# Patterns of prose that was translated word by word, and words with which no comment, text or paragraph opens.
TRANSLATED = re.compile(r"\bwhat (?:is|was|has|it|they|there|an?|the)\b|\bthose (?:of|that)\b|\bthat of\b|\bin hand\b"
                        r"|\bone behind the other\b|\bnobody\b|\bfor itself\b", re.I)
OPENINGS = re.compile(r"(?:Of|What|Those|That of)\b|Null:|False ?=")
QUESTION = re.compile(r"What if\b|What [^.]*\?")
# A pattern begins with one of these words; looking for them first saves most of the time.
FIRST_WORDS = ("what ", "those ", "that of", "in hand", "one behind", "nobody", "for itself")
MAX_TRANSLATED, MAX_OPENINGS, MAX_LONG, LONG_SENTENCE = 0.005, 0.002, 0.03, 30
# Strings of a source, which end a line's code; a comment begins outside of them.
C_TOKENS = re.compile(r'"((?:[^"\\\n]|\\.)*)"|//[/!<]*([^\n]*)|/\*(.*?)\*/', re.S)
HASH_TOKENS = re.compile(r'"""(.*?)"""|"((?:[^"\\\n]|\\.)*)"|\'(?:[^\'\\\n]|\\.)*\'|(?<!\S)#(?!!)([^\n]*)', re.S)
C_LIKE = (".h", ".cpp", ".inc", ".c", ".def", ".js")
GENERATED_PAGES = {f"docs/{name}.md" for name in ("counters", "extensions", "formats", "gpu", "settings")}


def with_words(texts):
    return [(number, text.strip()) for number, text in texts if re.search(r"[A-Za-z]{2}", text)]


def comment_lines(path, text):
    """Number and text of each line of a comment, or of a docstring."""
    found, like_c = [], path.endswith(C_LIKE)
    for token in (C_TOKENS if like_c else HASH_TOKENS).finditer(text):
        comment = (token[2] or token[3]) if like_c else (token[1] or token[3])
        if comment:
            number = text.count("\n", 0, token.start()) + 1
            found += [(number + k, line.lstrip(" *")) for k, line in enumerate(comment.split("\n"))]
    return with_words(found)


def user_texts(path, text):
    """Number and text of each string of three words or more: key meanings, counter texts, messages."""
    found, like_c = [], path.endswith(C_LIKE)
    for token in (C_TOKENS if like_c else HASH_TOKENS).finditer(text):
        words = token[1] if like_c else token[2]
        if words and words.count(" ") > 1:
            found.append((text.count("\n", 0, token.start()) + 1, words))
    return with_words(found)


def page_lines(text):
    """Number and text of each line of a page outside of blocks of code, without marks of lists."""
    plain = re.sub(r"^```.*?^```", lambda block: "\n" * block[0].count("\n"), text, flags=re.M | re.S)
    return with_words((number, re.sub(r"^[\s>#*|-]*", "", line)) for number, line in enumerate(plain.split("\n"), 1))


def translated(lines):
    """Lines that have a pattern, and lines that open with one of the words. Code marks are names, not words."""
    patterns = [(number, line) for number, line in lines
                if any(word in line.lower() for word in FIRST_WORDS) and TRANSLATED.search(re.sub(r"`[^`]*`", "x", line))]
    return patterns, [(number, line) for number, line in lines if OPENINGS.match(line) and not QUESTION.match(line)]


def sentences(page):
    """Sentences of a page's paragraphs and list items: no tables, headings, pictures and blocks of code."""
    plain = re.sub(r"^```.*?^```|^\|[^\n]*|^#[^\n]*|^ *!\[[^\n]*|<!--.*?-->", "", page, flags=re.M | re.S)
    plain = re.sub(r"`[^`]*`", "x", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", plain))
    paragraphs = re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|[0-9]+\.) )", plain)
    return [sentence for paragraph in paragraphs for sentence in re.split(r"(?<=[.!?])\s+", paragraph.strip()) if sentence.strip("-* ")]


def long_sentences(page):
    return [sentence for sentence in sentences(page) if len(sentence.split()) > LONG_SENTENCE]


def prose(files):
    """Of comments, texts and pages: how many lines there are, and which have a pattern or open with one of the words."""
    kinds = {"comments": [0, [], []], "texts": [0, [], []], "pages": [0, [], []]}
    for path, text in files.items():
        if path == "tests/project/lint.py":
            continue
        lines = {}
        if path.endswith(".md"):
            lines["pages"] = page_lines(text)
        else:
            lines["comments"] = comment_lines(path, text)
            # Texts of tests and benchmarks are for developers, and often quote.
            if path.split("/")[0] in (*ROOMS, "include", "python"):
                lines["texts"] = user_texts(path, text)
        for kind, found in lines.items():
            patterns, openings = translated(found)
            kinds[kind][0] += len(found)
            kinds[kind][1] += [(path, *line) for line in patterns]
            kinds[kind][2] += [(path, *line) for line in openings]
    return kinds


def wrong_prose(kinds, pages):
    """pages: the hand-written ones."""
    wrong = []
    for kind, (count, patterns, openings) in kinds.items():
        for what, lines, most in (("have a pattern of translated prose", patterns, MAX_TRANSLATED), ("open with Of, What, Those, That of, Null: or False=", openings, MAX_OPENINGS)):
            if len(lines) > most * count:
                wrong.append(f"{len(lines)} of {count} lines of {kind} {what}, {100 * most:.1f} % may (lint.py --prose lists them), e.g. {lines[0][0]}:{lines[0][1]}")
    every, long = sum(len(sentences(page)) for page in pages.values()), sum(len(long_sentences(page)) for page in pages.values())
    if long > MAX_LONG * every:
        wrong.append(f"{long} of {every} sentences of pages have more than {LONG_SENTENCE} words, {100 * MAX_LONG:.0f} % may (lint.py --prose lists them)")
    return wrong


def hand_written(files):
    return {path: text for path, text in documents(files).items() if path not in GENERATED_PAGES}


def list_prose(files):
    kinds = prose(files)
    for kind, (count, patterns, openings) in kinds.items():
        for path, number, line in sorted({*patterns, *openings}):
            print(f"{path}:{number}: {line[:160]}")
        print(f"{kind}: {count} lines, {len(patterns)} with a pattern, {len(openings)} openings")
    for path, page in hand_written(files).items():
        for sentence in long_sentences(page):
            print(f"{path}: {len(sentence.split())} words: {' '.join(sentence.split())[:160]}")
        if sentences(page):
            print(f"{path}: {len(long_sentences(page))} of {len(sentences(page))} sentences are long")


# ---- Version, citation, container -----------------------------------------------------------------------------------


def project_version(cmake):
    return re.search(r"^project\(tessera VERSION ([0-9.]+)", cmake, re.M)[1]


def wrong_citation(text, version):
    """CITATION.cff: a mapping whose version is the project's. PyYAML, where it is there, reads all of it; else its lines are looked at."""
    fields, wrong = dict(re.findall(r"^([a-z-]+): *(.*?)\s*$", text, re.M)), []
    if len(fields) != len(re.findall(r"^[a-z-]+:", text, re.M)):
        wrong.append("CITATION.cff has a key twice")
    try:
        import yaml
        fields = yaml.safe_load(text)
    except ImportError:
        wrong += [f"CITATION.cff is no YAML: {line}" for line in text.splitlines() if not re.match(r"(#|$| +\S|[a-z-]+:( |$))", line)]
    except yaml.YAMLError as error:
        return [f"CITATION.cff is no YAML: {error}"]
    if not isinstance(fields, dict):
        return ["CITATION.cff is no mapping"]
    wrong += [f"CITATION.cff has no {key}" for key in ("cff-version", "message", "title", "authors", "version") if key not in fields]
    if str(fields.get("cff-version")) != "1.2.0" or str(fields.get("version")).strip("\"'") != version:
        wrong.append(f"CITATION.cff is not of format 1.2.0 and version {version}")
    return wrong


def wrong_changelog(text, version):
    newest = re.search(r"^## ([0-9.]+) ", text, re.M)
    return [] if newest and newest[1] == version else [f"CHANGELOG.md does not begin with {version}"]


def wrong_container(text, launcher, readme):
    """The Containerfile installs the packages of ./tessera and runs two commands of README.md."""
    wrong, packages = [], set(re.search(r"^packages=\(([^)]*)\)", launcher, re.M)[1].split())
    installed = set(re.search(r"--no-install-recommends((?: *\\\n? *[a-z0-9+.-]+| +[a-z0-9+.-]+)*)", text)[1].replace("\\", " ").split())
    if installed != packages:
        wrong.append(f"Containerfile and ./tessera install other packages: {' '.join(sorted(installed ^ packages))}")
    commands = re.findall(r"^RUN (\./tessera .*)$", text, re.M) + [" ".join(json.loads(words)) for words in re.findall(r"^CMD (.*)$", text, re.M)]
    if len(commands) != 2:
        wrong.append("Containerfile does not run two commands")
    return wrong + [f"README.md does not show the Containerfile's {command}" for command in commands
                    if not re.search(rf"^{re.escape(command)} *(#|$)", readme, re.M)]


# ---- Tests that documents name --------------------------------------------------------------------------------------


def names_a_test(name, tests):
    """"Suite.Law" is not "Suite.LawAndMore", but "Suite.Law/0"; a name may also end inside an instance's name."""
    inside = name.find("/") < name.rfind("/")
    return any(test.startswith(name) and (inside or test[len(name):len(name) + 1] in ("", "/")) for test in tests)


def missing_tests(page, tests):
    """Rows of docs/hard_cases.md, "- **case**: ... `Suite.Law`, `fuzz: target`" and "| ![case](image) | **case.** ...", whose tests are
    not there."""
    wrong = []
    for case, rest in re.findall(r"^(?:- |\| !\[[^|]*\| )\*\*(.+?)\*\*(.*)$", page, re.M):
        named = re.findall(r"`((?:[A-Za-z]\w*/)?[A-Z]\w+\.\w[^`]*|(?:long )?fuzz: \w+)`", rest)
        wrong += [f"{case}: no test"] * (not named)
        wrong += [f"{case}: {name} is not there" for name in named if not names_a_test(name, tests)]
    return wrong


def listed_tests(folders):
    """Names of the tests below folders, as CMake wrote them for ctest, without the part before ': ', which only fuzz targets keep."""
    names = set()
    for listing in (file for folder in folders for file in Path(folder).glob("*.cmake")):
        for name in re.findall(r"^add_test\( *(?:\[=+\[(.*?)\]=+\]|\"(.*?)\"|(\S+)) ", listing.read_text(errors="replace"), re.M):
            name = "".join(name)
            names.add(name if "fuzz: " in name else name.split(":", 1)[-1].strip())
    return names


# ---- Output of the program -----------------------------------------------------------------------------------------


def described(program, *arguments):
    return subprocess.run([program, "describe", *arguments], capture_output=True, text=True, check=True).stdout


# Topics of `tessera describe`. Three have a page that people write and that holds the generated table, from the line "Made by" on.
TOPICS = ["counters", "settings", "gpu", "calibration", "extensions", "formats", "procedures", "effects"]
WRITTEN_PAGES = {"calibration": "docs/calibration.md", "procedures": "docs/procedures.md", "effects": "docs/shading.md"}


def generated_page(topic):
    return WRITTEN_PAGES.get(topic, f"docs/{topic}.md")


def with_generated(page, topic, generated):
    """The page with the generated text in its place: all of it, or the line "Made by" and the table behind it."""
    if topic not in WRITTEN_PAGES:
        return generated
    table = re.compile(rf"^Made by `tessera describe {topic} --markdown`\.\n\n(?:\|.*\n)+", re.M)
    found = table.search(generated)
    return table.sub(lambda _: found[0], page) if found and table.search(page) else ""


def stale_pages(program):
    topics = re.search(r"One of ([a-z, ]+);", described(program, "--help"))[1].split(", ")
    wrong = [] if topics == TOPICS else [f"tessera describe has other topics: {', '.join(topics)}"]
    for topic in TOPICS:
        page, generated = (ROOT / generated_page(topic)).read_text(), described(program, topic, "--markdown")
        if with_generated(page, topic, generated) != page:
            wrong.append(f"{generated_page(topic)} does not hold what `tessera describe {topic} --markdown` prints: run tests/project/lint.py --program PROGRAM --write")
    # How many numbers there are, are published, rest on a publication in part, are our own.
    counts = re.findall(r"\b[0-9]+\b", described(program, "calibration", "--markdown").split("\n\n")[1])[:4]
    shown = re.search(r"has (\d+) numbers: (\d+) are published, (\d+) rest on a publication in part, and (\d+)", (ROOT / "docs/validation.md").read_text())
    if not shown or list(shown.groups()) != counts:
        wrong.append(f"docs/validation.md has other counts of numbers than {counts}")
    return wrong


def write_pages(program):
    for topic in TOPICS:
        file = ROOT / generated_page(topic)
        file.write_text(with_generated(file.read_text(), topic, described(program, topic, "--markdown")))


def wrong_extension(extension, page, schema):
    """Every member of an extension of ours is on its page and in its schema, and nothing else is."""
    members = {member["name"] for member in extension["members"]}
    wrong = [f"{extension['name']}: its page does not name {member}" for member in sorted(members) if member not in page]
    if schema["properties"].keys() - {"extensions", "extras"} != members:
        wrong.append(f"{extension['name']}: its schema has other members")
    return wrong


def wrong_extensions(program):
    wrong = []
    for extension in json.loads(described(program, "extensions", "--json")):
        if extension["name"].startswith("TESSERA_"):
            base = ROOT / "docs/extensions" / extension["name"]
            wrong += wrong_extension(extension, base.with_suffix(".md").read_text(), json.loads(base.with_suffix(".schema.json").read_text()))
    return wrong


# ---- All of it ------------------------------------------------------------------------------------------------------


def twins(phrases):
    """Each rule against texts that break it and, where it could cry wolf, against texts that do not."""
    citation = "cff-version: 1.2.0\nmessage: m\ntitle: t\nversion: 1.0.0\nauthors:\n  - name: n\n"
    install, launcher, readme = "RUN apt-get install --no-install-recommends \\\n  a \\\n  b-dev\n", "packages=(a\n  b-dev)\n", "./tessera a b # c\n./tessera d\n"
    container = install + 'RUN ./tessera a b\nCMD ["./tessera", "d"]\n'
    long_text = "namespace a {\nint f() {\n" + "  ++x;\n" * 120 + "}\n}  // namespace a\n"
    broken = [
        wrong_includes("frontend/a.h", '#include "tilecore/tile_core.h"\n'), wrong_includes("timing/a.h", '#include "scene/pose.h"\n'),
        wrong_includes("gpu/a.h", '#include "replay/describe.h"\n'), wrong_includes("include/tessera/a.h", '#include "gpu/device.h"\n'),
        too_long("gpu/a.cpp", long_text), too_long("gpu/a.cpp", "\n" * 801), wrong_names_at_the_top(["notes.txt"]),
        loops_over_what_is_gone("a.cpp", 'for (const json& f : parse(read(out / "a"))["frames"])'),
        loops_over_what_is_gone("a.cpp", 'for (const auto& [k, v] : parse(text)["frames"][0].items()) {'),
        unit_not_found("tile core", "gpu/tile_core.h", {}), unit_not_found("texture cache", "a/b.h", {"a/b.h": "surfaces"}),
        broken_links("README.md", "[a](docs/nothing.md)"), broken_links("docs/tour.md", "`gpu/nothing.h`"),
        wrong_invariants([("PB1", "a.h"), ("PB1", "b.h")], {"PB1"}), wrong_invariants([("PB1", "a.h"), ("PB2", "b.h")], {"PB1", "PB2"}),
        wrong_invariants([("PB1", "a.h")], cited_invariants("a_PB1 VPB1 PB11")), repeated_programs("", {}),
        missing_tests("- **bare**: what breaks; *what is done*.", {"Suite.Law"}),
        missing_tests("| ![bare](bare.webp) | **bare.** What breaks. | 0 px | 0 |", {"Suite.Law"}),
        missing_tests("- **case**: `Suite.Law`", {"Suite.LawAndMore"}), missing_tests("- **case**: `Case/Suite.Law/Pole_`", {"Case/Suite.Law/Point_obb"}),
        wrong_extension({"name": "E", "members": [{"name": "count"}]}, "", {"properties": {"count": {}}}),
        wrong_extension({"name": "E", "members": []}, "", {"properties": {"count": {}}}),
        wrong_citation(citation, "1.0.1"), wrong_citation(citation + "title: t\n", "1.0.0"), wrong_citation(citation + "no mapping\n", "1.0.0"),
        wrong_citation(citation.replace("authors", "writers"), "1.0.0"),
        wrong_changelog("# Changes\n\n## 1.0.0 (2026-01-01)\n", "1.0.1"), wrong_changelog("", "1.0.0"),
        wrong_container(container, "packages=(a)\n", readme), wrong_container(install, launcher, readme), wrong_container(container, launcher, "./tessera d\n"),
    ]
    table = "Made by `tessera describe effects --markdown`.\n\n| effect |\n|---|\n"
    broken += [with_generated("# Shading\n\n" + table + "| `stale` |\n\nText.\n", "effects", "# Effects\n\n" + table) != "# Shading\n\n" + table + "| `stale` |\n\nText.\n",
               with_generated("# Shading\n", "effects", table) != "# Shading\n"]
    for text in ("// The picture, whole.", "two Rivals", "through the middle of the lens", "int most_tiles;", "each stroke",
                 "runs of the pixel shader", "a tile queue"):
        broken += [retired_words("a.h", text, phrases), retired_words("a.md", text, phrases)]
    translation = "int a;  // What is drawn.\n// those of before\nconst char* kText = \"Tiles that nobody reads, one behind the other.\";\n"
    long_page = "A page. " + "word " * 31 + "end. Short, it is.\n"
    broken += [wrong_prose(prose({path: text}), {}) for path, text in (
        ("gpu/a.h", translation), ("gpu/a.cpp", "// Null: no texture.\n"), ("gpu/a.def", 'K(a, "the cost for itself")\n'), ("bench/a.js", "// Of a tile.\n"),
        ("tests/a.py", '"""What a test does."""\n'), ("tests/a.sh", "# that of before\n"), ("docs/a.md", "- Those are read.\n"), ("docs/a.md", "A page says what it says.\n"))]
    broken.append(wrong_prose({}, {"docs/a.md": "# Head\n\n| a | b |\n\n" + long_page}))
    sound = [
        [] if with_generated("# Shading\n\n" + table + "\nText.\n", "effects", "# Effects\n\n" + table) == "# Shading\n\n" + table + "\nText.\n" else ["effects"],
        wrong_prose(prose({"gpu/a.h": "// Size of a tile.\n", "tests/a.cpp": 'f("http://what is read by nobody");\n',
                           "docs/a.md": "The key `what is` is read.\n```\nwhat is\n```\n# What would help?\n", "gpu/b.h": "// One.\n" * 500 + "// in hand\n"}), {"docs/a.md": "One. " * 40 + long_page}),
        wrong_includes("frontend/a.h", '#include "base/error.h"\n#include <vector>\n'), wrong_includes("baselines/a.h", '#include "gpu/device.h"\n'),
        loops_over_what_is_gone("a.cpp", 'for (const json& f : stats["frames"]) for (int k : (*all)["k"]) for (int j : all("x").values) a = f(x)["y"];'),
        missing_tests("- **case**: `Suite.Law`, `Case/Suite.Law/Pole_`", {"Suite.Law/0", "Case/Suite.Law/Pole_obb"}),
        wrong_invariants([(n, "a.h") for n in declared_invariants("// Invariants:\n//   PB1  One.\n//        PB2  Indented text.\n")], {"PB1"}),
        wrong_invariants([(n, "a.h") for n in ("PB1", "PB2")], cited_invariants("TEST(A, PB1PB2Full) {")),
        wrong_invariants([(n, "a.h") for n in ("SE1", "SE2")], cited_invariants("TEST(B, SE1AndSE2Hold)")),
        wrong_citation(citation, "1.0.0"), wrong_changelog("# Changes\n\n## 1.0.0 (2026-01-01)\n\n## 0.9.0 (2025-01-01)\n", "1.0.0"),
        wrong_container(container, launcher, readme),
        retired_words("a.md", 'member `pictures`\n```json\n"a picture"\n```\n', phrases),
    ]
    for text in ('study["pictures"]', "stroke-width: 2", "tessera_embree_rival", "binner.tile_queue", "pictured"):
        sound.append(retired_words("a.js", text, phrases))
    return [f"twin {k} is not caught" for k, caught in enumerate(broken) if not caught] + [
        f"a sound text is complained about: {caught}" for caught in sound if caught]


def badly_formatted():
    """Other versions of clang-format break lines elsewhere."""
    def complaints(arguments, **options):
        done = subprocess.run(["clang-format", "--dry-run", "--Werror", "--ferror-limit=1", "--style=file", *arguments],
                              cwd=ROOT, capture_output=True, text=True, **options)
        return done.stderr.splitlines() if done.returncode else []

    try:
        version = subprocess.run(["clang-format", "--version"], capture_output=True, text=True).stdout
    except FileNotFoundError:
        version = ""
    if "version 14." not in version:
        print("skipped: no clang-format 14")
        return []
    wrong = complaints(sorted(sources(project_files())))
    if not complaints(["--assume-filename=a.cpp"], input="int  main( ){return 0;}\n"):
        wrong.append("the twin, a source that is not formatted, is not caught")
    return wrong + ["fixed by: clang-format -i FILE"] * bool(wrong)


def all_complaints(program, tests):
    files, phrases = project_files(), retired_phrases()
    wrong = twins(phrases) + wrong_names_at_the_top(os.listdir(ROOT))
    for path, text in sources(files).items():
        wrong += wrong_includes(path, text) + too_long(path, text) + loops_over_what_is_gone(path, text)
    for path, text in documents(files).items():
        wrong += broken_links(path, text)
    for path, text in files.items():
        if path != "tests/project/lint.py":
            wrong += retired_words(path, text, phrases)
    for unit, path in UNITS.items():
        wrong += unit_not_found(unit, path, files)
    wrong += [f"{folder} has no README.md" for folder in WITH_README if f"{folder}/README.md" not in files]
    wrong += wrong_prose(prose(files), hand_written(files))
    wrong += repeated_programs(files["README.md"], files)
    version = project_version(files["CMakeLists.txt"])
    wrong += wrong_citation((ROOT / "CITATION.cff").read_text(), version) + wrong_changelog(files["CHANGELOG.md"], version)
    wrong += wrong_container((ROOT / "Containerfile").read_text(), (ROOT / "tessera").read_text(), files["README.md"])
    declarations = [(number, path) for path, text in files.items() if path.endswith(".h") or path == "docs/architecture.md"
                    for number in declared_invariants(text)]
    cited = set().union(*(cited_invariants(text) for path, text in files.items() if path.startswith("tests/") and path.endswith(".cpp")))
    wrong += wrong_invariants(declarations, cited)
    # A rule that looks at nothing holds for ever.
    functions = sum(len(function_lengths(text)) for text in sources(files).values())
    if not (len(declarations) > 100 and functions > 2000 and {"M1", "M6", "PB1", "LRU1"} <= {number for number, _ in declarations}):
        wrong.append(f"only {len(declarations)} invariants and {functions} functions were found")
    if program:
        wrong += stale_pages(program) + wrong_extensions(program)
    if tests:
        # Some tests run together, as one entry of ctest.
        names = listed_tests(tests) | {f"{suite}.{law}" for path, text in files.items() if path.startswith("tests/")
                                       for suite, law in re.findall(r"^TEST(?:_F)?\((\w+), (\w+)\)", text, re.M)}
        page = files["docs/hard_cases.md"]
        # Fuzz targets are tests of builds that have a sanitized one beside them, as ./tessera test makes it.
        fuzzed = any(name.startswith("fuzz: ") for name in names)
        wrong += [complaint for complaint in missing_tests(page, names) if fuzzed or "fuzz: " not in complaint]
        suites = {name.split(".")[0].split("/")[-1] for name in names}
        if program:
            wrong += [f"docs/formats.md: {row['name']} is tested by {row['test']}, which is not there"
                      for row in json.loads(described(program, "formats", "--json")) if row["test"] not in suites]
        if len(names) < 100 or page.count("\n- **") < 50:
            wrong.append(f"only {len(names)} tests or {page.count(chr(10) + '- **')} cases were found")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--tests", nargs="+")
    parser.add_argument("--format", action="store_true")
    parser.add_argument("--prose", action="store_true")
    arguments = parser.parse_args()
    if arguments.write:
        write_pages(arguments.program)
    if arguments.prose:
        return list_prose(project_files())
    wrong = badly_formatted() if arguments.format else all_complaints(arguments.program, arguments.tests)
    print("\n".join(wrong))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
