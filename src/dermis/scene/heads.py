"""Loading of heads by name: the parametric human, sample heads and mesh files."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

from dermis.base.errors import format_value, refuse
from dermis.base.progress import logged_step
from dermis.base.reading import is_file
from dermis.formats.axes import Axis, Front
from dermis.formats.maps import load_maps
from dermis.formats.parts import is_gltf
from dermis.formats.samples import SAMPLES
from dermis.human.regions.apply import with_default_regions
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.fitted_eyes.fit import with_fitted_eyes
from dermis.mesh.head import Head
from dermis.mesh.subdivide import subdivide_head
from dermis.scene.file_heads import MapFile, MapOptions, load_file_head
from dermis.scene.head_table import (
    AUTO,
    EyeMode,
    NormalY,
    VOrigin,
    check_files_and_lengths,
    check_options,
    check_relief,
    head_name,
)
from dermis.scene.smoothness import Subdivide, SubdivisionLevels, resolve_levels

if TYPE_CHECKING:
    from dermis.human.person import Human

HUMAN = "human"
BARE, DRESSED = "bare", "dressed"
"""Words after "human:SEED?" for a person who wears nothing, and for one dressed by chance."""
_MAX_SEED_DIGITS = 20
MIN_HUMAN_SUBDIVISION_LEVELS = 1
"""Lowest level of subdivision of the parametric human."""
REMOVED_HEADS = ("bust", "bust_many_charts")
"""Heads of earlier releases, replaced by `HUMAN`."""


def load_head(
    head: str | os.PathLike[str],
    *,
    colour: MapFile = None,
    skin_site: str | None = None,
    normal: MapFile = None,
    height: MapFile = None,
    height_mm: float | None = None,
    specular: MapFile = None,
    roughness: MapFile = None,
    unit_mm: float | None = None,
    v_origin: VOrigin = "auto",
    up: Axis | None = None,
    front: Front = "auto",
    normal_y: NormalY = "up",
    skin_groups: Sequence[str] | str = (),
    opaque: Sequence[str] | str = (),
    eyes: EyeMode = "fitted",
    eye_groups: Sequence[str] | str = (),
    eye: Mapping[str, float] | None = None,
    clothing: str | None = None,
    glasses: str | None = None,
    headwear: str | None = None,
    subdivide: Subdivide = AUTO,
    regions: Literal["auto", "none"] = "auto",
) -> Head:
    r"""Load a head: the parametric human, a sample head of the package or a mesh file.

    Options take precedence over what a sample, a glTF file or the .mtl of an OBJ file specifies. Morph
    targets and bones of a glTF file can move the head (`Pose`). In rest pose, the morph targets have the
    default weights of the file.

    Parameters
    ----------
    head : str or path
        "human" for the parametric human, "human:7" for the person of seed 7, "human:7?dressed" for this
        person with clothing, glasses and headwear by chance, a .json file written by `dermis head`, a sample
        ("lee_perry_smith") or a mesh file (.glb, .gltf, .vrm, .usdz, .obj, .ply, .stl).
    colour, normal, height, specular, roughness : str or path, optional
        Image files of the maps; see `dermis.formats.maps.load_maps`.
    skin_site : str, optional
        Site of the body whose measured colour is used for skin that has no picture: "palm", "back of hand",
        "inner arm" and others. The name of a group of people may precede the site, as in "south asian palm"
        [Lu2025].
    height_mm : float, optional
        Height that one grey level of an 8-bit height map represents [mm].
    unit_mm : float, optional
        Length of one unit of the file [mm]. The default for glTF is 1000; a USD file states its unit. OBJ,
        PLY and STL files state no unit: the default is 1 if the mesh then measures 100 to 1000 mm, otherwise
        the unit is guessed from the size of the mesh, with a note for the user.
    v_origin : {"auto", "top", "bottom"}
        Row of the maps at v = 0; "auto" follows the convention of the file format.
    up : {"y", "z", "x", "-y", "-z", "-x"}, optional
        Upward axis of the file; by default the axis that a USD file states, or y for other formats.
    front : {"auto", "z", "-y", "x", "-z", "y", "-x"}
        Axis of the file along which the face looks. "auto" uses the first of these that applies: the axis
        that a VRM file states; the axis that the eyes or the shape of the head indicate (with a note for the
        user); -y if z is up, as in Blender; z.
    normal_y : {"up", "down"}
        Direction of green in the normal map: "up" (OpenGL) or "down" (DirectX).
    skin_groups : str or sequence of str
        Groups of the file (materials, meshes, OBJ groups) that are skin; all other groups are then drawn with
        the materials of the file. By default, skin is recognised by group names, or as the groups that cover
        the head.
    opaque : str or sequence of str
        Groups of the file that are not skin, to correct the automatic choice. Eyeballs that the package
        replaces (see `eyes`) need not be listed.
    eyes : {"fitted", "plain"}
        "fitted" replaces two balls, in groups whose names denote eyes, by the package's eyes; "plain" keeps
        the eyes of the file.
    eye_groups : str or sequence of str
        Groups of the file that contain eyeballs, whatever the names of the groups; a group may also contain
        the rest of the head.
    eye : mapping, optional
        Dictionary from fields of `EyeLook` to values that override the look of the eyes.
    clothing : str, optional
        Garment of a parametric human in words, such as "navy denim shirt", see `Clothing`; "none" for bare
        shoulders. By default, the person's own.
    glasses : str, optional
        Glasses of a parametric human in words, such as "brown square", see `Glasses`; "none" for no glasses.
        By default, the person's own.
    headwear : str, optional
        Headwear of a parametric human in words, such as "red beanie", see `Headwear`; "none" for a bare head.
        By default, the person's own.
    subdivide : int, "auto" or callable
        Number of subdivision levels, 0 to 3, and at least 1 for the human. Meshes of quads are subdivided by
        Catmull-Clark, other meshes by Loop. "auto" uses as many levels as the outline needs to look smooth in
        a portrait of 1024x1024 pixels; for other pictures pass `SmoothOutlineLevels(camera, size)`.
    regions : {"auto", "none"}
        "auto" gives each region of the face its own roughness and specular strength if the regions are known
        and the head has no roughness map; "none" keeps roughness and strength uniform.

    Returns
    -------
    Head
        The head with its maps, eyes, hair and rig.

    Raises
    ------
    DermisError
        For files that cannot be rendered as a head.

    Warns
    -----
    DermisWarning
        For maps that an .mtl file names but that are not used, and for people's glTF files whose hair is
        left out.

    Examples
    --------
    >>> import dermis, pathlib, tempfile
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "roof.obj"
    >>> corners = "v -80 0 -60\nv 80 0 -60\nv 80 240 0\nv -80 240 0\n"
    >>> uv = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    >>> _ = path.write_text(corners + uv + "f 1/1 2/2 3/3 4/4\n")
    >>> len(dermis.load_head(path, subdivide=0).mesh.triangles)
    2
    """
    groups = {"skin_groups": skin_groups, "opaque": opaque, "eye_groups": eye_groups}
    named = {key: (one,) if isinstance(one, str) else tuple(one) for key, one in groups.items()}
    name, path = head_name(head), Path(head)
    map_files = {"colour": colour, "normal": normal, "height": height}
    map_files |= {"specular": specular, "roughness": roughness}
    check_files_and_lengths(map_files, unit_mm=unit_mm, height_mm=height_mm)
    levels, map_options = resolve_levels(subdivide), MapOptions(map_files, height_mm, normal_y, skin_site)
    mesh_options: dict[str, Any] = {
        "unit_mm": unit_mm,
        "v_origin": v_origin,
        "up": up,
        "front": front,
        **named,
    }
    others = {"height_mm": height_mm, "normal_y": normal_y, "eyes": eyes, "eye": eye, "regions": regions}
    check_options(
        **mesh_options, **others, skin_site=skin_site, subdivide=AUTO if callable(subdivide) else subdivide
    )
    worn = {"clothing": clothing, "glasses": glasses, "headwear": headwear}
    if is_person_name(name):
        mesh_options |= {"eyes": eyes, "skin_site": skin_site}
        loaded = _load_human(name, map_files, height_mm, normal_y, mesh_options, levels, worn)
        return _with_eye_look(loaded, eye)
    for item, words in worn.items():
        if words is not None:
            refuse(
                item,
                f"a person ({HUMAN}, {HUMAN}:SEED or a .json file)",
                f"it is given with {name!r}",
                "Leave it out",
            )
    if name not in SAMPLES and not is_file(path):
        _refuse_name(name)
    loaded, look = load_file_head(name, mesh_options, map_options)
    if eyes == "fitted" and name not in SAMPLES and is_gltf(name):
        from dermis.scene.file_people import with_grown_hair

        given = [option for option, value in mesh_options.items() if value not in (None, (), AUTO)]
        if (grown := with_grown_hair(loaded, levels, given)) is not None:
            return _with_eye_look(with_default_regions(grown) if regions == AUTO else grown, eye)
    coarse, loaded = loaded.mesh, subdivide_head(loaded, levels)
    loaded = with_default_regions(loaded) if regions == AUTO else loaded
    return _with_eye_look(with_fitted_eyes(loaded, coarse, look) if eyes == "fitted" else loaded, eye)


def is_person_name(head_name: str) -> bool:
    """Return whether a name denotes a parametric human: "human", "human:SEED", or a person's .json file."""
    return (
        head_name == HUMAN or head_name.startswith(f"{HUMAN}:") or Path(head_name).suffix.lower() == ".json"
    )


