"""Heads by name: the package's own, samples, and files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

from dermis.errors import notify, refuse
from dermis.human.regions.usual import with_usual_regions
from dermis.mesh.check import check_head_height
from dermis.mesh.formats import is_gltf
from dermis.mesh.gltf.pictures import embedded_maps
from dermis.mesh.head import Head
from dermis.mesh.load import load_rigged
from dermis.mesh.maps import Maps, load_maps
from dermis.mesh.obj_maps import obj_maps
from dermis.mesh.samples import SAMPLES, Sample, fetch
from dermis.mesh.subdivide import subdivide_head
from dermis.scene.head_table import AUTO, NormalY, Up, VOrigin

if TYPE_CHECKING:
    from dermis.human.person import Human

MapFile = str | os.PathLike[str] | None
HUMAN = "human"
_UNITS_MM = {"mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1000.0, "inch": 25.4, "in": 25.4, "ft": 304.8}
REPLACED = ("bust", "bust_many_charts")
"""Heads that the package had before `HUMAN`."""


def load_head(
    head: str | os.PathLike[str],
    *,
    colour: MapFile = None,
    normal: MapFile = None,
    height: MapFile = None,
    height_mm: float | None = None,
    specular: MapFile = None,
    roughness: MapFile = None,
    unit_mm: float | None = None,
    v_origin: VOrigin = "auto",
    up: Up = "y",
    normal_y: NormalY = "up",
    opaque: Sequence[str] | str = (),
    subdivide: int = 0,
    regions: Literal["auto", "none"] = "auto",
) -> Head:
    """The parametric human ("human"), a sample ("lee_perry_smith") or a file (.glb, .gltf, .obj, .ply).

    "human:7" is the person drawn by the seed 7, and a .json file of `dermis head` one by its numbers.

    Options replace what a sample, a glTF file or an OBJ file's .mtl has of its own. Morph targets and bones
    of a glTF file move the head (`Pose`); it rests as the file has it, at the default weights of its targets.

    colour, normal, height, specular, roughness : image files; see `load_maps`
    height_mm : relief of one grey level of an 8-bit height map [mm]
    unit_mm : length of the file's unit [mm]; metres for glTF and mm otherwise when left out
    v_origin : which row of the maps v = 0 is; the format's rule when "auto"
    up : the file's upward axis
    normal_y : way in which green points in the normal map: "up" (OpenGL) or "down" (DirectX)
    opaque : groups of the file that are not skin, whatever they are called
    subdivide : levels of subdivision, 0 to 3: Catmull-Clark for a file of quads, else Loop; the human has one
        at least
    regions : "auto" for gloss by region of the face where the package knows the head and no map says the
        roughness; "none" for one roughness all over

    Raises DermisError for files that cannot be rendered as a head; warns with DermisWarning of pictures of
    an .mtl that are left out.
    """
    opaque = (opaque,) if isinstance(opaque, str) else opaque
    name, path = _named(head), Path(head)
    own = {"colour": colour, "normal": normal, "height": height}
    own |= {"specular": specular, "roughness": roughness}
    _check_given(own, unit_mm=unit_mm, height_mm=height_mm)
    if name == HUMAN or name.startswith(f"{HUMAN}:") or path.suffix.lower() == ".json":
        told = {"unit_mm": unit_mm, "v_origin": v_origin, "up": up, "opaque": opaque}
        return _human(name, own, height_mm, normal_y, told, subdivide)
    sample, files = SAMPLES.get(name), dict[str, Any]()
    if sample is not None:
        _check_kind(sample)
        files = fetch(name)
        path = files["mesh"]
        unit_mm = sample.unit_mm if unit_mm is None else unit_mm
        v_origin = sample.v_origin or v_origin if v_origin == "auto" else v_origin
        height_mm = sample.height_mm if height_mm is None else height_mm
    elif not path.is_file():
        _refuse_name(name)
    elif is_gltf(path):
        files = embedded_maps(path)
    chosen = _chosen(own, files)
    if height is None and height_mm is None:
        height_mm = files.get("height_mm")
    obj = path if sample is None and path.suffix.lower() == ".obj" else None
    with ThreadPoolExecutor(1) as beside:
        reading = beside.submit(_read_maps, obj, chosen, tuple(opaque), height_mm, normal_y)
        rigged = load_rigged(path, unit_mm=unit_mm, v_origin=v_origin, up=up, opaque=tuple(opaque))
        check_head_height(rigged.mesh, name, unit_mm)
        maps, notice = reading.result()
    _check_height(height_mm, maps.height)
    if notice:
        notify(notice)
    thanks = f"{sample.attribution}, {sample.licence}" if sample else ""
    made = subdivide_head(Head(name, rigged.mesh, maps, thanks, rigged.rig), subdivide)
    if subdivide and made.rig is not None:  # sequences of files have places for the file's own vertices
        made = replace(made, rig=replace(made.rig, corner=rigged.mesh.point))
    return with_usual_regions(made) if regions == AUTO else made


def _read_maps(
    obj: Path | None,
    chosen: dict[str, Any],
    opaque: tuple[str, ...],
    height_mm: float | None,
    normal_y: NormalY,
) -> tuple[Maps, str]:
    """The maps that are given, and those that an OBJ file's materials name for other roles; a notice."""
    given = {role: file for role, file in chosen.items() if file is not None}
    loaded = load_maps(**given, height_mm=height_mm, normal_y=normal_y)
    if obj is None:
        return loaded, ""
    named, notice = obj_maps(obj, opaque=opaque, given=given, height_mm=height_mm, normal_y=normal_y)
    return replace(named, **{role: getattr(loaded, role) for role in given}), notice


