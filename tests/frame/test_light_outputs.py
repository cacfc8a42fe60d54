"""Outputs of light and skin: parts of the picture, shadows, pigments, thickness."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import front_camera, frontal, head_of, joined, place, scene_of, settings_of

from dermis.base.errors import DermisError
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.mesh.primitives import plane, uv_sphere, wedge
from dermis.scene import Camera, Environment, load_lights
from dermis.scene.lights import DirectionalLight, PointLight, RectangleLight
from dermis.scene.model import Scene
from dermis.scene.techniques import TECHNIQUES

Arrays = dict[str, NDArray[Any]]
SUM = 1e-6
"""Parts of the picture against the whole, of the brightest pixel: the order in which floats are added."""

COLOURS = 0.2 + 0.6 * np.random.default_rng(3).random((16, 16, 3))
BALL = head_of(uv_sphere(30.0, 32, 16), colour=COLOURS)
SIDE = DirectionalLight(direction=(-2, -1, -1), irradiance=(3.0, 2.0, 1.0), shadows=False)
BEHIND = DirectionalLight(direction=(0, 0, 1), irradiance=(2.0, 2.0, 2.0))
SCENE = scene_of(BALL, SIDE, frontal(1.0, shadows=True), camera=front_camera(BALL))
SLAB_MM = 3.0
SLAB = head_of(wedge(40.0, SLAB_MM, SLAB_MM))
LIT_THROUGH = scene_of(SLAB, BEHIND, camera=front_camera(SLAB, frame_mm=30.0))
PARTS = ("albedo", "irradiance", "diffuse", "specular")


def found(renderer: Renderer, scene: Scene, *names: str, **given: Any) -> Arrays:
    """Return the outputs by name, and the picture as "linear"."""
    rendered = renderer.draw(scene, settings_of(**given), outputs=names)
    return {name: rendered.output(name).astype(float) for name in names} | {"linear": rendered.linear()}


@pytest.mark.parametrize("technique", TECHNIQUES.names)
def test_diffuse_and_specular_add_up_to_the_picture(renderer: Renderer, technique: str) -> None:
    for scene in (SCENE, SCENE.replace(skin={"direction": "half-space", "specular_colour": "wrong"})):
        got = found(renderer, scene, *PARTS, technique=technique, seams="stitch")
        off = np.abs(got["diffuse"] + got["specular"] - got["linear"])
        assert off.max() < SUM * got["linear"].max()
        assert min(got[name].max() for name in PARTS) > 0.05 and min(got[name].min() for name in PARTS) >= 0


@pytest.mark.parametrize("technique", ["texture-space", "screen-space", "none"])
def test_light_outputs_include_all_lights_at_one_sample(renderer: Renderer, technique: str) -> None:
    one = found(renderer, SCENE, *PARTS, technique=technique)
    many = found(renderer, SCENE, *PARTS, technique=technique, samples=4, parts="specular", exposure=2.0)
    for name in PARTS:
        assert np.array_equal(one[name], many[name]), name


def test_dry_skin_gives_back_its_albedo(renderer: Renderer) -> None:
    got = found(
        renderer, SCENE.replace(skin={"energy": "none", "direction": "lambertian"}), *PARTS, technique="none"
    )
    scale = got["diffuse"].max()
    assert np.abs(np.pi * got["diffuse"] - got["irradiance"] * got["albedo"]).max() < 1e-5 * scale


def test_albedo_and_irradiance_do_not_depend_on_the_profile(renderer: Renderer) -> None:
    dry, *others = (
        found(renderer, SCENE, *PARTS, technique=one, seams="stitch")
        for one in ("none", "texture-space", "screen-space", "pre-integrated")
    )
    for other in others:
        for name in ("albedo", "irradiance"):
            assert np.abs(other[name] - dry[name]).max() < SUM * dry[name].max()
        assert np.abs(other["diffuse"] - dry["diffuse"]).max() > 1e-3


def test_albedo_comes_from_the_map_or_the_profile(renderer: Renderer) -> None:
    flat = head_of(plane(60.0), colour=np.broadcast_to([0.5, 0.25, 0.75], (8, 8, 3)))
    scene = scene_of(flat, frontal(), camera=front_camera(flat, frame_mm=40.0))
    for technique in ("none", "texture-space"):
        got = found(renderer, scene, "albedo", "irradiance", technique=technique)
        assert np.abs(got["albedo"] - [0.5, 0.25, 0.75]).max() < 1e-3
        assert 2.5 < got["irradiance"].min() <= got["irradiance"].max() <= 3.0
    pale = found(renderer, scene.replace(skin={"albedo": "profile", "profile": "light"}), "albedo")["albedo"]
    dark = found(renderer, scene.replace(skin={"albedo": "profile", "profile": "dark"}), "albedo")["albedo"]
    assert (dark < 0.6 * pale).all() and pale.max() < 1


@pytest.mark.parametrize("technique", ["texture-space", "gpu-gems-3"])
def test_thin_parts_return_less_without_translucency(
    renderer: Renderer, close: float, technique: str
) -> None:
    given = {"technique": technique, "seams": "stitch"}
    thin = found(renderer, LIT_THROUGH, "diffuse", "translucent", **given)
    thick = found(renderer, LIT_THROUGH, "diffuse", transmission="none", **given)
    scale = thin["diffuse"].max()
    assert thin["translucent"].max() > 0.5 * scale > 0
    returned = thin["diffuse"] - thin["translucent"]
    assert (returned > -close * scale).all() and (returned < thick["diffuse"] + close * scale).all()
    assert (thin["translucent"] <= thin["diffuse"] + SUM * scale).all()


def test_transmitted_light_of_two_layouts_is_blended(renderer: Renderer, close: float) -> None:
    thin = found(renderer, LIT_THROUGH, "diffuse", "translucent", seams="multi-uv")
    thick = found(renderer, LIT_THROUGH, "diffuse", seams="multi-uv", transmission="none")
    scale, returned = thin["diffuse"].max(), thin["diffuse"] - thin["translucent"]
    assert (returned > -close * scale).all() and (returned < thick["diffuse"] + close * scale).all()


def test_visibility_is_0_for_a_light_behind_and_1_in_front(renderer: Renderer) -> None:
    scene = scene_of(BALL, BEHIND, frontal(shadows=True), camera=front_camera(BALL))
    got = found(renderer, scene, "visibility", "irradiance", size=(64, 64), shadow_size=512)
    behind, before = np.moveaxis(got["visibility"], -1, 0)
    seen = got["irradiance"].any(axis=-1)
    inner = seen & np.roll(seen, 2, 0) & np.roll(seen, -2, 0) & np.roll(seen, 2, 1) & np.roll(seen, -2, 1)
    assert seen.sum() > 500 and not behind[inner].any() and before[inner].min() > 1 - SUM
    assert not got["visibility"][~seen].any()


def test_irradiance_is_positive_where_a_light_is_visible(renderer: Renderer) -> None:
    """A wall behind a small ball has hard and soft shadows, also of a lamp that is shaded in parts."""
    ball = uv_sphere(8.0, 24, 12), (0, 0, 30), (0.5, 0, 0.5)
    head = head_of(joined((plane(120.0, 8), (0, 0, 0), (0, 0, 0.5)), ball))
    camera, where = front_camera(head, (-20, 0, 0), 60.0), place(head, (40, 0, 160))
    lamps = [
        PointLight(position=where, target=place(head, (0, 0, 0)), softness_mm=0.01),
        RectangleLight(position=where, target=place(head, (0, 0, 0)), width_mm=150.0, height_mm=150.0),
    ]
    for lamp in lamps:
        scene = scene_of(head, lamp, camera=camera)
        alone = found(renderer, scene, "visibility", "irradiance", shadow_size=512, interreflection=False)
        shown = alone["visibility"][..., 0]
        assert alone["visibility"].shape[-1] == 1 and shown.max() == pytest.approx(1, abs=SUM)
        assert shown.min() < (0.6 if lamp is lamps[1] else 0.1)
        assert np.array_equal(shown > 0, alone["irradiance"][..., 0] > 0)
        soft = ((shown > 0.05) & (shown < 0.95)).mean()
        assert soft > 0.2 if lamp is lamps[1] else soft < 0.1
    both = found(renderer, scene_of(head, *lamps[::-1], camera=camera), "visibility", shadow_size=512)
    assert both["visibility"].shape[-1] == 2
    assert np.abs(both["visibility"][..., 0] - shown).max() < 1e-6


def test_thickness_of_a_slab_and_a_ball_is_exact(renderer: Renderer) -> None:
    slab = found(renderer, LIT_THROUGH, "thickness", seams="stitch", atlas=128)["thickness"]
    assert slab[12:-12, 12:-12] == pytest.approx(SLAB_MM, abs=0.02)
    small = head_of(uv_sphere(2.5, 24, 12))
    scene = scene_of(small, frontal(), camera=front_camera(small, frame_mm=2.0))
    assert found(renderer, scene, "thickness", seams="stitch")["thickness"] == pytest.approx(5.0, abs=0.4)


def test_thickness_ends_where_no_light_passes(renderer: Renderer) -> None:
    """The thickness of a wedge is exact up to the reach of the light."""
    head = head_of(wedge(60.0, 1.0, 16.0, cells_per_side=8))
    scene = scene_of(head, frontal(), camera=front_camera(head, frame_mm=80.0))
    got = found(renderer, scene, "thickness", seams="stitch", atlas=256, size=(80, 80))["thickness"]
    row = got[40, 12:68].astype(float)
    true = 1.0 + 15.0 * (np.arange(12, 68) + 0.5 - 10) / 60
    reach = row.max()
    assert 8 < reach < 9.5 and not got[:, :8].any() and got[40, 56] == pytest.approx(reach, abs=0.1)
    thin = true < 0.6 * reach
    assert np.abs(row - true)[thin].max() < 0.35 and (np.diff(row)[thin[1:]] > 0).all()


def test_outputs_do_not_change_the_picture(renderer: Renderer) -> None:
    names = ("diffuse", "specular", "translucent", "visibility", "thickness")
    bare = renderer.draw(LIT_THROUGH, settings_of(samples=4, seams="stitch")).linear()
    with_them = found(renderer, LIT_THROUGH, *names, samples=4, seams="stitch")["linear"]
    again = renderer.draw(LIT_THROUGH, settings_of(samples=4, seams="stitch")).linear()
    assert np.array_equal(bare, with_them) and np.array_equal(bare, again)


def test_outputs_follow_a_changed_light(renderer: Renderer, close: float) -> None:
    """Passes that were skipped in a frame without outputs run for the next one."""
    names = ("diffuse", "translucent", "thickness")
    given = {"seams": "stitch", "technique": "texture-space"}
    first = found(renderer, LIT_THROUGH, *names, **given)
    brighter = LIT_THROUGH.replace(lights=[BEHIND.model_copy(update={"irradiance": (4.0, 4.0, 4.0)})])
    renderer.draw(brighter, settings_of(**given))
    second = found(renderer, brighter, *names, **given)
    assert np.abs(second["translucent"] - 2.0 * first["translucent"]).max() < close * second["diffuse"].max()
    assert np.array_equal(first["thickness"], second["thickness"]) and first["translucent"].max() > 0


@pytest.fixture(scope="module")
def face(renderer: Renderer) -> tuple[Human, Arrays]:
    """Return a person's eyes and open mouth."""
    person = Human.sampled(5)
    camera = Camera(position=(0, -30, 600), target=(0, -30, 80), frame_mm=130.0)
    scene = Scene(person.head(), camera=camera, lights=load_lights("studio"), pose={"jawOpen": 0.4})
    names = (*PARTS, "melanin", "blood", "triangle")
    return person, found(renderer, scene, *names, size=(96, 96), atlas=256, strands=False, seams="stitch")