def _with_eye_look(head: Head, look_fields: Mapping[str, float] | None) -> Head:
    """Return the head with some fields of its eye look replaced.

    look_fields : dictionary from fields of `EyeLook` to new values; None to change nothing

    Raises DermisError for a head without anatomical eyes, and for unknown or invalid fields.
    """
    if not look_fields:
        return head
    known = [one.name for one in fields(EyeLook)]
    for name in look_fields.keys() - set(known):
        refuse("eye", f"one of {', '.join(known)}", f"got {name!r}", "Correct its name")
    if head.eyes is None:
        actual = head.note or "nothing in its file is called eyes"
        advice = "Name the groups that hold eyeballs (eye_groups)"
        refuse("eye", "a head with the package's eyes", f"{head.name} has none: {actual}", advice)
    return replace(head, eyes=head.eyes.with_look(replace(head.eyes.look, **dict[str, Any](look_fields))))


def _refuse_name(head_name: str) -> NoReturn:
    known = ", ".join(_head_names())
    if head_name in REMOVED_HEADS:
        actual = f"this mannequin was replaced by the parametric human, {HUMAN!r}"
        refuse(head_name, f"one of {known} or a mesh file", actual, f"Write {HUMAN} instead")
    refuse(
        head_name or "head",
        f"a mesh file or a sample ({known})",
        f"{head_name!r} is neither",
        "Check the name",
    )


