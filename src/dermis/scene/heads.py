"""Heads by name: the package's own, samples, and files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

from dermis.base.errors import format_value, notify, refuse
from dermis.base.pending_maps import is_file
from dermis.base.progress import logged_step
from dermis.formats.gltf.embedded import embedded_eye_look, embedded_maps
from dermis.formats.load import load_rigged
from dermis.formats.maps import load_maps
from dermis.formats.mesh_checks import check_head_height
from dermis.formats.obj import obj_maps
from dermis.formats.parts import is_gltf
from dermis.formats.samples import SAMPLES, Sample, fetch
from dermis.human.regions.apply import with_default_regions
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.fitted_eyes.fit import with_fitted_eyes
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.subdivide import subdivide_head
from dermis.scene.head_table import (
    AUTO,
    EyeMode,
    NormalY,
    UpAxis,
    VOrigin,
    check_files_and_lengths,
    check_options,
    check_relief,
    head_name,
)
from dermis.scene.smoothness import Subdivide, SubdivisionLevels, resolve_levels

if TYPE_CHECKING:
    from dermis.human.person import Human

MapFile = str | os.PathLike[str] | None
HUMAN = "human"
_MAX_SEED_DIGITS = 20  # digits
MIN_HUMAN_LEVELS = 1  # levels of subdivision
REMOVED_HEADS = ("bust", "bust_many_charts")
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
    up: UpAxis = "y",
    normal_y: NormalY = "up",
    opaque: Sequence[str] | str = (),
    eyes: EyeMode = "fitted",
    eye_groups: Sequence[str] | str = (),
    eye: Mapping[str, float] | None = None,
    subdivide: Subdivide = AUTO,
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
    opaque : groups of the file that light does not enter, beside those that are not called skin where one is;
        two balls that are called eyes get the package's eyes without it
    eyes : "fitted" puts the package's own eyes where a file has two balls called so, see `with_fitted_eyes`;
        "plain" keeps the file's
    eye_groups : groups of the file that hold eyeballs, whatever they are called, be it with all of the head
    eye : what the eyes look like where it is not as usual: fields of `EyeLook`
    subdivide : levels of subdivision, 0 to 3: Catmull-Clark for a file of quads, else Loop; the human has one
        at least. "auto" for as many as its outline needs to look smooth in a portrait of 1024x1024,
        `SmoothIn(camera, size)` for another picture
    regions : "auto" for gloss by region of the face where the package knows the head and no map says the
        roughness; "none" for one roughness all over

    Raises DermisError for files that cannot be rendered as a head; warns with DermisWarning of pictures of
    an .mtl that are left out.
    """
    opaque, eye_groups = ((one,) if isinstance(one, str) else one for one in (opaque, eye_groups))
    name, path = head_name(head), Path(head)
    given_maps = {"colour": colour, "normal": normal, "height": height}
    given_maps |= {"specular": specular, "roughness": roughness}
    check_files_and_lengths(given_maps, unit_mm=unit_mm, height_mm=height_mm)
    mesh_options: dict[str, Any] = {"unit_mm": unit_mm, "v_origin": v_origin, "up": up, "opaque": opaque}
    mesh_options["eye_groups"], levels = eye_groups, resolve_levels(subdivide)
    others = {"height_mm": height_mm, "normal_y": normal_y, "eyes": eyes, "eye": eye}
    check_options(
        **mesh_options, **others, subdivide=AUTO if callable(subdivide) else subdivide, regions=regions
    )
    mesh_options |= {"opaque": tuple(opaque), "eye_groups": tuple(eye_groups)}
    if is_person_name(name):
        return _with_look(
            _load_human(name, given_maps, height_mm, normal_y, mesh_options | {"eyes": eyes}, levels), eye
        )
    sample, files, look = SAMPLES.get(name), dict[str, Any](), EyeLook()
    if sample is not None:
        _check_sample_kind(sample)
        files = fetch(name)
        path = files["mesh"]
        mesh_options["unit_mm"] = sample.unit_mm if unit_mm is None else unit_mm
        mesh_options["v_origin"] = sample.v_origin or v_origin if v_origin == "auto" else v_origin
        height_mm = sample.height_mm if height_mm is None else height_mm
    elif not is_file(path):
        _refuse_name(name)
    elif is_gltf(path):
        files, look = embedded_maps(path), embedded_eye_look(path)
    chosen = _map_files(given_maps, files)
    if height is None and height_mm is None:
        height_mm = files.get("height_mm")
    obj = path if sample is None and path.suffix.lower() == ".obj" else None
    with ThreadPoolExecutor(1) as pool:
        pending_maps = pool.submit(_read_maps, obj, chosen, mesh_options["opaque"], height_mm, normal_y)
        rigged = load_rigged(path, **mesh_options)
        check_head_height(rigged.mesh, name, mesh_options["unit_mm"])
        maps, notice = pending_maps.result()
    check_relief(height_mm, maps.height, f"{name}: height_mm")
    if notice:
        notify(notice)
    credit = f"{sample.attribution}, {sample.licence}" if sample else ""
    head_model = _subdivided(Head(name, rigged.mesh, maps, credit, rigged.rig), levels)
    head_model = with_default_regions(head_model) if regions == AUTO else head_model
    return _with_look(
        with_fitted_eyes(head_model, rigged.mesh, look) if eyes == "fitted" else head_model, eye
    )