def test_pigments_are_those_of_the_person(face: tuple[Human, Arrays]) -> None:
    person, got = face
    head = person.head()
    look, material = head.maps.look, head.mesh.material[np.maximum(got["triangle"], 0).astype(int)]
    skin = (got["triangle"] >= 0) & (material == [one.name for one in head.mesh.materials].index("skin"))
    for name, share in (("melanin", look.melanin), ("blood", look.blood)):
        assert np.median(got[name][skin]) == pytest.approx(share, rel=0.35)
        assert not got[name][~skin].any() and (got[name][skin] > 0).all() and got[name].max() <= 1
    lips = got["blood"] > 2.5 * look.blood
    assert 0.01 < lips[skin].mean() < 0.2


def test_eyes_and_teeth_have_specular_outputs(face: tuple[Human, Arrays]) -> None:
    person, got = face
    mesh = person.head().mesh
    names = [one.name for one in mesh.materials]
    material = mesh.material[np.maximum(got["triangle"], 0).astype(int)]
    skin = got["albedo"][(got["triangle"] >= 0) & (material == names.index("skin"))]
    for eye in ("left eye", "right eye"):
        seen = (got["triangle"] >= 0) & (material == names.index(eye))
        white = np.percentile(got["albedo"][seen], 90, axis=0)
        assert seen.sum() > 10 and 0.35 < white.min() <= white.max() < 0.6
        assert white[2] > np.median(skin, axis=0)[2] and got["albedo"][seen].min() < 0.1
        assert got["specular"][seen].max() > 0.01 and got["irradiance"][seen].max() > 0.5
    both = np.abs(got["diffuse"] + got["specular"] - got["linear"])
    assert both.max() < SUM * got["linear"].max()


