#!/usr/bin/env python3
"""Costs of the machine's shaders on the gfx1030 ISA (RDNA2), from the compiler's own output.

make_costs.py [--clang FILE] [--only REGEX] [--list] > hardware/shader_costs.csv
make_costs.py --whole 'surface=patch base_color=1 lights=2' ...   prints the cost of whole shaders, each compiled at once

gpu_shaders.h instantiates the text that the machine runs (lane_shader.inc and the stages of shaders_cpp/) for each set
of features. Every shader compiles to straight-line code, which is checked, so that what is counted is what is executed.
A row `add/...` is a whole shader with a feature less the same without it.
"""

import argparse
import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile

FOLDER = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(FOLDER)))

# Fast mathematics as drivers compile shaders: division by reciprocal, fused where possible, no denormal numbers. The
# limits let the compiler look through all of a shader at once.
LIMITS = ["-mllvm", "-memdep-block-scan-limit=100000", "-mllvm", "-memssa-check-limit=100000"]
TARGET = ["--target=amdgcn-amd-amdpal", "-mcpu=gfx1030", "-O2", "-nogpulib"] + LIMITS
FLAGS = TARGET + ["-std=c++20", "-ffast-math", "-ffp-contract=fast", "-fno-exceptions", "-fno-rtti", "-D__x86_64__",
                  "-D__LP64__", "-DGLM_FORCE_CTOR_INIT", "-Xclang",
                  "-fdenormal-fp-math-f32=preserve-sign,preserve-sign", "-mllvm", "-inline-threshold=1000000", "-mllvm",
                  "-earlycse-mssa-optimization-cap=100000"]
COUNTS = ["vector_operations", "transcendental", "scalar", "texture_instructions", "memory", "registers"]
# At a quarter of the rate: transcendental ones and whole multiplications of 32 bits.
QUARTER_RATE = re.compile(r"v_(exp|log|rcp|rsq|sqrt|sin|cos)_f32|v_rcp_iflag_f32|v_mul_(lo|hi)_[ui]32|v_mad_[ui]64_[ui]32")
NO_WORK = {"s_waitcnt", "s_nop", "s_clause", "s_inst_prefetch", "s_endpgm", "s_code_end", "s_waitcnt_depctr"}

SURFACES = {"triangles": "Surface::kTriangles", "patch": "Surface::kPatch",
            "displaced_patch": "Surface::kDisplacedPatch", "computed": "Surface::kComputed"}
MOTIONS = {"still": "Motion::kStill", "moving": "Motion::kMoving", "deforming": "Motion::kDeforming"}
NORMALS = {"of_surface": "Normals::kOfSurface", "mapped": "Normals::kMapped",
           "along_tangents": "Normals::kMappedAlongTangents"}
LIGHTS = {"directional": "LightKind::kDirectional", "point": "LightKind::kPoint",
          "point_in_range": "LightKind::kPointInRange", "spot": "LightKind::kSpot",
          "spot_in_range": "LightKind::kSpotInRange"}
SHADOW_FILTERS = {"nearest": "ShadowFilter::kNearest", "2x2": "ShadowFilter::k2x2", "3x3": "ShadowFilter::k3x3"}
ENUMS = {"surface": SURFACES, "motion": MOTIONS, "normals": NORMALS, "light": LIGHTS, "shadow_filter": SHADOW_FILTERS}


def read_layers():
    """The effects of material_extensions.def, and the effects that each of them needs."""
    with open(os.path.join(ROOT, "scene", "material_extensions.def")) as file:
        rows = re.findall(r"^EFFECT\((\w+), (\w+),(.*?)\nEXTENSION", file.read(), re.M | re.S)
    members = {name: member for name, member, _ in rows}
    needed = {member: rest.rsplit(",", 1)[1].split("||")[0] for _, member, rest in rows}
    return {member: [members[other] for other in re.findall(r"(?<!!)has\(k(\w+)\)", condition)]
            for member, condition in needed.items()}


LAYERS = read_layers()
FIELDS = ["surface", "motion", "quads", "unlit", "colors", "base_color", "metallic_roughness", "occlusion", "emissive",
          "normals", "lights", "light", "light_moves", "apart", "layered", "layer_texture", "coat_normals"] + list(LAYERS) + [
              "environment_image", "height_normals", "shadows", "shadow_layers", "shadow_filter", "packed"]