def _named(head: object) -> str:
    """The name of what is to be loaded."""
    if not isinstance(head, str | os.PathLike):
        came = "None came" if head is None else f"a {type(head).__name__} came"
        remedy = "Use a head as it is; write human.head() for that of a Human"
        refuse("load_head", "the name of a head or a file", came, remedy)
    return str(head)


def _refuse_name(name: str) -> NoReturn:
    known = ", ".join(_head_names())
    if name in REPLACED:
        came = f"this mannequin was replaced by the parametric human, {HUMAN!r}"
        refuse(name, f"one of {known} or a mesh file", came, f"Write {HUMAN} instead")
    refuse(name or "head", f"a mesh file or a sample ({known})", f"{name!r} is neither", "Check the name")


def _check_given(files: dict[str, MapFile], **lengths: object) -> None:
    """Refuse words for lengths [mm], and pictures that are no files."""
    for name, value in lengths.items():
        if isinstance(value, str):
            known = value in _UNITS_MM
            remedy = f"Write {name}={_UNITS_MM[value]:g}" if known else "Write 10 for cm, 1000 for m"
            refuse(name, "a length in mm, as a number", f"{value!r} came", remedy)
    for role, file in files.items():
        if file is not None and not isinstance(file, str | os.PathLike):
            remedy = f"Write dataclasses.replace(head, maps=replace(head.maps, {role}=...)) for one in memory"
            refuse(role, "the name of a picture file", f"a {type(file).__name__} came", remedy)


def _check_height(height_mm: float | None, height: object) -> None:
    if height_mm is not None and height is None:
        came = f"{height_mm} came without a height map"
        refuse("height_mm", "a height map with it", came, "Give the map too, or leave height_mm out")


def _check_kind(sample: Sample) -> None:
    if sample.kind != "head":
        hint = f"Use one of {', '.join(_head_names())}"
        refuse(sample.name, "a head", f"this sample is an {sample.kind}", hint)


def _human(
    name: str,
    maps: dict[str, MapFile],
    height_mm: float | None,
    normal_y: NormalY,
    told: dict[str, Any],
    subdivide: int,
) -> Head:
    """The parametric human, in its own layout.

    name : "human", or with a seed: "human:7", or a file of numbers
    told : what is told of files alone
    """
    for option, usual in (("unit_mm", None), ("v_origin", "auto"), ("up", "y"), ("opaque", ())):
        if told[option] not in (usual, list(usual or ())):
            refuse(option, "a file that it tells of", f"it came with {HUMAN!r}", "Leave it out")
    _check_height(height_mm, maps["height"])
    given: dict[str, Any] = {role: file for role, file in maps.items() if file is not None}
    loaded = load_maps(**given, height_mm=height_mm, normal_y=normal_y) if given else None
    made = _person(name).head(subdivide=subdivide or 1)
    own = {role: getattr(loaded, role) for role in given}  # all others are painted
    return replace(made, name=name, maps=replace(made.maps, **own))


def _person(name: str) -> Human:
    from dermis.human.person import Human
    from dermis.human.person_file import read_person

    if name == HUMAN:
        return Human()
    if Path(name).suffix.lower() == ".json":
        return read_person(Path(name))
    words = name.partition(":")[2]
    if not words.isdecimal():
        refuse(name, f"{HUMAN}, or {HUMAN}:SEED with a whole number", f"{words!r} came", f"Try {HUMAN}:7")
    return Human.drawn(int(words))


def _chosen(given: dict[str, MapFile], files: dict[str, Any]) -> dict[str, Any]:
    """For each role the file given, else the head's own; a normal map that is given replaces its relief."""
    chosen = {role: files.get(role) if file is None else file for role, file in given.items()}
    return chosen | {"region": files.get("region")}


def _head_names() -> list[str]:
    return [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
