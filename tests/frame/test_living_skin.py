"""Skin with states and a pulse: the rate is found in pictures, and colours follow the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human, Pulse, Scene, SkinState
from dermis.frame.features.surface.painting import paint
from dermis.frame.renderer import Renderer
from dermis.gpu import Device
from dermis.gpu.graph import FrameListing
from dermis.human.hair.look import HairLook
from dermis.human.skin.surface import painted_surface
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.skin_colours import colour_table
from dermis.scene.lights import studio

ROOT = Path(__file__).parents[2]
Doubles = NDArray[np.float64]
SMALL = {"size": 64, "atlas": 128, "samples": 1, "interreflection": False}
FRAMES_PER_S, RATE = 20.0, 75.0  # 16 frames a beat
FRAMES_PER_BEAT, BEATS = 16, 10


@pytest.fixture(scope="module")
def scene() -> Scene:
    head = replace(Human(hair=HairLook("none")).head(subdivide=0), hair=None)
    return Scene(head, lights=[studio()[0]], camera="headshot")


@pytest.fixture(scope="module")
def still(renderer: Renderer, scene: Scene) -> NDArray[np.float32]:
    return renderer.render(scene, **SMALL)


@pytest.fixture(scope="module")
def traces(renderer: Renderer, scene: Scene, still: NDArray[np.float32]) -> Doubles:
    """Return the mean 8-bit colours (160, 3) of the skin in a clip of ten equal beats."""
    pulse = Pulse(rate_per_min=RATE, head_motion_mm=0)
    scenes = [pulse.scene_at(scene, k / FRAMES_PER_S) for k in range(FRAMES_PER_BEAT)]
    skin = still.sum(axis=-1) > 0.15
    beat = [picture[skin].mean(axis=0) for picture in renderer.render_many(scenes, **SMALL)]
    return np.tile(np.array(beat, np.float64), (BEATS, 1))


@pytest.mark.parametrize("method", ["pos", "chrom"])
def test_the_pulse_rate_is_found_in_pictures_of_8_bits(
    traces: Doubles, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(ROOT / "tools")
    import pulse_rates

    signal = getattr(pulse_rates, method)(traces, FRAMES_PER_S)
    assert pulse_rates.spectral_peak_per_min(signal, FRAMES_PER_S) == pytest.approx(RATE, abs=2)


def test_the_colour_of_the_pulse_is_that_of_measured_pulses(renderer: Renderer, scene: Scene) -> None:
    blood = np.full(16, 0.02)
    rest = renderer.render(scene.replace(state=SkinState(blood=0 * blood)), **SMALL)
    more = renderer.render(scene.replace(state=SkinState(blood=blood)), **SMALL)
    skin = rest.sum(axis=-1) > 0.15
    found = 1 - more[skin].mean(axis=0) / rest[skin].mean(axis=0)
    assert 0.001 < found[1] < 0.008  # of a green value: a part of a level of 8 bits
    measured = np.array([0.33, 0.77, 0.53])  # de Haan and van Leest 2014
    cosine = found @ measured / np.linalg.norm(found) / np.linalg.norm(measured)
    assert np.degrees(np.arccos(cosine)) < 9


def test_small_pulses_are_not_rounded_away(
    renderer: Renderer, scene: Scene, still: NDArray[np.float32]
) -> None:
    skin = still.sum(axis=-1) > 0.15

    def green_change(gain: float) -> float:
        picture = renderer.render(scene.replace(state=SkinState(blood=np.full(16, gain))), **SMALL)
        return float(1 - picture[skin, 1].mean() / still[skin, 1].mean()) / np.log1p(gain)

    assert green_change(0.004) == pytest.approx(green_change(0.1), rel=0.08)


def test_a_state_of_weight_0_changes_no_pixel(
    renderer: Renderer, scene: Scene, still: NDArray[np.float32]
) -> None:
    for state in (SkinState({"blush": 0.0, "exertion": 0.0}), SkinState({}, np.zeros(16))):
        np.testing.assert_array_equal(renderer.render(scene.replace(state=state), **SMALL), still)


def test_the_pulse_repaints_only_the_colour(renderer: Renderer, scene: Scene) -> None:
    pulse = Pulse(head_motion_mm=0)
    settings = {**SMALL, "size": (64, 64)}
    renderer.draw(pulse.scene_at(scene, 0.1), settings, timed=False)
    listing = renderer.graph.listing = FrameListing()
    renderer.draw(pulse.scene_at(scene, 0.2), settings, timed=False)
    ran = {one.shader for one in listing.passes if one.ran}
    assert {"expression", "map_halve"} <= ran
    assert not ran & {
        "expression_relief",
        "zone_sums",
        "living_gloss",
        "relief",
        "skin",
    }


@pytest.fixture(scope="module")
def rest(device: Device, scene: Scene) -> paint.RawPaintedArrays:
    return _painted(device, scene, None)


def _painted(device: Device, scene: Scene, state: SkinState | None) -> paint.RawPaintedArrays:
    surface = painted_surface(scene.head.mesh, scene.head.control_rig.stencils)
    return paint.paint_raw_arrays(device, surface, scene.head.maps.look, 256, state)  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["blush", "pallor"])
def test_colours_of_states_follow_the_model_of_skin(
    device: Device, scene: Scene, rest: paint.RawPaintedArrays, name: str
) -> None:
    look = scene.head.maps.look  # type: ignore[attr-defined]
    found = _painted(device, scene, SkinState({name: 1.0}))
    changed = np.abs(np.log2(found.roughness[..., 3] / rest.roughness[..., 3])) > 0.3
    melanin, before = (rest.roughness[changed][:, k].astype(np.float64) for k in (2, 3))
    after = found.roughness[changed][:, 3].astype(np.float64)
    table = colour_table(
        SkinParameters(eumelanin=look.eumelanin, oxygen=look.oxygen, epidermis_mm=look.epidermis_mm), 193
    )
    truth = table.lookup(melanin, after) / table.lookup(melanin, before)
    ratio = found.colour[changed][:, :3] / rest.colour[changed][:, :3]
    error = np.abs(ratio / truth - 1)
    oxygen = 0.02 if name == "pallor" else 0.0  # pallor changes the oxygen too
    assert np.percentile(error, 95) < 0.01 + oxygen and len(error) > 1000


def test_states_act_where_they_should(device: Device, scene: Scene, rest: paint.RawPaintedArrays) -> None:
    blush, sweat = (_painted(device, scene, SkinState({name: 1.0})) for name in ("blush", "exertion"))
    gain = blush.roughness[..., 3] / rest.roughness[..., 3]
    assert np.percentile(gain, 99) > 1.8 and np.median(gain) < 1.5
    assert (sweat.specular[..., 0] - rest.specular[..., 0]).max() > 0.4
    assert (sweat.roughness[..., 0] - rest.roughness[..., 0]).min() < -0.05
    assert sweat.roughness[..., 0].min() >= rest.roughness[..., 0].min()
    np.testing.assert_array_equal(blush.specular, rest.specular)
    np.testing.assert_array_equal(blush.height_mm, rest.height_mm)


def test_crying_reddens_the_white_of_the_eyes(renderer: Renderer) -> None:
    head = replace(Human(hair=HairLook("none")).head(subdivide=0), hair=None)
    scene = Scene(head, lights=[studio()[0]], camera="portrait")
    near = scene.camera.replace(target=(32.0, 10.0, 60.0), frame_mm=60.0)
    pictures = [
        renderer.observe(
            [scene.replace(camera=near, state={"crying": w})], SMALL, outputs=["label"], linear=True
        )
        for w in (0.0, 1.0)
    ]
    rest, crying = (next(iter(one)) for one in pictures)
    white = np.isin(rest.outputs["label"], (3, 4))  # right_eye, left_eye
    assert white.sum() > 20
    green, red = ([one.picture[white, k].mean() for one in (rest, crying)] for k in (1, 0))
    assert green[1] / red[1] < 0.97 * green[0] / red[0]


def test_frames_after_another_state_equal_those_of_a_fresh_renderer(renderer: Renderer, scene: Scene) -> None:
    states = [None, SkinState({"blush": 0.8}), SkinState({"exertion": 1.0}, np.full(16, 0.05)), None]
    scenes = [replace(scene, state=state) for state in states]
    kept = [renderer.render(one, **SMALL) for one in scenes]
    for picture, one in zip(kept[1:], scenes[1:], strict=True):
        renderer.clear_cache()
        np.testing.assert_array_equal(picture, renderer.render(one, **SMALL))