NUMBERS = {"lights", "shadows", "shadow_layers"}


class Shader:
    """A stage and its features, as gpu_shaders.h has them."""

    def __init__(self, stage="pixel", **features):
        self.stage = "computed" if features.get("surface") == "computed" and stage == "pixel" else stage
        self.features = features

    def but(self, **features):
        return Shader(self.stage, **{**self.features, **features})

    def source(self, name):
        assert all(f in FIELDS for f in self.features), self.features
        values = []
        for field in FIELDS:
            if field not in self.features:
                continue
            value = self.features[field]
            text = ENUMS[field][value] if field in ENUMS else str(int(value)) if field in NUMBERS else \
                ("true" if value else "false")
            values.append(f".{field} = {text}")
        stage = {"pixel": "pixel_shader", "computed": "computed_shader", "alpha": "alpha_test",
                 "domain": "domain_shader", "background": "background_shader",
                 "outputs": "outputs_shader", "fill": "fill_shader", "light": "light_shader"}[self.stage]
        return f"TESSERA_SHADER({name}, {stage}, {', '.join(values)})\n"

    def key(self):
        return self.source("")


def kinds_of_motion(surface):
    return ["still", "moving", "deforming"] if "patch" in surface else ["still", "moving"]


def rows():
    """(name, shaders that are added up, shaders that are taken away), in the order of the table."""
    all_rows = []

    def whole(name, shader):
        all_rows.append((name, [shader], []))

    def added(name, with_it, without):
        all_rows.append(("add/" + name, [with_it], [without]))

    derivatives = {"quads": True, "surface": False}
    drawn = [s for s in SURFACES if s != "computed"]
    whole("unlit", Shader(unlit=True))
    for surface in SURFACES:
        for motion in kinds_of_motion(surface):
            whole(f"lit/{surface}/{motion}", Shader(surface=surface, motion=motion))
    # The cost of a first texture beyond one more at the same coordinate: the coordinate and its derivatives.
    for lit in (True, False):
        for surface in drawn:
            for motion in kinds_of_motion(surface):
                for name, quads in derivatives.items():
                    base = Shader(surface=surface, motion=motion, unlit=not lit)
                    added(f"coordinate/{'lit' if lit else 'unlit'}/{surface}/{motion}/{name}",
                          base.but(base_color=True, quads=quads), base)
    for slot in ("base_color", "metallic_roughness", "occlusion", "emissive"):
        for name, quads in derivatives.items():
            other = Shader(quads=quads, **{"emissive" if slot != "emissive" else "base_color": True})
            added(f"{slot}/{name}", other.but(**{slot: True}), other)
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            for normals in ("mapped", "along_tangents") if surface == "triangles" else ("mapped",):
                base = Shader(surface=surface, motion=motion, base_color=True, quads=True)
                added(f"normal/{surface}/{motion}/{normals}", base.but(normals=normals), base)
    for motion in kinds_of_motion("triangles"):
        for name, quads in derivatives.items():
            base = Shader(motion=motion, base_color=True, quads=quads)
            added(f"height_normals/{motion}/{name}", base.but(height_normals=True), base)
    for surface in ("triangles", "patch"):
        base = Shader(surface=surface)
        added(f"vertex_colors/{surface}", base.but(colors=True), base)
        for name, quads in derivatives.items():
            two = Shader(surface=surface, base_color=True, emissive=True, quads=quads)
            added(f"coordinate_apart/{surface}/{name}", two.but(apart=True), two)
    # The work that all lights share: the first light includes it, a second one does not.
    one = Shader(lights=1)
    all_rows.append(("add/lights", [one, one], [one.but(lights=0), one.but(lights=2)]))
    for light in LIGHTS:
        for name, moves in (("still", False), ("moving", True)):
            one = Shader(lights=1, light=light, light_moves=moves)
            added(f"light/{light}/{name}", one.but(lights=2), one)
    add_layers(all_rows, added, drawn)
    add_environment(all_rows, added)
    add_shadows(all_rows)
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            for name, quads in derivatives.items():
                whole(f"alpha_test/{surface}/{motion}/{name}",
                      Shader("alpha", surface=surface, motion=motion, base_color=True, quads=quads))
    for surface in drawn:
        for motion in MOTIONS:
            whole(f"domain/{surface}/{motion}", Shader("domain", surface=surface, motion=motion))
    add_outputs(whole, added)
    for motion in ("still", "moving"):
        for around, image in {"studio": False, "image": True}.items():
            whole(f"background/{around}/{motion}", Shader("background", motion=motion, environment_image=image))
    add_halves(all_rows, whole, added, drawn)
    return all_rows