def is_person_name(name: str) -> bool:
    """Whether a head's name is that of the parametric human, or of a file of its numbers."""
    return name == HUMAN or name.startswith(f"{HUMAN}:") or Path(name).suffix.lower() == ".json"


def _subdivided(head: Head, levels: SubdivisionLevels) -> Head:
    """The head on a finer mesh; sequences of files have places for the file's own vertices."""
    head_model = subdivide_head(head, levels)
    if head_model.levels and head_model.rig is not None:
        return replace(head_model, rig=replace(head_model.rig, corner=head.mesh.point))
    return head_model


def _with_look(head: Head, look: Mapping[str, float] | None) -> Head:
    """The head with eyes that look as told.

    Raises DermisError where it has none of true shape, and for looks that no eyes have.
    """
    if not look:
        return head
    known = [one.name for one in fields(EyeLook)]
    for name in look.keys() - set(known):
        refuse("eye", f"one of {', '.join(known)}", f"got {name!r}", "Correct its name")
    if head.eyes is None:
        actual = head.note or "nothing in its file is called eyes"
        advice = "Name the groups that hold eyeballs (eye_groups)"
        refuse("eye", "a head with the package's eyes", f"{head.name} has none: {actual}", advice)
    return replace(head, eyes=head.eyes.with_look(replace(head.eyes.look, **dict[str, Any](look))))


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
    head_name, notice = obj_maps(obj, opaque=opaque, given=given, height_mm=height_mm, normal_y=normal_y)
    return replace(head_name, **{role: getattr(loaded, role) for role in given}), notice


def _refuse_name(name: str) -> NoReturn:
    known = ", ".join(_head_names())
    if name in REMOVED_HEADS:
        actual = f"this mannequin was replaced by the parametric human, {HUMAN!r}"
        refuse(name, f"one of {known} or a mesh file", actual, f"Write {HUMAN} instead")
    refuse(name or "head", f"a mesh file or a sample ({known})", f"{name!r} is neither", "Check the name")


def _check_sample_kind(sample: Sample) -> None:
    if sample.kind != "head":
        hint = f"Use one of {', '.join(_head_names())}"
        refuse(sample.name, "a head", f"this sample is an {sample.kind}", hint)


@logged_step("making the person")
def _load_human(
    name: str,
    maps: dict[str, MapFile],
    height_mm: float | None,
    normal_y: NormalY,
    mesh_options: dict[str, Any],
    levels: SubdivisionLevels,
) -> Head:
    """The parametric human, in its own layout.

    name : "human", or with a seed: "human:7", or a file of numbers
    told : what is told of files alone
    """
    defaults = {
        "unit_mm": None,
        "v_origin": "auto",
        "up": "y",
        "opaque": (),
        "eye_groups": (),
        "eyes": "fitted",
    }
    for option, value in mesh_options.items():
        if value != defaults[option]:
            refuse(option, "a file that it tells of", f"it is given with {HUMAN!r}", "Leave it out")
    check_relief(height_mm, maps["height"])
    given: dict[str, Any] = {role: file for role, file in maps.items() if file is not None}
    loaded = load_maps(**given, height_mm=height_mm, normal_y=normal_y) if given else None
    found = levels if callable(levels) else lambda plain: levels
    head_model = load_person(name).head(subdivide=lambda plain: max(MIN_HUMAN_LEVELS, found(plain)))
    given_maps = {role: getattr(loaded, role) for role in given}  # all others are painted
    return replace(head_model, name=name, maps=replace(head_model.maps, **given_maps))


def load_person(name: str) -> Human:
    """The person of a name that `is_person_name`: the usual one, one drawn by a seed, or that of a file.

    DermisError : no such seed or file
    """
    from dermis.human.person import Human
    from dermis.human.person_file import read_person

    if name == HUMAN:
        return Human()
    if Path(name).suffix.lower() == ".json":
        return read_person(Path(name))
    words = name.partition(":")[2]
    if not words.isdecimal() or len(words) > _MAX_SEED_DIGITS:
        actual = f"got {format_value(words)}"
        refuse(name, f"{HUMAN}, or {HUMAN}:SEED with a whole number", actual, f"Try {HUMAN}:7")
    return Human.drawn(int(words))


def _map_files(given: dict[str, MapFile], files: dict[str, Any]) -> dict[str, Any]:
    """For each role the file given, else the head's own; a normal map that is given replaces its relief."""
    chosen = {role: files.get(role) if file is None else file for role, file in given.items()}
    return chosen | {"region": files.get("region")}


def _head_names() -> list[str]:
    return [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
