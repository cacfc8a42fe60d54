"""Effects of a change: cached frames equal those of a fresh renderer, and no pass runs needlessly.

The fields are found by introspection, so that new fields are tested at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import chdir
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from setups import front_camera, head_of, settings_of

from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.gpu.graph import FrameListing
from dermis.images.io import write_png
from dermis.mesh.pose import Pose
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.frozen_model import FrozenModel, field_choices
from dermis.scene.lights import LIGHTS, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments, Skin, TissueLayer

HEAD = head_of(uv_sphere(30.0, 24, 12), colour=np.linspace(0.2, 0.9, 8 * 8 * 3).reshape(8, 8, 3))
LAMP = SpotLight(position=(60.0, 80.0, 300.0))
LAYER = TissueLayer(absorption_per_mm=(0.03, 0.1, 0.2), scattering_per_mm=(0.8, 1.0, 1.2))
BASE = Scene(HEAD, lights=(LAMP,), camera=front_camera(HEAD, frame_mm=70.0))
SETTINGS = settings_of(seams="stitch", shadow_size=128)
WORDS: dict[tuple[type[FrozenModel], str], Any] = {  # for what is neither a number nor one of some words
    (Skin, "profile"): "dj3",
    (Skin, "profile_map"): "white.png",
    (Skin, "other_profiles"): ("skin1",),
    (Skin, "pigments"): Pigments(melanin=0.2).model_dump(),
    (Skin, "layers"): (LAYER.model_dump(),),
    (Environment, "name"): "uniform",
    (Settings, "background"): (0.1, 0.2, 0.3),
}
FIXED = {("stripe", "angle_degrees")}  # a sheet of light is parallel
GIVEN: dict[str, dict[str, Any]] = {  # what kinds of light have no default for
    "directional": {"direction": (0.0, -0.3, -1.0)},
    "stripe": {"direction": (0.0, 0.0, -1.0)},
}
BESIDE: dict[
    tuple[type[FrozenModel], str], dict[str, Any]
] = {  # what lets a field matter, or be changed at all
    (Skin, "profile_map"): {"profile_map": "half.png", "other_profiles": ("dj3",)},
    (Skin, "other_profiles"): {"profile_map": "half.png", "other_profiles": ("dj3",)},
    (Skin, "pigments"): {"profile": "light"},
    (Skin, "layers"): {"profile": "skin1"},
    (Settings, "seam_colour"): {"seams": "clear-colour"},
}


@pytest.fixture(autouse=True, scope="module")
def masks(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Write the files that fields of a skin name."""
    with chdir(tmp_path_factory.mktemp("masks")):
        for name, levels in {"half.png": [[255, 0]], "white.png": [[255]]}.items():
            write_png(name, np.array(levels, np.uint8)[..., None])
        yield


def others(model: type[FrozenModel], name: str, value: Any) -> Iterator[Any]:
    """Yield other valid values of a field, likely ones first."""
    if (model, name) in WORDS:
        yield WORDS[model, name]
    yield from (word for word in field_choices(model, name) if word != value)
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int | float):
        for factor in (0.5, 2, 0.9):
            yield type(value)(value * factor)
        yield type(value)(value + 1) if isinstance(value, int) else value + 0.25
    elif isinstance(value, tuple):
        yield tuple(type(part)(part + 1) for part in value)
        yield tuple(part * 2 for part in value)


def changed(values: FrozenModel, name: str) -> FrozenModel:
    """Return a copy with another value of one field."""
    told = {key: getattr(values, key) for key in type(values).model_fields}
    for other in others(type(values), name, getattr(values, name)):
        try:
            found = type(values)(**(told | {name: other}))
        except (DermisError, ValidationError, TypeError):
            continue
        if found != values:
            return found
    raise AssertionError(f"{type(values).__name__}.{name}: say in WORDS what else it may be")


def model_fields(model: type[FrozenModel]) -> list[tuple[type[FrozenModel], str]]:
    return [(model, name) for name in model.model_fields if name != "kind"]