def add_halves(all_rows, whole, added, drawn):
    """The halves of a shader with a G-buffer between them. The light half of the packed one sees no triangles."""
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            whole(f"fill/{surface}/{motion}", Shader("fill", surface=surface, motion=motion))
            whole(f"light/{surface}/{motion}", Shader("light", surface=surface, motion=motion))
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            # All that a fill half reads: more registers than any one of it, without the code of lights beside it.
            empty = Shader("fill", surface=surface, motion=motion)
            for name, quads in {"quads": True, "surface": False}.items():
                added(f"fill/textures/{surface}/{motion}/{name}",
                      empty.but(quads=quads, normals="mapped", colors=True, base_color=True, metallic_roughness=True,
                                occlusion=True, emissive=True), empty)
            # The first light that has a place: the point of the surface, which nothing else needs, and the light.
            dark = Shader("light", surface=surface, motion=motion)
            added(f"lights/light/{surface}/{motion}", dark.but(lights=1, light="point_in_range"), dark)
    for motion in ("still", "moving"):
        whole(f"light/packed/{motion}", Shader("light", motion=motion, packed=True))
    for name, quads in {"quads": True, "surface": False}.items():
        other = Shader("fill", quads=quads, emissive=True)
        added(f"fill/metallic_roughness/{name}", other.but(metallic_roughness=True), other)
    added("fill/packed", Shader("fill", packed=True), Shader("fill"))
    lit = Shader("light", packed=True, lights=1)
    other = Shader(lights=2)
    # The light half takes derivatives for shadows alone.
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            half = Shader("light", surface=surface, motion=motion, lights=1)
            receiver = other if motion == "still" else other.but(motion="moving")
            all_rows.append((f"add/shadows/light/{surface}/{motion}", [half.but(shadows=1), receiver.but(shadows=1)],
                             [half, receiver.but(shadows=2)]))
    all_rows.append(("add/shadows/packed", [lit.but(shadows=1), other.but(shadows=1)], [lit, other.but(shadows=2)]))


def add_layers(all_rows, added, drawn):
    """Costs that extensions of materials add once, and for each light."""
    plain, layered = Shader(), Shader(layered=True)

    def per_light(name, with_it, without):
        all_rows.append((f"add/layer_light/{name}", [with_it.but(lights=2), without.but(lights=1)],
                         [with_it.but(lights=1), without.but(lights=2)]))

    added("layer/base", layered, plain)
    per_light("base", layered, plain)
    for layer, needed in LAYERS.items():
        if layer in ("anisotropy", "clearcoat"):
            continue
        without = layered.but(**{other: True for other in needed})
        added(f"layer/{layer}", without.but(**{layer: True}), without)
        per_light(layer, without.but(**{layer: True}), without)
    # The work that a coat shares with the base: its normal if that is not mapped, and terms that a uniform roughness
    # fixes.
    for normals in ("of_surface", "mapped"):
        for name, textured in {"roughness_of_factor": False, "roughness_of_texture": True}.items():
            base = layered.but(base_color=True, quads=True, normals=normals, metallic_roughness=textured)
            added(f"layer/clearcoat/{normals}/{name}", base.but(clearcoat=True), base)
            per_light(f"clearcoat/{normals}/{name}", base.but(clearcoat=True), base)
    # Anisotropy along the texture coordinate or the attribute.
    for surface in drawn:
        for motion in kinds_of_motion(surface):
            for normals in ("of_surface", "mapped"):
                base = layered.but(surface=surface, motion=motion, base_color=True, quads=True, normals=normals)
                added(f"layer/anisotropy/{surface}/{motion}/{normals}", base.but(anisotropy=True), base)
    per_light("anisotropy", layered.but(base_color=True, quads=True, normals="mapped", anisotropy=True),
              layered.but(base_color=True, quads=True, normals="mapped"))
    for name, quads in {"quads": True, "surface": False}.items():
        coat = layered.but(base_color=True, quads=quads, clearcoat=True)
        added(f"layer_texture/{name}", coat.but(layer_texture=True), coat)


