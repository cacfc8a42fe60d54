"""Lights, cameras and whole scenes as TOML files."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from dermis.assets.head import Head, load_head
from dermis.errors import DermisError, refuse
from dermis.scene.camera import PRESETS, Camera, preset
from dermis.scene.lights import DirectionalLight, Light, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.scene.plain import explain
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

Lights = tuple[PointLight | SpotLight | DirectionalLight, ...]
_LIGHTS: TypeAdapter[Lights] = TypeAdapter(tuple[Light, ...], config=ConfigDict(frozen=True))
_PARTS = {"head", "skin", "lights", "camera", "render"}
_PATHS = ("colour", "normal", "height", "specular", "roughness")


def preset_lights(name: str) -> Lights:
    """The lights of a preset of the package."""
    text = (resources.files("dermis.scene") / "presets" / f"{name}.toml").read_text(encoding="utf-8")
    return _lights(f"preset {name}", tomllib.loads(text).get("lights"))


def load_lights(name: str) -> Lights:
    """The lights of a preset ("studio") or of a TOML file with [[lights]] tables."""
    folder = resources.files("dermis.scene") / "presets"
    known = sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )
    if name in known:
        return preset_lights(name)
    return _lights(name, _read(Path(name), f"a preset ({', '.join(known)}) or a TOML file").get("lights"))


def load_camera(name: str, head: Head) -> Camera:
    """A camera preset for the head, or the [camera] table of a TOML file."""
    if name in PRESETS:
        return preset(name, head)
    table = _read(Path(name), f"a preset ({', '.join(PRESETS)}) or a TOML file").get("camera")
    return _camera(name, table, head)


def load_scene(path: Path) -> tuple[Scene, Settings]:
    """Scene and settings of a TOML file; what it leaves out keeps its default.

    Tables: [head] (file or sample under `name`, and the options of `load_head`), [skin], [[lights]] or
    lights = "preset", [camera] or camera = "preset", [render]. File names are relative to the scene's folder.
    """
    table = _read(path, "a scene in TOML")
    for part in table.keys() - _PARTS:
        refuse(
            f"{path}: {part}",
            f"only the parts {', '.join(sorted(_PARTS))}",
            "this one is unknown",
            "Check it",
        )
    head = _head(path, table.get("head"))
    lights = table.get("lights", "studio")
    return Scene(
        head,
        lights=load_lights(lights) if isinstance(lights, str) else _lights(str(path), lights),
        camera=_camera(str(path), table.get("camera", "portrait"), head),
        skin=_made(Skin, path, "skin", table),
    ), _made(Settings, path, "render", table)


def _head(path: Path, table: Any) -> Head:
    if not isinstance(table, dict) or not isinstance(table.get("name"), str):
        refuse(
            f"{path}: head",
            "a table with the head's `name`",
            f"{table!r} came",
            'Write [head] and name = "..."',
        )
    options = {key: value for key, value in table.items() if key != "name"}
    for key in _PATHS:
        if isinstance(options.get(key), str):
            options[key] = path.parent / options[key]
    beside = path.parent / table["name"]
    try:
        return load_head(str(beside) if beside.exists() else table["name"], **options)
    except TypeError as error:
        raise DermisError(f"{path}: head: {error}. See the options of dermis.load_head.") from None


def _made(kind: Any, path: Path, part: str, table: dict[str, Any]) -> Any:
    values = table.get(part, {})
    if not isinstance(values, dict):
        refuse(f"{path}: {part}", "a table", f"{values!r} came", f"Write [{part}]")
    try:
        return kind(**values)
    except DermisError as error:
        raise DermisError(f"{path}: {error}") from None


def _lights(culprit: str, tables: Any) -> Lights:
    if not isinstance(tables, list) or not tables:
        refuse(
            culprit,
            "at least one [[lights]] table",
            "none came",
            "Add one with kind, position and irradiance",
        )
    try:
        return _LIGHTS.validate_python(
            tuple({"kind": "point", **t} if isinstance(t, dict) else t for t in tables)
        )
    except ValidationError as error:
        raise DermisError(explain(f"{culprit}: lights", error)) from None


def _camera(culprit: str, value: Any, head: Head) -> Camera:
    if isinstance(value, str):
        return preset(value, head)
    if not isinstance(value, dict):
        refuse(culprit, "a [camera] table", f"{value!r} came", "Add one with position, target and frame_mm")
    try:
        return Camera(**value)
    except DermisError as error:
        raise DermisError(f"{culprit}: {error}") from None


def _read(path: Path, expected: str) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise DermisError(
            f"{path}: expected {expected}, but {error}. Check the name and the file."
        ) from error
