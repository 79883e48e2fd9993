"""Contract of the Python module beyond the library: arrays without copies, tables, exceptions, threads."""

import ast
import inspect
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import zlib

import numpy as np
import tessera

CAPTURE, PROGRAM = sys.argv.pop(1), sys.argv.pop(1)


def device(**keys):
    return tessera.Device(tessera.Scene(CAPTURE), "small", width=96, height=54, **keys)


def png_pixels(file):
    """Of an RGB image with 8 bits a channel."""
    data, at, packed = pathlib.Path(file).read_bytes(), 8, b""
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        chunk = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height = int.from_bytes(chunk[:4], "big"), int.from_bytes(chunk[4:8], "big")
            assert chunk[8:] == bytes([8, 2, 0, 0, 0])
        packed += chunk if kind == b"IDAT" else b""
        at += length + 12
    rows = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 3 * width).astype(int)
    pixels = np.zeros((height + 1, width + 1, 3), int)  # with a border above and to the left
    for y, row in enumerate(rows, 1):
        for x, value in enumerate(row[1:].reshape(width, 3), 1):
            left, up, corner = pixels[y, x - 1], pixels[y - 1, x], pixels[y - 1, x - 1]
            if row[0] == 4:
                to = [abs(left + up - corner - near) for near in (left, up, corner)]
                best = np.where((to[0] <= to[1]) & (to[0] <= to[2]), left, np.where(to[1] <= to[2], up, corner))
            else:
                best = (0, left, up, (left + up) // 2)[row[0]]
            pixels[y, x] = (value + best) % 256
    return pixels[1:, 1:].astype(np.uint8)


class Keys(unittest.TestCase):
    def test_dots_underscores_groups_and_presets_are_the_same(self):
        expected = tessera.Gpu("small")
        expected["tile.width"] = 64
        for gpu in (
            tessera.Gpu("small", tile__width=64),
            tessera.Gpu("small", **{"tile.width": np.int64(64)}),
            tessera.Gpu({"preset": "small", "tile": {"width": 64}}),
            tessera.Gpu({"preset": "small", "tile.width": "64"}),
            tessera.Gpu.from_json('{"preset": "small", "tile": {"width": 64}}'),
            tessera.Gpu(expected),
        ):
            self.assertEqual(gpu.json(), expected.json())
            self.assertEqual(gpu["tile.width"], 64)

    def test_every_key_takes_its_default(self):
        for rows, machine in ((tessera.gpu_keys(), tessera.Gpu()), (tessera.settings_keys(), tessera.Settings())):
            before = machine.json()
            for row in rows:
                self.assertEqual(machine[row["key"]], row["default"], row["key"])
                machine[row["key"]] = row["default"]
            self.assertEqual(machine.json(), before)

    def test_documentation_names_every_key(self):
        for rows, kind in ((tessera.gpu_keys(), tessera.Gpu), (tessera.settings_keys(), tessera.Settings)):
            for row in rows:
                self.assertIn(f"  {row['key']}: {row['meaning']}\n", kind.__doc__)


class Errors(unittest.TestCase):
    def test_have_the_names_of_the_library(self):
        self.assertTrue(issubclass(tessera.WriteError, tessera.SystemError))
        for kind in (tessera.InputError, tessera.LimitError, tessera.UsageError, tessera.SystemError):
            self.assertTrue(issubclass(kind, tessera.Error))
        self.assertEqual(f"{tessera.InputError.__module__}.{tessera.InputError.__name__}", "tessera.InputError")

    def test_say_what_is_wrong(self):
        with self.assertRaisesRegex(tessera.UsageError, "did you mean 'tile.width'"):
            tessera.Gpu(tile__widht=16)
        with self.assertRaises(tessera.UsageError):
            tessera.Gpu("huge")
        with self.assertRaises(tessera.InputError):
            tessera.Gpu.from_json("{")
        with self.assertRaises(tessera.Error):
            tessera.Scene("missing.glb")
        with self.assertRaises(tessera.LimitError):
            tessera.Scene(CAPTURE, max_bytes=1000)
        with self.assertRaisesRegex(tessera.UsageError, "no variant 'gold' in .*, which has none"):
            tessera.Scene(CAPTURE, variant="gold")
        self.assertEqual(tessera.Scene(CAPTURE).variants, [])
        self.assertEqual(tessera.Scene(CAPTURE).shadows, [])
        self.assertEqual(tessera.Scene(CAPTURE).passes, [])
        with self.assertRaises(tessera.UsageError):
            device(region=(0, 0, 97, 1))
        with self.assertRaises(TypeError):
            tessera.Gpu(tile__width=[16])


class Views(unittest.TestCase):
    @staticmethod
    def of_module(**choices):
        return tessera.Device(tessera.Scene(CAPTURE, **choices), width=72, height=50).render(14).display()

    @staticmethod
    def of_program(**choices):
        with tempfile.TemporaryDirectory() as out:
            words = [word for name, value in choices.items() for word in (f"--{name}", str(value))]
            replay = [PROGRAM, "replay", CAPTURE, "--size", "72x50", "--frames", "14:15", "--quiet", "--no-report"]
            subprocess.run([*replay, "--out", out, *words], check=True)
            return png_pixels(pathlib.Path(out, "frame_0014.png"))

    def test_frames_are_those_of_the_command_line_with_the_same_choices(self):
        usual = self.of_module()
        for same in ({}, {"camera": 0, "scene": 0}):
            np.testing.assert_array_equal(self.of_module(**same), usual)
            np.testing.assert_array_equal(self.of_program(**same), usual)
        for choices in (
            {"camera": "auto"},
            {"animation": "none"},
            {"orbit": 75, "shutter": "0:0"},
            {"orbit": "-20.5:60", "lens": 0.5},
            {"lens": "0.3:1"},
            {"shutter": "0:1"},
        ):
            frame = self.of_module(**choices)
            self.assertFalse(np.array_equal(frame, usual), choices)
            np.testing.assert_array_equal(frame, self.of_program(**choices), str(choices))

    def test_what_the_file_lacks_is_refused_with_what_it_has(self):
        for choices, said in (
            ({"camera": "fra"}, "no camera 'fra' in .*, which has 0"),
            ({"animation": 99}, "no animation '99' in .*, which has 0"),
            ({"scene": "third"}, "no scene 'third' in .*, which has "),
            ({"orbit": 361}, "--orbit 361: expected DEGREES"),
            ({"camera": 0, "orbit": 40}, "--camera auto"),
        ):
            with self.assertRaisesRegex(tessera.UsageError, said):
                tessera.Scene(CAPTURE, **choices)
        with self.assertRaises(TypeError):
            tessera.Scene(CAPTURE, shutter=(0, 1))


class Frames(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.frame = device(auxiliary=True).render(14)

    def test_arrays_are_views_that_keep_the_frame(self):
        for make in (lambda f: f.image(), lambda f: f.display(), lambda f: f.tile_maps["entries"], lambda f: f.patches()):
            frame = device(auxiliary=True).render(14)
            array, again = make(frame), make(frame)
            self.assertTrue(np.shares_memory(array, again))
            self.assertFalse(array.flags.writeable or array.flags.owndata)
            expected = array.copy()
            del frame, again
            np.testing.assert_array_equal(array, expected)

    def test_images_have_the_shape_of_the_frame(self):
        frame = self.frame
        self.assertEqual((frame.image().shape, frame.image().dtype), ((54, 96, 4), np.float32))
        self.assertEqual((frame.display().shape, frame.display().dtype), ((54, 96, 3), np.uint8))
        self.assertEqual((frame.image("depth").shape, frame.patches().dtype), ((54, 96), np.uint32))
        self.assertEqual(frame.layers, ["color", "depth", "normal", "invocations"])
        self.assertGreater(int(frame.display().max()), 100)

    def test_tile_maps_add_up_to_their_counters(self):
        sums = 0
        for row in self.frame.tile_map_descriptions:
            if row["counter"] in self.frame.counters:
                self.assertEqual(int(self.frame.tile_maps[row["name"]].sum()), self.frame.counters[row["counter"]], row)
                sums += 1
        self.assertGreater(sums, 5)
        tiles = self.frame.tiles
        self.assertEqual(sum(tile["triangles"] for tile in tiles), int(self.frame.tile_maps["triangles"].sum()))
        self.assertEqual([tile["y"] for tile in tiles], sorted(tile["y"] for tile in tiles))

    def test_traffic_timing_and_energy_add_up(self):
        frame = self.frame
        self.assertEqual(sum(row["read_bytes"] for row in frame.traffic), frame.counters["dram.read_bytes"])
        self.assertEqual([one["name"] for one in frame.passes], ["main"])
        self.assertEqual(frame.passes[0]["counters"], frame.counters)
        self.assertAlmostEqual(sum(frame.energy["by_unit_nj"].values()) / frame.energy["total_nj"], 1)
        others = {"latency", "l2", "caches", "tile_memory", "geometry", "tilecores", "imbalance"}
        self.assertIn(frame.timing["bound_by"], set(frame.timing["busy_cycles"]) | others)
        self.assertEqual(frame.timing["latency_cycles"], frame.timing["cycles"])
        self.assertAlmostEqual(sum(frame.area["by_unit_mm2"].values()) / frame.area["total_mm2"], 1)
        bare = device(output__machine_model=False).render(14)
        self.assertEqual((bare.timing, bare.energy, bare.area), (None, None, None))

    def test_latency_and_area_are_those_of_the_machine(self):
        def render(**keys):
            return tessera.Device(tessera.Scene(CAPTURE), tessera.Gpu(**keys), width=96, height=54).render(14)

        frame, four = render(machine__overlap="frames", tilecore__count=8), render(tilecore__count=4)
        self.assertEqual(frame.timing["latency_cycles"], 2 * frame.timing["cycles"])
        self.assertEqual(frame.area["by_unit_mm2"]["l2"], four.area["by_unit_mm2"]["l2"])
        self.assertAlmostEqual(frame.area["by_unit_mm2"]["lanes"], 2 * four.area["by_unit_mm2"]["lanes"])

    def test_counters_are_described(self):
        self.assertLessEqual(set(self.frame.counters), {row["name"] for row in tessera.counter_descriptions()})


class Threads(unittest.TestCase):
    def test_python_goes_on_while_a_frame_renders(self):
        large = tessera.Device(tessera.Scene(CAPTURE), width=1280, height=720)
        done = threading.Event()
        thread = threading.Thread(target=lambda: (large.render(14), done.set()))
        thread.start()
        turns = 0
        while not done.is_set():
            turns += 1
            time.sleep(0.001)
        thread.join()
        self.assertGreater(turns, 3)

    def test_calls_on_one_device_wait_for_each_other(self):
        shared, frames = device(), []
        threads = [threading.Thread(target=lambda: frames.append(shared.render(14).counters)) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(frames, [device().render(14).counters] * 4)


    def test_an_interrupt_is_raised_when_the_frame_is_done(self):
        large = tessera.Device(tessera.Scene(CAPTURE), width=1280, height=720)
        timer = threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGINT))
        with self.assertRaises(KeyboardInterrupt):
            timer.start()
            while True:
                large.render(14)
        self.assertEqual(large.render(14).number, 14)


class Stubs(unittest.TestCase):
    def test_name_every_member(self):
        tree = ast.parse((pathlib.Path(tessera.__file__).parent / "__init__.pyi").read_text())
        stubs = {node.name: node for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        for name, member in vars(tessera).items():
            if name.startswith("_"):
                continue
            self.assertIn(name, stubs)
            if inspect.isclass(member) and not issubclass(member, Exception):
                declared = {node.name for node in stubs[name].body if isinstance(node, ast.FunctionDef)}
                there = {key for key in vars(member) if not key.startswith("_")} | ({"__init__"} & declared)
                self.assertEqual({key for key in declared if key not in ("__getitem__", "__setitem__")}, there, name)


if __name__ == "__main__":
    unittest.main()