def add_outputs(whole, added):
    """Vertices of patches whose attributes pixels interpolate."""
    for surface in ("patch", "displaced_patch"):
        for motion in MOTIONS:
            whole(f"outputs/{surface}/{motion}", Shader("outputs", surface=surface, motion=motion))
    for motion in MOTIONS:
        whole(f"outputs_under_heights/displaced_patch/{motion}",
              Shader("outputs", surface="displaced_patch", motion=motion, height_normals=True))
    for motion in MOTIONS:
        base = Shader("outputs", surface="patch", motion=motion, base_color=True)
        added(f"outputs/tangent/{motion}", base.but(normals="mapped"), base)
    plain = Shader("outputs", surface="patch")
    added("outputs/coordinate", plain.but(base_color=True), plain)
    added("outputs/vertex_colors", plain.but(colors=True), plain)


def add_environment(all_rows, added):
    """Cost that an image of the environment adds: a lookup in place of the built-in one's arithmetic."""
    plain, textured = Shader(), Shader(quads=True, metallic_roughness=True)
    added("environment/roughness_of_factor", plain.but(environment_image=True), plain)
    added("environment/roughness_of_texture", textured.but(environment_image=True), textured)
    layered = Shader(layered=True)
    for layer in ("clearcoat", "diffuse_transmission"):
        with_it = layered.but(**{layer: True})
        all_rows.append((f"add/environment/{layer}", [with_it.but(environment_image=True), layered],
                         [with_it, layered.but(environment_image=True)]))


def add_shadows(all_rows):
    """Costs of lights that cast shadows: each by its projection, its filter and whether the surface moves; for a light with
    several maps the cost of the choice, and of each further map; and once for all of them the cost of the surface."""
    receivers = {"still": Shader(lights=2), "moving": Shader(lights=2, motion="moving")}
    for projection, light in {"orthographic": "directional", "perspective": "spot"}.items():
        for receiver, lit in receivers.items():
            for shadow_filter in SHADOW_FILTERS:
                cast = lit.but(light=light, shadow_filter=shadow_filter)
                all_rows.append((f"add/shadow/{projection}/{shadow_filter}/{receiver}", [cast.but(shadows=2)],
                                 [cast.but(shadows=1)]))
            one, two, three = (lit.but(lights=1, light=light, shadows=1, shadow_layers=n) for n in (1, 2, 3))
            all_rows.append((f"add/shadow_layers/{projection}/{receiver}", [two, two], [one, three]))
            all_rows.append((f"add/shadow_layer/{projection}/{receiver}", [three], [two]))
    for surface in SURFACES:
        for motion in kinds_of_motion(surface):
            lit = Shader(surface=surface, motion=motion, lights=1)
            other = receivers["still" if motion == "still" or surface == "computed" else "moving"]
            # If derivatives are the surface's own, the base has computed a part of this.
            names = {"": lit} if surface == "computed" else {"/quads": lit, "/surface": lit.but(base_color=True)}
            for name, base in names.items():
                all_rows.append((f"add/shadows/{surface}/{motion}{name}", [base.but(shadows=1), other.but(shadows=1)],
                                 [base, other.but(shadows=2)]))


def run(command, text=None):
    done = subprocess.run(command, input=text, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"make_costs.py: {' '.join(command)}\n{done.stderr}")
    return done.stdout


def system_folders(clang):
    """Folders of the host's C++ headers, of which shaders use the language's own."""
    done = subprocess.run([clang, "--target=x86_64-linux-gnu", "-E", "-x", "c++", "-v", "-"], input="",
                          capture_output=True, text=True)
    listed = done.stderr.split("#include <...> search starts here:")[1].split("End of search list.")[0]
    return [part for folder in listed.split("\n") if folder.strip() for part in ("-isystem", folder.strip())]


def as_pixel_shader(ir):
    """Gives functions the calling convention of pixel shaders: the first argument in scalar registers."""
    return re.sub(r"^define [^@]*(@shader_\d+)\(([^,]*addrspace\(4\)\*)[^,%]*(%[\w.]+)", r"define amdgpu_ps void \1(\2 inreg \3",
                  ir, flags=re.M)


