"""Scene options shared by `dermis render`, `animate` and `view`, and the scene that they describe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.base.console import print_note
from dermis.base.errors import refuse
from dermis.cli.head_options import (
    EYE_OPTION,
    HEAD_OPTION_NAMES,
    BoneAngleOptions,
    EyeOptions,
    HeadOptions,
    LookAtOption,
    WeightsOption,
    check_head_options,
    note_kept_eyeballs,
    parse_bone_angles,
    parse_weights,
    pose_from_options,
    pose_with_gaze,
)
from dermis.cli.living_options import StatesOption, check_constant_states, parse_states
from dermis.cli.options import Options, check_fields, model_options, option_name, refuse_options
from dermis.scene.environment import Environment
from dermis.scene.head_table import AUTO, NO_REGIONS, EyeTable, HeadTable, has_region_table
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS, Settings
from dermis.scene.skin import SKIN_PRESETS, Skin
from dermis.scene.techniques import TECHNIQUES

if TYPE_CHECKING:
    from dermis.mesh.head import Head
    from dermis.scene import Scene
    from dermis.scene.lights import Light
    from dermis.scene.living import SkinState

    SkinOptions = Options
    SettingsOptions = Options
    EnvironmentOptions = Options
    SkinPreset = str | None

DEFAULT_RIG = "portrait"
"""Lighting rig of the commands for heads without lights of their own."""
_GAZE_TARGET_PREFIX = "eyeLook"
ENVIRONMENT_OPTION_NAMES = {field: f"env_{field}" for field in Environment.model_fields}
ENVIRONMENT_OPTION_NAMES |= {"name": "env", "rotation_degrees": "env_rotation"}

if not TYPE_CHECKING:
    SkinPreset = Literal[tuple(SKIN_PRESETS)] | None
    SkinOptions = model_options(Skin)
    _ATLAS_DEFAULT = f"{Settings().atlas}, without a GPU what the picture resolves"
    SettingsOptions = model_options(
        Settings, shown_defaults={**PHOTOGRAPHIC_SETTINGS, "atlas": _ATLAS_DEFAULT}
    )
    EnvironmentOptions = model_options(Environment, option_names=ENVIRONMENT_OPTION_NAMES)


@Parameter(name="*")
@dataclass(frozen=True)
class SceneOptions:
    """Options of a scene on the command line.

    The fields `settings`, `skin`, `environment` and `head` are dictionaries of the options given by the user.
    """

    settings: SettingsOptions = field(default_factory=dict)
    skin: SkinOptions = field(default_factory=dict)
    surface: Annotated[
        SkinPreset,
        Parameter(
            name="--skin",
            help="Preset of the skin: default, or deck-2007 for the skin of the 2007 talk: one specular lobe "
            "of strength 0.18, without regions, over Lambertian skin.",
        ),
    ] = None
    lights: Annotated[
        str | None,
        Parameter(
            help="Lighting rig (portrait, beauty, studio, window, rembrandt, overcast, rim, top, backlit, "
            "raking, laser, none) or a TOML file with [[lights]]. [default: portrait, or none with --env]"
        ),
    ] = None
    environment: EnvironmentOptions = field(default_factory=dict)
    camera: Annotated[
        str | None,
        Parameter(
            help="Camera: portrait, three-quarter, profile, ear, cheek, full_body, headshot, or a TOML file "
            "with [camera]. [default: headshot for people, portrait for other heads]"
        ),
    ] = None
    head: HeadOptions = field(default_factory=dict)
    eye: EyeOptions = None
    pose: WeightsOption = None
    bone: BoneAngleOptions = None
    look_at: LookAtOption = None
    state: StatesOption = None


DEFAULT_SCENE_OPTIONS = SceneOptions()


def assemble_scene(
    head_or_scene: str, options: SceneOptions, *, looks_at_camera: bool = False
) -> tuple[Scene, Settings]:
    """Return the scene and settings that a head or scene file and the command line options describe.

    Settings that neither the scene file nor an option specifies are taken from `PHOTOGRAPHIC_SETTINGS`.

    head_or_scene : head or scene file as named on the command line
    looks_at_camera : whether people look at the default camera, unless an option turns eyes or bones
    """
    from dermis.scene import Scene, load_camera

    weights, bone_angles = parse_weights(options.pose or ()), parse_bone_angles(options.bone or ())
    if options.eye:
        options = replace(
            options, head=options.head | {"eye": parse_weights(options.eye, EYE_OPTION)}, eye=None
        )
    states = check_constant_states(parse_states(options.state or ()))
    _check_values(head_or_scene, options)
    scene, settings = _base_scene(head_or_scene, options)
    note_kept_eyeballs(scene.head, options.head.get("eyes"))
    if weights or bone_angles:
        from dermis.mesh.pose import merge_poses

        pose = pose_from_options(weights, bone_angles, scene.head, head_or_scene)
        scene = replace(scene, pose=merge_poses(pose, scene.pose))
    environment = _merge_environment(scene.environment, options.environment)
    assembled = Scene(
        scene.head,
        lights=_select_lights(
            scene, options.lights, environment, replaces_environment="name" in options.environment
        ),
        camera=scene.camera if options.camera is None else load_camera(options.camera, scene.head),
        skin=Skin(**(scene.skin.model_dump() | SKIN_PRESETS[options.surface or "default"] | options.skin)),
        environment=environment,
        pose=scene.pose,
        state=_merge_states(scene.state, states),
    )
    look_at = options.look_at
    if looks_at_camera and _is_default_view_of_person(head_or_scene, options):
        look_at = look_at or "camera"
    if look_at is not None:
        assembled = replace(assembled, pose=pose_with_gaze(look_at, assembled))
    set_values = settings.model_dump(exclude_unset=True) | options.settings
    final_settings = Settings(**{**PHOTOGRAPHIC_SETTINGS, **set_values})
    _note_profile_map(assembled.skin, final_settings)
    return assembled, final_settings


def _merge_states(state: SkinState | None, weights: Mapping[str, float]) -> SkinState | None:
    """Return the state of a scene file with the weights of --state, which override those of the file."""
    from dermis.scene.living import SkinState

    return SkinState({**(state.weights if state else {}), **weights}) if weights else state


def default_camera(head_or_scene: str) -> str:
    """Return the default camera preset for a head or scene file as named on the command line."""
    from dermis.scene.heads import is_person_name

    return "headshot" if is_person_name(head_or_scene) else "portrait"


def _is_default_view_of_person(head_or_scene: str, options: SceneOptions) -> bool:
    """Return whether the default camera shows a person whose eyes and bones no option turns."""
    poses = ",".join(options.pose or ())
    stated = options.camera is not None or options.bone or _GAZE_TARGET_PREFIX in poses
    return not stated and default_camera(head_or_scene) == "headshot"


def shrink_atlas_on_cpu(scene: Scene, settings: Settings, adapter_kind: str) -> Settings:
    """Return settings in which, for a software adapter, the atlas is only as large as the picture needs.

    The atlas is the texture in which light is diffused. A note on stderr states its new size. A size that
    the user or the scene file specifies is kept.

    adapter_kind : kind of the graphics adapter, "CPU" for software
    """
    from dermis.scene.resolved_atlas import atlas_side_for_picture

    if adapter_kind != "CPU" or "atlas" in settings.model_fields_set:
        return settings
    side = atlas_side_for_picture(scene, settings)
    if side < settings.atlas and TECHNIQUES[settings.technique].uses_atlas:
        print_note(f"note: --atlas {side} without a GPU, as the picture resolves no more texels")
    return settings.model_copy(update={"atlas": side})


def note_subdivision(head_or_scene: str, options: SceneOptions, head: Head) -> None:
    """Print a note on stderr if the subdivision level of the head was chosen automatically.

    head_or_scene : head or scene file as named on the command line
    """
    from dermis.scene.files import head_table
    from dermis.scene.heads import MIN_HUMAN_SUBDIVISION_LEVELS, is_person_name

    head_options = (
        head_table(Path(head_or_scene)) if Path(head_or_scene).suffix.lower() == ".toml" else options.head
    )
    min_levels = MIN_HUMAN_SUBDIVISION_LEVELS if is_person_name(head.name) else 0
    if head_options.get("subdivide", AUTO) == AUTO and head.levels > min_levels:
        count = f"{len(head.mesh.triangles):,} triangles"
        print_note(f"note: --subdivide {head.levels} for a smooth outline in this picture: {count}")


def _check_values(head_or_scene: str, options: SceneOptions) -> None:
    """Validate all options before the head is loaded, as loading takes longer than the validation."""
    from dermis.environment.panorama import panorama_file
    from dermis.optics.profiles import load_profile

    eye_values = options.head.get("eye", {})
    check_fields(EyeTable, eye_values, {field_: f"eye {field_}" for field_ in eye_values})
    check_head_options(head_or_scene, options.head)
    check_fields(Skin, options.skin)
    check_fields(Settings, options.settings)
    check_fields(Environment, {"name": "uniform"} | options.environment, ENVIRONMENT_OPTION_NAMES)
    if "profile" in options.skin:
        load_profile(options.skin["profile"])
    for other in options.skin.get("other_profiles", ()):
        load_profile(other)
    if "name" in options.environment:
        panorama_file(options.environment["name"])


def _note_profile_map(skin: Skin, settings: Settings) -> None:
    """Print a note on stderr if the skin has a profile map that the technique ignores."""
    if skin.profile_map and not TECHNIQUES[settings.technique].mixes_profiles:
        print_note(
            f"note: {settings.technique} uses only the first profile; texture-space mixes them by the map"
        )


def _base_scene(head_or_scene: str, options: SceneOptions) -> tuple[Scene, Settings]:
    """Return the scene and settings of a scene file, or default ones for a head, before options apply."""
    from dermis.scene import Scene, load_camera, load_scene
    from dermis.scene.files import load_head_and_skin
    from dermis.scene.heads import dressed_name
    from dermis.scene.smoothness import SmoothOutlineLevels

    if Path(head_or_scene).suffix.lower() == ".toml":
        refuse_options(options.head, HEAD_OPTION_NAMES, "with a scene file", "Set it in the file's [head]")
        return load_scene(Path(head_or_scene), camera=options.camera, size=options.settings.get("size"))
    region_options = {"regions": NO_REGIONS} if options.surface == "deck-2007" else {}
    table = HeadTable(**{"name": dressed_name(head_or_scene), **region_options, **options.head})
    if has_region_table(vars(table)) and "rho_s" in options.skin:
        actual = "it is given with --regions, which sets it for each region"
        refuse(option_name("rho_s"), "only one of the two", actual, "Remove one, or use --oiliness")
    camera_for = partial(load_camera, options.camera or default_camera(head_or_scene))
    picture = SmoothOutlineLevels(camera_for, Settings(**options.settings).size)
    head, skin = load_head_and_skin(table, Skin(), Path(), picture)
    return Scene(head, lights=DEFAULT_RIG, camera=camera_for(head), skin=skin), Settings()


def _merge_environment(scene_environment: Environment | None, options: Options) -> Environment | None:
    if options and scene_environment is None and "name" not in options:
        option = option_name(next(iter(options)), ENVIRONMENT_OPTION_NAMES)
        refuse(option, "an environment", "there is none", "Add --env, or [environment] to the scene")
    if not options:
        return scene_environment
    return Environment(**((scene_environment.model_dump() if scene_environment else {}) | options))


def _select_lights(
    scene: Scene, preset_or_file: str | None, environment: Environment | None, *, replaces_environment: bool
) -> tuple[Light, ...]:
    """Return the lights that the options --lights and --env select.

    Without --lights, these are the lights of the scene, or no lights if --env is given.

    preset_or_file : value of --lights (name of a lighting rig, or path of a file); None without this option
    environment : environment of the final scene; if it is None, a rig without lights raises DermisError
    replaces_environment : whether --env is given
    """
    from dermis.scene import load_lights

    if preset_or_file is None:
        return () if replaces_environment else tuple(scene.lights)
    lights = load_lights(preset_or_file, scene.head)
    if not lights and environment is None:
        refuse(
            "--lights",
            "at least one light",
            f"{preset_or_file!r} has none",
            "Add --env, or choose another rig",
        )
    return lights