@logged_step("making the person")
def _load_human(
    head_name: str,
    user_files: dict[str, MapFile],
    height_mm: float | None,
    normal_y: NormalY,
    mesh_options: dict[str, Any],
    subdivision_levels: SubdivisionLevels,
    worn: Mapping[str, str | None],
) -> Head:
    """Return the head of a parametric human in the uv layout "own".

    head_name : "human", "human:SEED", or a person's .json file
    user_files : dictionary from map roles, such as "colour", to files that replace the painted maps
    height_mm, normal_y : interpretation of the height map and the normal map, see `load_head`
    mesh_options : options that apply only to mesh files; DermisError is raised unless all have their defaults
    subdivision_levels : number of levels, or a function of the head that returns it
    worn : clothing, glasses and headwear in words, by field of `Human`; None keeps those of the person
    """
    texts = {"v_origin": "auto", "front": "auto", "eyes": "fitted"}
    defaults = {
        "unit_mm": None,
        "up": None,
        "skin_site": None,
        "skin_groups": (),
        "opaque": (),
        "eye_groups": (),
        **texts,
    }
    for option, value in mesh_options.items():
        if value != defaults[option]:
            refuse(option, "a mesh file to which it applies", f"it is given with {HUMAN!r}", "Leave it out")
    check_relief(height_mm, user_files["height"])
    map_files: dict[str, Any] = {role: file for role, file in user_files.items() if file is not None}
    loaded = load_maps(**map_files, height_mm=height_mm, normal_y=normal_y) if map_files else None
    level_of = subdivision_levels if callable(subdivision_levels) else lambda plain: subdivision_levels
    person = load_person(head_name)
    worn_words: dict[str, Any] = {name: words for name, words in worn.items() if words is not None}
    person = replace(person, **worn_words)
    head = person.head(subdivide=lambda plain: max(MIN_HUMAN_SUBDIVISION_LEVELS, level_of(plain)))
    user_maps = {role: getattr(loaded, role) for role in map_files}  # the other maps are painted
    return replace(head, name=head_name, maps=replace(head.maps, **user_maps))


def load_person(head_name: str) -> Human:
    """Return the person that a head name denotes.

    head_name : "human" for the average person, "human:SEED" for a random person who wears nothing,
        "human:SEED?dressed" for the same person in clothes, and perhaps glasses or headwear, by chance, or a
        person's .json file

    Raises DermisError for an invalid seed or file.
    """
    from dermis.human.person import Human
    from dermis.human.person_file import read_person
    from dermis.human.wear.chances import SAMPLED
    from dermis.human.wear.look import ITEM_TYPES

    if head_name == HUMAN:
        return Human()
    if Path(head_name).suffix.lower() == ".json":
        return read_person(Path(head_name))
    words, _, dress = head_name.partition(":")[2].partition("?")
    if dress not in ("", BARE, DRESSED):
        refuse(
            head_name, f"?{BARE} or ?{DRESSED} after the seed", f"got ?{dress}", f"Try {HUMAN}:7?{DRESSED}"
        )
    if not words.isdecimal() or len(words) > _MAX_SEED_DIGITS:
        actual = f"got {format_value(words)}"
        refuse(head_name, f"{HUMAN}, or {HUMAN}:SEED with a whole number", actual, f"Try {HUMAN}:7")
    return Human.sampled(int(words), **(dict.fromkeys(ITEM_TYPES, SAMPLED) if dress == DRESSED else {}))


def dressed_name(head_name: str) -> str:
    """Return the name of the dressed person for "human:SEED"; other names are returned unchanged."""
    is_seed = head_name.partition(":")[0] == HUMAN and head_name.partition(":")[2].isdecimal()
    return f"{head_name}?{DRESSED}" if is_seed else head_name


def _head_names() -> list[str]:
    return [HUMAN, *(name for name, sample in SAMPLES.items() if sample.kind == "head")]