def counted(assembly):
    """Counts of each function, by its number."""
    found, now = {}, None
    for line in assembly.split("\n"):
        if head := re.match(r"shader_(\d+):", line):
            now = found.setdefault(int(head[1]), dict.fromkeys(COUNTS, 0))
        elif now is not None and (registers := re.match(r"; NumVgprs: (\d+)", line)):
            now["registers"] = int(registers[1])
        elif now is not None and (memory := re.match(r"; ScratchSize: (\d+)", line)):
            if int(memory[1]) != 0:
                sys.exit("make_costs.py: a shader does not fit into registers")
            now = None
        elif now is not None and (instruction := re.match(r"\t([a-z]\w*)", line)):
            count(now, re.sub(r"_(e32|e64|sdwa|dpp)$", "", instruction[1]))
    return found


def count(counts, name):
    if re.match(r"s_(c?branch|setpc|swappc|call)", name):
        sys.exit(f"make_costs.py: {name}: code is not straight")
    if QUARTER_RATE.fullmatch(name):
        counts["transcendental"] += 1
    elif name.startswith("v_"):
        counts["vector_operations"] += 1
    elif name.startswith("s_"):
        counts["scalar"] += name not in NO_WORK
    elif name.startswith("image_"):
        counts["texture_instructions"] += 1
    elif re.match(r"(global|buffer|flat|ds|scratch)_", name):
        counts["memory"] += 1
    elif name != "exp":  # results leave through it
        sys.exit(f"make_costs.py: {name}: unknown")


def compiled(clang, folders, shaders):
    """Counts of each shader of a list."""
    source = '#include "tilecore/shading/cost/gpu_shaders.h"\nusing namespace tessera::gpu_cost;\n' + "".join(
        shader.source(f"shader_{i}") for i, shader in enumerate(shaders))
    ir = run([clang, "-x", "c++"] + FLAGS + folders + ["-I", ROOT, "-S", "-emit-llvm", "-o", "-", "-"], source)
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "shaders.ll")
        with open(file, "w") as to:
            to.write(as_pixel_shader(ir))
        assembly = run([clang, "-x", "ir"] + TARGET + ["-S", "-o", "-", file])
    found = counted(assembly)
    return [found[i] for i in range(len(shaders))]


def compile_all(clang, shaders):
    """Counts by key. Groups keep the compiler's memory small."""
    distinct = list({shader.key(): shader for shader in shaders}.values())
    folders = system_folders(clang)
    groups = [distinct[i:i + 6] for i in range(0, len(distinct), 6)]
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        done = list(pool.map(lambda group: compiled(clang, folders, group), groups))
    return {shader.key(): counts for group, results in zip(groups, done) for shader, counts in zip(group, results)}


def parsed(text):
    """A whole shader from `feature=value ...`."""
    features = {}
    for word in text.split():
        name, value = word.split("=")
        features[name] = value if name in ENUMS or name == "stage" else int(value)
    return Shader(features.pop("stage", "pixel"), **features)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clang", default="clang++")
    parser.add_argument("--only", default="", help="rows whose names match")
    parser.add_argument("--list", action="store_true", help="names of the rows")
    parser.add_argument("--whole", nargs="+", help="features of whole shaders")
    arguments = parser.parse_args()
    if arguments.whole:
        shaders = [parsed(text) for text in arguments.whole]
        table = [(text, [shader], []) for text, shader in zip(arguments.whole, shaders)]
    else:
        table = [row for row in rows() if re.search(arguments.only, row[0])]
    if arguments.list:
        print("\n".join(row[0] for row in table))
        return
    costs = compile_all(arguments.clang, [shader for row in table for shader in row[1] + row[2]])
    version = re.search(r"clang version \d+\.\d+\.\d+", run([arguments.clang, "--version"]))[0]
    print(f"# Made by tilecore/shading/cost/make_costs.py with {version}.")
    print(f"# Flags: {' '.join(FLAGS)}")
    print("shader," + ",".join(COUNTS))
    for name, plus, minus in table:
        numbers = [sum(costs[shader.key()][c] for shader in plus) - sum(costs[shader.key()][c] for shader in minus)
                   for c in COUNTS]
        print(name + "," + ",".join(map(str, numbers)))


main()
