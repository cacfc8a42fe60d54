"""Loading of lights, cameras and whole scenes from TOML files."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field

from dermis.base.errors import error_context, refuse
from dermis.base.reading import checked_path, is_file, read_toml
from dermis.base.renamed import renamed_keywords
from dermis.human.expressions import expression
from dermis.human.regions.apply import with_regions
from dermis.human.regions.region_table import load_region_table
from dermis.mesh.head import Head
from dermis.mesh.pose import MAX_WEIGHT, Pose
from dermis.scene.camera import CAMERA_PRESETS, Camera, find_camera_preset
from dermis.scene.environment import Environment
from dermis.scene.field_errors import BoundsReason, InvalidFieldsError
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.head_table import AUTO, NO_REGIONS, HeadTable, has_region_table
from dermis.scene.heads import load_head
from dermis.scene.lights import LIGHTS, NO_LIGHTS, Light, light_presets, preset_lights
from dermis.scene.living import SkinState
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import SKIN_PRESETS, Skin
from dermis.scene.smoothness import SmoothOutlineLevels

P = TypeVar("P", bound=FrozenModel)
_SCENE_TABLE_NAMES = {"head", "pose", "skin", "lights", "environment", "camera", "render", "state"}
_MAP_ROLES = ("colour", "normal", "height", "specular", "roughness")
_TargetWeight = Annotated[
    float, Field(ge=-MAX_WEIGHT, le=MAX_WEIGHT), BoundsReason("faces break apart long before")
]


def load_lights(name: str | Path, head: Head | None = None) -> tuple[Light, ...]:
    """Load the lights of a preset or of a TOML file with [[lights]] tables.

    Parameters
    ----------
    name : str or path
        Name of a preset ("studio", "window", ...) or a file.
    head : Head, optional
        Head for which the lights of a preset are placed; lights for a body larger than a metre are farther
        away.

    Returns
    -------
    tuple of lights
        The lights; empty for the preset "none".

    Raises
    ------
    DermisError
        For unknown names and invalid files.

    Examples
    --------
    >>> import dermis
    >>> [light.kind for light in dermis.load_lights("window")]
    ['rectangle', 'rectangle']
    """
    known = light_presets()
    if str(name) in known:
        return preset_lights(str(name), head)
    return _parse_lights(
        name, _read_scene_file(name, f"a preset ({', '.join(known)}) or a TOML file").get("lights")
    )


def load_camera(preset_or_path: str | Path, head: Head) -> Camera:
    """Return the camera of a preset, placed for a head, or the camera of a TOML file's [camera] table."""
    preset = find_camera_preset(str(preset_or_path))
    if preset is not None:
        return preset(head)
    table = _read_scene_file(preset_or_path, f"a preset ({', '.join(CAMERA_PRESETS)}) or a TOML file").get(
        "camera"
    )
    return _build_settings(Camera, preset_or_path, "camera", table)