def base(model: type[FrozenModel], name: str) -> FrozenModel:
    return model(**BESIDE.get((model, name), {}))


def kept_and_fresh(renderer: Renderer, *frames: tuple[Scene, Settings]) -> tuple[bytes, bytes]:
    """Return the last frame after the others, and the same frame of a fresh renderer."""
    for scene, settings in frames[:-1]:
        renderer.draw(scene, settings)
    kept = picture(renderer, *frames[-1])
    renderer.clear_cache()
    return kept, picture(renderer, *frames[-1])


def picture(renderer: Renderer, scene: Scene, settings: Settings) -> bytes:
    rendered = renderer.draw(scene, settings)
    return rendered.linear().tobytes() + rendered.srgb8().tobytes()


@pytest.mark.parametrize(("model", "name"), [*model_fields(Skin), *model_fields(Settings)])
def test_each_setting_reruns_its_stages(renderer: Renderer, model: type[FrozenModel], name: str) -> None:
    if model is Skin:
        before = base(model, name)
        frames = [(replace(BASE, skin=skin), SETTINGS) for skin in (before, changed(before, name))]
    else:
        settings = SETTINGS.model_copy(update=BESIDE.get((model, name), {}))
        frames = [(BASE, one) for one in (settings, changed(settings, name))]
    for order in (frames, frames[::-1]):
        kept, fresh = kept_and_fresh(renderer, *order)
        assert kept == fresh


@pytest.mark.parametrize(
    ("kind", "name"),
    [(kind, name) for kind in LIGHTS for _, name in model_fields(LIGHTS[kind]) if (kind, name) not in FIXED],
)
def test_each_light_change_reruns_its_stages(renderer: Renderer, kind: str, name: str) -> None:
    given = GIVEN.get(kind, {"position": (60.0, 80.0, 300.0)})
    light = LIGHTS[kind](**given)
    lights = [(one, LAMP) for one in (light, changed(light, name))]
    kept, fresh = kept_and_fresh(renderer, *((replace(BASE, lights=both), SETTINGS) for both in lights))
    assert kept == fresh


@pytest.mark.parametrize("name", [name for _, name in model_fields(Camera)])
def test_each_camera_field_reruns_its_stages(renderer: Renderer, name: str) -> None:
    cameras = BASE.camera, changed(BASE.camera, name)
    kept, fresh = kept_and_fresh(renderer, *((replace(BASE, camera=one), SETTINGS) for one in cameras))
    assert kept == fresh


@pytest.mark.parametrize("name", [name for _, name in model_fields(Environment) if name != "name"])
def test_each_environment_field_reruns_its_stages(renderer: Renderer, name: str) -> None:
    environment = Environment(name="uniform")
    both = environment, changed(environment, name)
    kept, fresh = kept_and_fresh(renderer, *((replace(BASE, environment=one), SETTINGS) for one in both))
    assert kept == fresh


SCENES: dict[str, Any] = {
    "head": head_of(uv_sphere(28.0, 20, 10)),
    "lights": (LAMP, PointLight(position=(-90.0, 40.0, 200.0), shadows=False)),
    "camera": front_camera(HEAD, frame_mm=60.0),
    "skin": Skin(specular="none", direction="half-space"),
    "environment": Environment(name="uniform"),
    "pose": Pose(positions_mm=1.1 * HEAD.positions_mm),
}


NEEDS_A_PERSON = {"state"}  # tested in test_living_skin.py


@pytest.mark.parametrize("name", [one.name for one in fields(Scene) if one.name not in NEEDS_A_PERSON])
def test_each_scene_part_reruns_its_stages(renderer: Renderer, name: str) -> None:
    both = BASE, replace(BASE, **{name: SCENES[name]})
    for order in (both, both[::-1]):
        kept, fresh = kept_and_fresh(renderer, *((scene, SETTINGS) for scene in order))
        assert kept == fresh


