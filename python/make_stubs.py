#!/usr/bin/python3
"""Prints tessera/__init__.pyi: the class stubs below, and the keys of the built module.

    PYTHONPATH=build/release/python python3 -P python/make_stubs.py > python/tessera/__init__.pyi
"""

import tessera

HEAD = '''# Made by python/make_stubs.py; do not edit.
import os
from collections.abc import Mapping
from typing import Any, Literal, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

__version__: str

class Error(RuntimeError): ...
class InputError(Error): ...
class LimitError(Error): ...
class UsageError(Error): ...
class SystemError(Error): ...
class WriteError(SystemError): ...

Value = bool | int | float | str
Eye = Literal["left", "right"]
'''

CLASSES = '''
class Scene:
    def __init__(
        self, file: str | os.PathLike[str], *, max_bytes: int = 4294967296, max_file_bytes: int = 2147483648,
        strict: bool = False, variant: str | None = None, scene: str | int | None = None,
        camera: str | int | None = None, animation: str | int | None = None, orbit: str | float | None = None,
        lens: str | float | None = None, shutter: str | None = None,
    ) -> None: ...
    @property
    def file(self) -> str: ...
    @property
    def width(self) -> int: ...
    @property
    def height(self) -> int: ...
    @property
    def frame_rate(self) -> float: ...
    @property
    def frames(self) -> range: ...
    @property
    def variants(self) -> list[str]: ...
    @property
    def shadows(self) -> list[dict[str, Any]]: ...
    @property
    def passes(self) -> list[str]: ...
    @property
    def notices(self) -> list[str]: ...

class Gpu:
    def __init__(self, machine: str | Mapping[str, Any] | Gpu | None = "mid-mobile", **keys: Unpack[GpuKeys]) -> None: ...
    @staticmethod
    def from_json(text: str) -> Gpu: ...
    @staticmethod
    def presets() -> list[str]: ...
    def set(self, key: str, value: Value) -> None: ...
    def get(self, key: str) -> Value: ...
    def __setitem__(self, key: str, value: Value) -> None: ...
    def __getitem__(self, key: str) -> Value: ...
    def json(self) -> str: ...

class Settings:
    def __init__(self, values: Mapping[str, Any] | Settings | None = None, **keys: Unpack[SettingsKeys]) -> None: ...
    def set(self, key: str, value: Value) -> None: ...
    def get(self, key: str) -> Value: ...
    def __setitem__(self, key: str, value: Value) -> None: ...
    def __getitem__(self, key: str) -> Value: ...
    def json(self) -> str: ...

class Device:
    def __init__(
        self,
        scene: Scene,
        gpu: str | Mapping[str, Any] | Gpu | None = None,
        settings: Mapping[str, Any] | Settings | None = None,
        *,
        width: int = 0,
        height: int = 0,
        region: tuple[int, int, int, int] | None = None,
        auxiliary: bool = False,
        resolve_auxiliary: bool = False,
        max_image_bytes: int = 4294967296,
        **keys: Unpack[SettingsKeys],
    ) -> None: ...
    def render(self, frame: int) -> Frame: ...
    @property
    def automatic_camera(self) -> bool: ...

class FramePass(TypedDict):
    name: str
    begin_cycles: float
    end_cycles: float
    counters: dict[str, int]
    traffic: list[dict[str, Any]]

class FrameTiming(TypedDict):
    cycles: float
    latency_cycles: float
    busy_cycles: dict[str, float]
    bound_by: str
    bound_by_cycles: float

class FrameEnergy(TypedDict):
    total_nj: float
    by_unit_nj: dict[str, float]

class MachineArea(TypedDict):
    total_mm2: float
    by_unit_mm2: dict[str, float]

class Frame:
    @property
    def number(self) -> int: ...
    @property
    def has_right_eye(self) -> bool: ...
    @property
    def layers(self) -> list[str]: ...
    def image(self, layer: str = "color", eye: Eye = "left") -> NDArray[np.float32]: ...
    def display(self, eye: Eye = "left") -> NDArray[np.uint8]: ...
    def patches(self, eye: Eye = "left") -> NDArray[np.uint32]: ...
    @property
    def counters(self) -> dict[str, int]: ...
    @property
    def traffic(self) -> list[dict[str, Any]]: ...
    @property
    def passes(self) -> list[FramePass]: ...
    @property
    def timing(self) -> FrameTiming | None: ...
    @property
    def energy(self) -> FrameEnergy | None: ...
    @property
    def area(self) -> MachineArea | None: ...
    @property
    def tile_maps(self) -> dict[str, NDArray[np.uint64]]: ...
    @property
    def tile_map_descriptions(self) -> list[dict[str, str]]: ...
    @property
    def tiles(self) -> list[dict[str, int]]: ...
    @property
    def drawables(self) -> list[dict[str, Any]]: ...
    @property
    def effects(self) -> dict[str, bool]: ...
    @property
    def host_seconds(self) -> float: ...
    @property
    def stage_seconds(self) -> dict[str, float]: ...

def gpu_keys() -> list[dict[str, Any]]: ...
def settings_keys() -> list[dict[str, Any]]: ...
def counter_descriptions() -> list[dict[str, str]]: ...
def simd_target() -> str: ...
'''


def type_of(row):
    if row["choices"]:
        return "Literal[" + ", ".join(f'"{choice}"' for choice in row["choices"]) + "]"
    return {"integer": "int", "number": "float", "boolean": "bool"}.get(row["type"], "str")


def range_of(row):
    if row["type"] not in ("integer", "number"):
        return ""
    return f"{row['min']:g} to {row['max']:g}{' ' + row['unit'] if row['unit'] else ''}. "


def keys_class(name, rows):
    lines = [f"class {name}(TypedDict, total=False):"]
    for row in rows:
        lines.append(f"    {row['key'].replace('.', '__')}: {type_of(row)}  # {range_of(row)}{row['meaning']}")
    return "\n".join(lines) + "\n"


def stubs():
    return "\n".join(
        [
            HEAD,
            keys_class("GpuKeys", tessera.gpu_keys()),
            keys_class("SettingsKeys", tessera.settings_keys()) + CLASSES,
        ]
    )


if __name__ == "__main__":
    print(stubs(), end="")
