"""The scene that the options of `dermis render` describe."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.cli.options import check
from dermis.errors import refuse

if TYPE_CHECKING:
    from dermis.human.regions.table import RegionTable
    from dermis.scene import Environment, Light, Scene, Settings

_MAP_OPTIONS = ("colour", "normal", "height", "height_mm", "specular_map", "roughness_map")
_HEAD_OPTIONS = (*_MAP_OPTIONS, "unit_mm", "v_origin", "up", "normal_y", "opaque", "subdivide")
_SURFACE_OPTIONS = ("roughness", "rho_s", "oiliness", "specular", "fresnel", "specular_colour", "energy")
_SKIN_OPTIONS = ("profile", "albedo", "direction", "mix", *_SURFACE_OPTIONS)
_POST_OPTIONS = ("exposure", "bloom", "tone", "gamma", "background")
_SETTINGS = (
    "size",
    "atlas",
    "samples",
    "technique",
    "transmission",
    "seams",
    "stretch",
    "occlusion",
    *_POST_OPTIONS,
)
_ENVIRONMENT = {
    "name": "env",
    "rotation_degrees": "env_rotation",
    "exposure": "env_exposure",
    "visible": "env_visible",
}


def assemble(head: str, given: Mapping[str, Any]) -> tuple[Scene, Settings]:
    """The scene and its settings: the head's, or the file's, with the options given on top.

    given : options of `render` by parameter, parsed
    """
    from dermis.human.regions.apply import with_regions
    from dermis.scene import Scene, Settings, Skin, load_camera

    skin, chosen = (_of(given, names) for names in (_SKIN_OPTIONS, _SETTINGS))
    around = {field: given[option] for field, option in _ENVIRONMENT.items() if option in given}
    _check(skin, chosen, around)
    regions = _regions(given)
    scene, settings = _begin(head, given)
    environment, body = _environment(scene.environment, around), scene.head
    if regions is not None:
        body, skin["rho_s"] = with_regions(body, regions)
    return Scene(
        body,
        lights=_lights(scene, given.get("lights"), environment, replaced="name" in around),
        camera=load_camera(given["camera"], body) if "camera" in given else scene.camera,
        skin=Skin(**(scene.skin.model_dump() | skin)),
        environment=environment,
    ), Settings(**(settings.model_dump() | chosen))


def _of(given: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, Any]:
    return {name: given[name] for name in names if name in given}


def _check(skin: dict[str, Any], chosen: dict[str, Any], around: dict[str, Any]) -> None:
    """Refuse what cannot be before the head is loaded, which takes longer."""
    from dermis.environment.panorama import panorama_file
    from dermis.optics.profiles import load_profile
    from dermis.scene import Environment, Settings, Skin

    check(Skin, skin)
    check(Settings, chosen)
    check(Environment, {"name": "uniform"} | around, _ENVIRONMENT)
    if "profile" in skin:
        load_profile(skin["profile"])
    if "name" in around:
        panorama_file(around["name"])


def _regions(given: Mapping[str, Any]) -> RegionTable | None:
    from dermis.human.regions.table import load_table

    for option in ("rho_s", "roughness"):
        if "regions" in given and option in given:
            came = "it came with --regions, which says it for each region"
            name = f"--{option.replace('_', '-')}"
            refuse(name, "one or the other", came, "Leave one out, or use --oiliness")
    return load_table(given["regions"]) if "regions" in given else None


def _begin(head: str, given: Mapping[str, Any]) -> tuple[Scene, Settings]:
    """The file's scene, or a head's with defaults."""
    from dermis.scene import Scene, Settings, load_scene
    from dermis.scene.heads import load_head

    if Path(head).suffix.lower() != ".toml":
        own = {name.removesuffix("_map"): value for name, value in _of(given, _HEAD_OPTIONS).items()}
        return Scene(load_head(head, **own)), Settings()
    for name in _of(given, (*_HEAD_OPTIONS, "regions")):
        option = "--" + name.replace("_", "-")
        refuse(option, "no such option with a scene file", "it came", "Write it into the file's [head]")
    return load_scene(Path(head))


def _environment(before: Environment | None, around: dict[str, Any]) -> Environment | None:
    from dermis.scene import Environment

    if around and before is None and "name" not in around:
        option = "--" + _ENVIRONMENT[next(iter(around))].replace("_", "-")
        refuse(option, "an environment with it", "there is none", "Add --env, or [environment] to the scene")
    if not around:
        return before
    return Environment(**((before.model_dump() if before else {}) | around))


def _lights(
    scene: Scene, name: str | None, environment: Environment | None, *, replaced: bool
) -> tuple[Light, ...]:
    """The rig given; with an environment given and no rig none; else the scene's."""
    from dermis.scene import load_lights

    if name is None:
        return () if replaced else tuple(scene.lights)
    lights = load_lights(name)
    if not lights and environment is None:
        refuse("--lights", "some light", f"{name!r} has none", "Add --env, or choose another rig")
    return lights
