"""A light, a lobe and a technique of another package work in files, frames and help."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from outside.chalk import ALBEDO, CHALK
from outside.dim import LEFT, TECHNIQUE
from outside.glow import GLOW
from outside.glow_light import GlowLight
from setups import frontal, head_of, place, scene_of, settings_of
from tolerances import FURNACE, TWIN

from dermis.apps.truths.lights import cycles_lamp
from dermis.base.errors import DermisError
from dermis.frame.lights.kind import KINDS
from dermis.frame.renderer import Renderer
from dermis.mesh.primitives import plane
from dermis.scene.files import load_lights
from dermis.scene.frozen_model import field_choices
from dermis.scene.lights import LIGHTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.sources import picture_citation_keys
from dermis.scene.techniques import TECHNIQUES
from dermis.specular.albedo import directional_albedo
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
FLOOR = head_of(plane(200.0, 4))
HEIGHT, SIZE, FRAME_MM = 150.0, 48, 80.0
COLOUR = 0.8  # of skin without a map
FILE = """
[[lights]]
kind = "after-glow"
position = {position}
target = {target}
irradiance = [3, 2, 1]
power = 6
"""


@pytest.fixture
def glow() -> Iterator[None]:
    with LIGHTS.temporary_entry("after-glow", GlowLight), KINDS.temporary_entry("after-glow", GLOW):
        yield


@pytest.fixture
def chalk() -> Iterator[None]:
    with MODELS.temporary_entry("blue-chalk", CHALK):
        yield


def picture(renderer: Renderer, *lights: object, parts: str = "all", **skin: object) -> Floats:
    """Return the (n, n, 3) radiance of the floor, which does not scatter."""
    settings = settings_of(size=(SIZE, SIZE), technique="none", parts=parts)
    scene = scene_of(FLOOR, *lights, **skin)  # type: ignore[arg-type]
    return renderer.draw(scene, settings).linear().astype(float)


def radius_mm() -> Floats:
    """Return the (n, n) distances of the pixels' positions from the middle of the floor."""
    along = ((np.arange(SIZE) + 0.5) / SIZE - 0.5) * FRAME_MM
    return np.asarray(np.hypot(*np.meshgrid(along, along)))


def from_file(folder: Path) -> GlowLight:
    path = folder / "glow.toml"
    above, middle = (list(place(FLOOR, (0, 0, height))) for height in (HEIGHT, 0))
    path.write_text(FILE.format(position=above, target=middle), encoding="utf-8")
    (light,) = load_lights(str(path))
    assert isinstance(light, GlowLight)
    return light


@pytest.mark.usefixtures("glow")
@pytest.mark.parametrize("shadows", [False, True])
def test_plugin_light_matches_its_formula(renderer: Renderer, tmp_path: Path, shadows: bool) -> None:
    """Compare with E cos^(power + 3), with E at the middle of an unoccluded floor."""
    light = from_file(tmp_path).model_copy(update={"shadows": shadows})
    made = picture(renderer, light, specular="none")
    cosine = HEIGHT / np.hypot(HEIGHT, radius_mm())
    exact = COLOUR / np.pi * np.array([3.0, 2.0, 1.0]) * cosine[..., None] ** (6 + 3)
    assert np.abs(made - exact).max() < 5 * TWIN * exact.max()
    assert exact.min() < 0.8 * exact.max()


@pytest.mark.usefixtures("glow")
def test_plugin_light_is_drawn_with_other_lights(renderer: Renderer, tmp_path: Path) -> None:
    light, other = from_file(tmp_path), frontal(1.0)
    apart = picture(renderer, light, specular="none") + picture(renderer, other, specular="none")
    assert np.abs(picture(renderer, other, light, specular="none") - apart).max() < TWIN * apart.max()


@pytest.mark.usefixtures("glow")
def test_plugin_light_is_cited_and_refused_by_cycles(tmp_path: Path) -> None:
    light = from_file(tmp_path)
    assert "Phong1975" in picture_citation_keys(Skin(specular="none"), Settings(), [light])
    with pytest.raises(DermisError, match=r"light of Cycles: expected one of point, .*got 'after-glow'"):
        cycles_lamp(light, 1)


def test_plugin_name_is_unknown_without_the_plugin(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"a kind of point, .*got 'after-glow'"):
        from_file(tmp_path)
    with pytest.raises(DermisError, match=r"one of two-lobe, kelemen, .*none, but got 'blue-chalk'"):
        Skin(specular="blue-chalk")


@pytest.mark.usefixtures("chalk")
def test_plugin_lobe_matches_its_formula(renderer: Renderer) -> None:
    """The lobe reflects half of rho_s at every angle; the rest of the light enters and leaves again."""
    irradiance, rho_s = 3.0, 0.4
    skin = {"specular": "blue-chalk", "rho_s": rho_s}
    light = frontal(irradiance)
    reflected = picture(renderer, light, parts="specular", **skin)
    assert np.abs(reflected - rho_s * ALBEDO / np.pi * irradiance).max() < TWIN
    entered = (1 - rho_s * ALBEDO) * COLOUR / np.pi * irradiance
    below = picture(renderer, light, parts="diffuse", **skin)
    assert np.abs(below - entered).max() < FURNACE * entered


@pytest.mark.usefixtures("chalk")
def test_plugin_lobe_is_known_to_other_modules() -> None:
    assert field_choices(Skin, "specular")[-2:] == ("blue-chalk", "none")
    assert "Phong1975" in picture_citation_keys(Skin(specular="blue-chalk"), Settings())
    assert directional_albedo([0.2, 0.9], 0.3, MODELS["blue-chalk"].lobe) == pytest.approx(ALBEDO, rel=1e-4)


def test_plugin_technique_is_drawn(renderer: Renderer) -> None:
    """The technique is rendered, cited and offered like the package's own, with frames of its own."""

    def below(technique: str) -> Floats:
        scene = scene_of(FLOOR, frontal(), specular="none")
        settings = settings_of(size=(SIZE, SIZE), technique=technique, transmission="none")
        return renderer.draw(scene, settings).linear().astype(float)

    with TECHNIQUES.temporary_entry("dim", TECHNIQUE):
        assert "dim" in field_choices(Settings, "technique")
        assert "Borshukov2003" in picture_citation_keys(Skin(), Settings(technique="dim"))
        dimmed = below("dim")
        assert "dim" in renderer.graph.executed_stages
        middle = (slice(8, -8),) * 2  # away from the map's edges
        assert dimmed[middle] == pytest.approx(LEFT * below("none")[middle], rel=TWIN)
    with pytest.raises(DermisError, match="technique"):
        Settings(technique="dim")