@renamed_keywords(known="head")
def load_scene(
    path: str | Path,
    head: Head | None = None,
    *,
    camera: str | None = None,
    size: tuple[int, int] | None = None,
) -> tuple[Scene, Settings]:
    r"""Load a scene and its settings from a TOML file.

    The tables of the file are [head], [pose], [state], [skin], [[lights]], [environment], [camera] and
    [render]. The table [head] has the `name` of a sample or a mesh file, options of `load_head`, and
    `regions`, the table of face regions for `with_regions`. The table [state] has weights of states of the
    skin of a person, such as blush = 0.6. The table [pose] has a named `expression`, such as "joy", and the
    subtables `weights` and `bones`, whose keys are names of morph targets and bones. The name of a preset can
    replace three of the tables, as in skin = "deck-2007", lights = "studio" and camera = "portrait". Missing
    keys have their default values. File names are relative to the folder of the scene file. A scene with an
    environment has no lights unless the file specifies lights.

    Parameters
    ----------
    path : str or path
        The TOML file.
    head : Head, optional
        Head to use instead of loading the head of the file's [head] table.
    camera : str, optional
        Name of the camera for which the subdivision levels of the head are chosen; by default the camera of
        the scene file.
    size : (int, int), optional
        Picture size for which the subdivision levels are chosen; by default the size in the scene file
        [pixel].

    Returns
    -------
    scene : Scene
        The scene with its head loaded.
    settings : Settings
        Settings of the file's [render] table.

    Raises
    ------
    DermisError
        For files that cannot be read, unknown keys and invalid values.

    Examples
    --------
    >>> import dermis, pathlib, tempfile
    >>> from dermis.mesh.maps import Maps
    >>> from dermis.mesh.primitives import uv_sphere
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "scene.toml"
    >>> _ = path.write_text('lights = "window"\n[head]\nname = "human"\n[render]\nsize = 64\n')
    >>> head = dermis.Head("ball", uv_sphere(90.0, 8, 4), Maps())
    >>> scene, settings = dermis.load_scene(path, head)
    >>> len(scene.lights), settings.size
    (2, (64, 64))
    """
    path = checked_path(path, "a scene in TOML")
    table = _read_scene_file(path, "a scene in TOML")
    for part in table.keys() - _SCENE_TABLE_NAMES:
        refuse(
            path,
            f"only the tables {', '.join(sorted(_SCENE_TABLE_NAMES))}",
            f"got {part!r}",
            "Correct its name",
        )
    skin = _parse_skin(path, table.get("skin", {}))
    settings = _build_settings(Settings, path, "render", table.get("render", {}))
    head_entry = _build_settings(HeadTable, path, "head", table.get("head"))
    _check_rho_s_given_once(path, head_entry, skin)
    entry = table.get("camera", "portrait")
    resolve_camera = partial(_parse_camera, path, entry) if camera is None else partial(load_camera, camera)
    picture = SmoothOutlineLevels(resolve_camera, size or settings.size)
    with error_context(path):
        if head is None:
            head, skin = load_head_and_skin(head_entry, skin, path.parent, picture)
    environment = _parse_environment(path, table["environment"]) if "environment" in table else None
    pose = _parse_pose(path, table["pose"], head) if "pose" in table else None
    lights = table.get("lights")
    if lights is None:
        lights = "studio" if environment is None else NO_LIGHTS
    return Scene(
        head,
        lights=load_lights(_resolve_file(path.parent, lights), head)
        if isinstance(lights, str)
        else _parse_lights(path, lights),
        environment=environment,
        camera=_parse_camera(path, entry, head),
        skin=_resolve_skin_files(path.parent, skin),
        pose=pose,
        state=_parse_state(path, table["state"]) if "state" in table else None,
    ), settings


def head_table(path: Path) -> dict[str, Any]:
    """Return the [head] table of a scene file, with its file names made absolute."""
    return with_absolute_paths(_read_scene_file(path, "a scene in TOML").get("head", {}), path.parent)


def with_absolute_paths(head_fields: Mapping[str, Any], scene_folder: Path) -> dict[str, Any]:
    """Return a [head] table with absolute names of its files.

    scene_folder : folder to which file names are relative
    """
    named = {
        role: scene_folder / head_fields[role]
        for role in ("name", "regions", *_MAP_ROLES)
        if role in head_fields
    }
    return {**head_fields} | {role: str(file.resolve()) for role, file in named.items() if is_file(file)}


def load_head_and_skin(
    head_fields: HeadTable, skin: Skin, scene_folder: Path, outline_levels: SmoothOutlineLevels | None = None
) -> tuple[Head, Skin]:
    """Return the head of a [head] table, and the skin settings of the head.

    If the [head] table names a table of face regions, the returned skin has the mean specular strength
    rho_s of these regions.

    skin : skin settings of the scene file
    scene_folder : folder to which file names are relative
    outline_levels : choice of the subdivision levels for a camera and picture size; used if the table does
        not state levels

    Raises DermisError for files that cannot be used.
    """
    regions = (
        load_region_table(_resolve_file(scene_folder, head_fields.regions))
        if has_region_table(vars(head_fields))
        else None
    )
    options = head_fields.model_dump(exclude={"name"}, exclude_none=True)
    if regions is not None:
        options["regions"] = NO_REGIONS
    options |= {role: scene_folder / options[role] for role in _MAP_ROLES if role in options}
    if outline_levels is not None and head_fields.subdivide == AUTO:
        options["subdivide"] = outline_levels
    head = load_head(_resolve_file(scene_folder, head_fields.name), **options)
    if regions is None:
        return head, skin
    head, rho_s = with_regions(head, regions)
    return head, skin.model_copy(update={"rho_s": rho_s})


def _parse_skin(path: Path, table_or_preset: Any) -> Skin:
    """Return the skin of a scene file, from its [skin] table or from the name of a skin preset."""
    if not isinstance(table_or_preset, str):
        return _build_settings(Skin, path, "skin", table_or_preset)
    if table_or_preset not in SKIN_PRESETS:
        refuse(
            f"{path}: skin",
            f"a table or one of {', '.join(SKIN_PRESETS)}",
            f"got {table_or_preset!r}",
            "Correct it",
        )
    return Skin.preset(table_or_preset)