SPREAD = ("translucency", "diffuse", "combine")  # where light comes from at thin parts is found first
ALIKE = ("diffuse", "translucency", "combine")  # and not again where it comes as before
SEEN = ("shade", "post")
RUNS: dict[str, tuple[Callable[[], tuple[Scene, Settings]], tuple[str, ...]]] = {
    "nothing": (lambda: (BASE, SETTINGS), ()),
    "camera": (lambda: (replace(BASE, camera=SCENES["camera"]), SETTINGS), ("visibility", *SEEN)),
    "one light's place": (
        lambda: (replace(BASE, lights=(changed(LAMP, "position"),)), SETTINGS),
        ("shadows", "irradiance", *SPREAD, *SEEN),
    ),
    "one light's colour": (
        lambda: (replace(BASE, lights=(LAMP.model_copy(update={"irradiance": (3.0, 2.0, 3.0)}),)), SETTINGS),
        ("irradiance", *SPREAD, *SEEN),
    ),
    "exposure": (lambda: (BASE, SETTINGS.model_copy(update={"exposure": 2.0})), ("post",)),
    "metered": (lambda: (BASE, SETTINGS.model_copy(update={"exposure": "auto"})), ("meter", "post")),
    "background": (
        lambda: (BASE, SETTINGS.model_copy(update={"background": "gradient"})),
        ("background", "post"),
    ),
    "profile": (
        lambda: (replace(BASE, skin=Skin(profile="dj3")), SETTINGS),
        ("irradiance", "pairs", *SPREAD, *SEEN),  # how far aside light comes back
    ),
    "roughness": (
        lambda: (replace(BASE, skin=Skin(roughness=0.4)), SETTINGS),
        ("surface", "irradiance", *SPREAD, *SEEN),
    ),
    "mix": (lambda: (replace(BASE, skin=Skin(mix=0.7)), SETTINGS), ("irradiance", *ALIKE, *SEEN)),
    "size": (lambda: (BASE, SETTINGS.model_copy(update={"size": (40, 40)})), ("visibility", *SEEN)),
    "samples": (lambda: (BASE, SETTINGS.model_copy(update={"samples": 2})), ("visibility", *SEEN)),
    "bloom": (lambda: (BASE, SETTINGS.model_copy(update={"bloom": 0.1})), ("bloom", "post")),
}


@pytest.mark.parametrize("change", RUNS)
def test_only_stale_stages_run(renderer: Renderer, change: str) -> None:
    renderer.draw(BASE, SETTINGS)
    make, expected = RUNS[change]
    renderer.draw(*make())
    assert tuple(dict.fromkeys(renderer.graph.executed_stages)) == expected


def test_all_stages_run_when_forced(renderer: Renderer) -> None:
    renderer.clear_cache()
    renderer.draw(BASE, SETTINGS)
    first = list(renderer.graph.executed_stages)
    renderer.draw(BASE, SETTINGS, run_all_passes=True)
    assert renderer.graph.executed_stages == first and "shade" in first


def test_frame_listing_names_stages_and_shaders(renderer: Renderer) -> None:
    """Each stage is listed with its shader, in order; stages that a camera move leaves valid are marked."""
    renderer.draw(BASE, SETTINGS)
    listing = renderer.graph.listing = FrameListing()
    renderer.draw(replace(BASE, camera=SCENES["camera"]), SETTINGS)
    stages = list(dict.fromkeys(one.stage for one in listing.passes))
    assert stages == [
        "shape",
        "shadows",
        "stretch",
        "surface",
        "irradiance",
        "pairs",
        *SPREAD,
        "visibility",
        *SEEN,
    ]
    ran = {one.stage for one in listing.passes if one.ran}
    assert ran == {"visibility", "shade", "post"}
    shade = next(one for one in listing.passes if one.stage == "shade")
    assert shade.shader == "shade" and str(shade.bindings["shade"]).startswith("record ")
    post = listing.passes[-1]
    assert post.bindings["image"] == shade.bindings["image"]  # the one reads what the other wrote
