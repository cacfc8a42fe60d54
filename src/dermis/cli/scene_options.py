"""The options of a scene, as `dermis render`, `animate` and `view` take them, and the scene they make."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from dermis.base.console import note
from dermis.base.errors import refuse
from dermis.cli.head_options import (
    EYE,
    HEAD_OPTION_NAMES,
    EyeOptions,
    HeadOptions,
    LookAtOption,
    BoneAngleOptions,
    Weights,
    check_head,
    pose_with_gaze,
    note_eyes,
    parse_bone_angles,
    parse_weights,
    pose_from_options,
)
from dermis.cli.options import Options, check, option_name, model_options, refuse_options
from dermis.scene.environment import Environment
from dermis.scene.head_table import AUTO, NO_REGIONS, EyeTable, HeadTable, names_regions
from dermis.scene.settings import PHOTOGRAPHED, Settings
from dermis.scene.skin import PRESETS, Skin
from dermis.scene.techniques import TECHNIQUES

if TYPE_CHECKING:
    from dermis.mesh.head import Head
    from dermis.scene import Scene
    from dermis.scene.lights import Light

    SkinOptions = Options
    SettingsOptions = Options
    EnvironmentOptions = Options
    SkinPreset = str | None

ENVIRONMENT_OPTION_NAMES = {field: f"env_{field}" for field in Environment.model_fields}
ENVIRONMENT_OPTION_NAMES |= {"name": "env", "rotation_degrees": "env_rotation"}

if not TYPE_CHECKING:
    SkinPreset = Literal[tuple(PRESETS)] | None
    SkinOptions, SettingsOptions = model_options(Skin), model_options(Settings, defaults=PHOTOGRAPHED)
    EnvironmentOptions = model_options(Environment, names=ENVIRONMENT_OPTION_NAMES)


@Parameter(name="*")
@dataclass(frozen=True)
class SceneOptions:
    """Options of a scene as they were typed, by the fields of the models."""

    settings: SettingsOptions = field(default_factory=dict)
    skin: SkinOptions = field(default_factory=dict)
    surface: Annotated[
        SkinPreset,
        Parameter(
            name="--skin",
            help="Skin to start from: default, or deck-2007 as the talk had it: one lobe of strength 0.18, "
            "alike all over, over Lambertian skin.",
        ),
    ] = None
    lights: Annotated[
        str | None,
        Parameter(
            help="A rig (studio, window, top, rim, backlit, rembrandt, laser, none) or a TOML file with "
            "[[lights]]; studio unless --env is given."
        ),
    ] = None
    around: EnvironmentOptions = field(default_factory=dict)
    camera: Annotated[
        str | None,
        Parameter(help="portrait, three-quarter, profile, ear, cheek, or a TOML file with [camera]."),
    ] = None
    head: HeadOptions = field(default_factory=dict)
    eye: EyeOptions = None
    pose: Weights = None
    bone: BoneAngleOptions = None
    look_at: LookAtOption = None


DEFAULTS = SceneOptions()


def assemble_scene(name: str, given: SceneOptions) -> tuple[Scene, Settings]:
    """Return the scene and settings of a head or of a scene's file, with the given options on top.

    Settings that neither states are those of `PHOTOGRAPHED`.
    """
    from dermis.scene import Scene, load_camera

    weights, turns = parse_weights(given.pose or ()), parse_bone_angles(given.bone or ())
    if given.eye:
        given = replace(given, head=given.head | {"eye": parse_weights(given.eye, EYE)}, eye=None)
    _check(name, given)
    scene, settings = _base_scene(name, given)
    note_eyes(scene.head, given.head.get("eyes"))
    if weights or turns:
        from dermis.mesh.pose import laid_over

        scene = replace(scene, pose=laid_over(pose_from_options(weights, turns, scene.head, name), scene.pose))
    environment = _environment(scene.environment, given.around)
    made = Scene(
        scene.head,
        lights=_lights(scene, given.lights, environment, replaced="name" in given.around),
        camera=scene.camera if given.camera is None else load_camera(given.camera, scene.head),
        skin=Skin(**(scene.skin.model_dump() | PRESETS[given.surface or "default"] | given.skin)),
        environment=environment,
        pose=scene.pose,
    )
    if given.look_at is not None:
        made = replace(made, pose=pose_with_gaze(given.look_at, made))
    shown = Settings(**{**PHOTOGRAPHED, **settings.model_dump(exclude_unset=True), **given.settings})
    _note_profile_map(made.skin, shown)
    return made, shown


def note_subdivision(name: str, given: SceneOptions, head: Head) -> None:
    """Print a line on stderr about levels of subdivision that were chosen for the picture.

    name : of the head or of the scene's file, whose head this is
    """
    from dermis.scene.files import head_table
    from dermis.scene.heads import LEAST_OF_PEOPLE, is_person

    told = head_table(Path(name)) if Path(name).suffix.lower() == ".toml" else given.head
    least = LEAST_OF_PEOPLE if is_person(head.name) else 0
    if told.get("subdivide", AUTO) == AUTO and head.levels > least:
        count = f"{len(head.mesh.triangles):,} triangles"
        note(f"note: --subdivide {head.levels}: {count}, for a smooth outline in this picture")


def _check(name: str, given: SceneOptions) -> None:
    """Refuse impossible options before the head is loaded, which takes longer."""
    from dermis.environment.panorama import panorama_file
    from dermis.optics.profiles import load_profile

    looks = given.head.get("eye", {})
    check(EyeTable, looks, {field_: f"eye {field_}" for field_ in looks})
    check_head(name, given.head)
    check(Skin, given.skin)
    check(Settings, given.settings)
    check(Environment, {"name": "uniform"} | given.around, ENVIRONMENT_OPTION_NAMES)
    if "profile" in given.skin:
        load_profile(given.skin["profile"])
    for other in given.skin.get("other_profiles", ()):
        load_profile(other)
    if "name" in given.around:
        panorama_file(given.around["name"])


def _note_profile_map(skin: Skin, settings: Settings) -> None:
    """Print a line on stderr where a map of profiles has no effect."""
    if skin.profile_map and not TECHNIQUES[settings.technique].mixes:
        note(f"note: {settings.technique} takes the first profile alone; texture-space mixes them by the map")


def _base_scene(name: str, given: SceneOptions) -> tuple[Scene, Settings]:
    """Return the scene of a file, or a head's scene with defaults."""
    from dermis.scene import Scene, load_camera, load_scene
    from dermis.scene.files import head_and_skin
    from dermis.scene.smoothness import SmoothIn

    if Path(name).suffix.lower() == ".toml":
        refuse_options(given.head, HEAD_OPTION_NAMES, "with a scene file", "Write it into the file's [head]")
        return load_scene(Path(name), camera=given.camera, size=given.settings.get("size"))
    alike = {"regions": NO_REGIONS} if given.surface == "deck-2007" else {}
    table = HeadTable(**{"name": name, **alike, **given.head})
    if names_regions(vars(table)) and "rho_s" in given.skin:
        came = "it came with --regions, which says it for each region"
        refuse(option_name("rho_s"), "one or the other", came, "Leave one out, or use --oiliness")
    seen = partial(load_camera, given.camera or "portrait")
    picture = SmoothIn(seen, Settings(**given.settings).size)
    head, skin = head_and_skin(table, Skin(), Path(), picture)
    return Scene(head, skin=skin), Settings()


def _environment(before: Environment | None, around: Options) -> Environment | None:
    if around and before is None and "name" not in around:
        option = option_name(next(iter(around)), ENVIRONMENT_OPTION_NAMES)
        refuse(option, "an environment with it", "there is none", "Add --env, or [environment] to the scene")
    if not around:
        return before
    return Environment(**((before.model_dump() if before else {}) | around))


def _lights(
    scene: Scene, name: str | None, environment: Environment | None, *, replaced: bool
) -> tuple[Light, ...]:
    """Return the given rig; no lights where only an environment is given; else the scene's lights."""
    from dermis.scene import load_lights

    if name is None:
        return () if replaced else tuple(scene.lights)
    lights = load_lights(name)
    if not lights and environment is None:
        refuse("--lights", "some light", f"{name!r} has none", "Add --env, or choose another rig")
    return lights