def _resolve_skin_files(scene_folder: Path, skin: Skin) -> Skin:
    """Return a skin in which relative names of profile files are resolved against a folder."""
    others = tuple(_resolve_file(scene_folder, name) for name in skin.other_profiles)
    mixture_map = skin.profile_map and _resolve_file(scene_folder, skin.profile_map)
    names = {
        "profile": _resolve_file(scene_folder, skin.profile),
        "other_profiles": others,
        "profile_map": mixture_map,
    }
    return skin.model_copy(update={name: one for name, one in names.items() if one != getattr(skin, name)})


def _check_rho_s_given_once(path: Path, head_settings: HeadTable, skin: Skin) -> None:
    if has_region_table(vars(head_settings)) and "rho_s" in skin.model_fields_set:
        actual = "it is given beside the head's regions, which set it for each region"
        refuse(f"{path}: skin: rho_s", "one or the other", actual, "Leave one out, or use oiliness")


def _parse_camera(path: Path, table_or_preset: Any, head: Head) -> Camera:
    if isinstance(table_or_preset, str):
        return load_camera(_resolve_file(path.parent, table_or_preset), head)
    return _build_settings(Camera, path, "camera", table_or_preset)


def _parse_pose(path: Path, pose_table: Any, head: Head) -> Pose:
    entry = _build_settings(PoseTable, path, "pose", pose_table)
    with error_context(f"{path}: pose"):
        weights = expression(entry.expression) if entry.expression else {}
    pose = Pose(weights | entry.weights, entry.bones)
    pose.to_arrays(head.control_rig, f"{path}: pose")  # for an error that names the file
    return pose


def _parse_state(path: Path, state_table: Any) -> SkinState:
    with error_context(path):
        return SkinState(state_table)


def _parse_environment(path: Path, environment_table: Any) -> Environment:
    if isinstance(environment_table, dict) and "visible" in environment_table:
        advice = 'Write background = "environment" into [render]'
        refuse(f"{path}: environment: visible", "no such key any more", "it is given", advice)
    environment = _build_settings(Environment, path, "environment", environment_table)
    return environment.model_copy(update={"name": _resolve_file(path.parent, environment.name)})


def _resolve_file(scene_folder: Path, file_or_preset: str) -> str:
    """Return the path of a file in a folder, or the name itself if there is no such file.

    Names of presets and samples are returned unchanged.
    """
    file = scene_folder / file_or_preset
    return str(file) if is_file(file) else file_or_preset


def _parse_lights(error_subject: object, light_tables: Any) -> tuple[Light, ...]:
    if not isinstance(light_tables, list) or not light_tables:
        actual = "got none" if not light_tables else f"got {light_tables!r}"
        refuse(
            error_subject,
            "at least one [[lights]] table",
            actual,
            "Add one with kind, position and irradiance",
        )
    return tuple(
        _parse_light(error_subject, f"light {k}", table) for k, table in enumerate(light_tables, start=1)
    )


def _parse_light(error_subject: object, light_label: str, light_table: Any) -> Light:
    kind = light_table.get("kind", "point") if isinstance(light_table, dict) else "point"
    if not isinstance(kind, str) or kind not in LIGHTS:
        refuse(
            f"{error_subject}: {light_label}", f"a kind of {', '.join(LIGHTS)}", f"got {kind!r}", "Correct it"
        )
    return _build_settings(LIGHTS[kind], error_subject, light_label, light_table)


def _build_settings(settings_class: type[P], file_name: object, table_name: str, table_values: Any) -> P:
    """Return an instance of a settings class from a TOML table; errors name the file and the table.

    settings_class : class of the settings, such as `Skin`
    file_name, table_name : names of the file and of the table, for error messages
    table_values : content of the table, a mapping from field names to values
    """
    if not isinstance(table_values, dict):
        actual = "there is none" if table_values is None else f"got {table_values!r}"
        refuse(
            f"{file_name}: {table_name}",
            f"a table with {', '.join(settings_class.model_fields)}",
            actual,
            "Add one",
        )
    with error_context(f"{file_name}: {table_name}"):
        try:
            return settings_class(**table_values)
        except InvalidFieldsError as error:
            raise InvalidFieldsError(f"{file_name}: {table_name}", error.messages) from None


def _read_scene_file(file_name: str | Path, expected_content: str) -> dict[str, Any]:
    return read_toml(checked_path(file_name, expected_content), expected_content)


class PoseTable(FrozenModel):
    """The [pose] table of a scene file: expression, morph target weights and bone rotations."""

    expression: str = ""
    """Named expression, such as "joy"; weights given by name replace those of the expression."""
    weights: dict[str, _TargetWeight] = Field(default_factory=dict)
    """Weights of morph targets by name, normally 0 to 1."""
    bones: dict[str, Any] = Field(default_factory=dict)
    """Rotations by name of the bone: angles about the head's x, y and z [degrees], or a (4, 4) matrix."""