def test_uniform_skin_has_uniform_pigments(renderer: Renderer) -> None:
    medium = found(renderer, SCENE.replace(skin={"profile": "medium"}), "melanin", "blood")
    assert set(np.unique(medium["melanin"])) == {0.0, np.float32(0.15)}
    assert set(np.unique(medium["blood"])) == {0.0, np.float32(0.01)}
    given = {"profile": "light", "pigments": {"melanin": 0.3}}
    assert found(renderer, SCENE.replace(skin=given), "melanin")["melanin"].max() == np.float32(0.3)


@pytest.mark.parametrize("name", ["melanin", "blood"])
def test_skin_without_pigments_is_refused(renderer: Renderer, name: str) -> None:
    with pytest.raises(DermisError, match=rf"output {name}: expected a person's painted skin, .* gpu-gems-3"):
        found(renderer, SCENE, "depth", name)


@pytest.mark.parametrize("name", ["translucent", "thickness"])
def test_thickness_of_opaque_skin_is_refused(renderer: Renderer, name: str) -> None:
    for given in ({"technique": "none"}, {"technique": "screen-space"}, {"transmission": "none"}):
        with pytest.raises(DermisError, match=rf"output {name}: expected light that passes thin parts"):
            found(renderer, SCENE, name, **given)


def test_visibility_without_lights_is_refused(renderer: Renderer) -> None:
    scene = SCENE.replace(lights=(), environment=Environment(name="uniform"))
    with pytest.raises(DermisError, match="output visibility: expected a scene with lights"):
        found(renderer, scene, "visibility")
