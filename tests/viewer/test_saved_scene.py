"""A scene saved by the viewer and rendered by `dermis render` gives the same picture."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from offscreen_input import ADAPTER
from PIL import Image
from rigged_head import write_rigged_head

from dermis.apps.viewer.navigation import orbit
from dermis.apps.viewer.session import with_region_table
from dermis.apps.viewer.state import ViewerState, load_state, save_state
from dermis.apps.viewer.view_renderer import ViewRenderer
from dermis.cli import main
from dermis.human.regions.region_table import REGIONS
from dermis.images.io import read_image
from dermis.mesh.pose import Pose
from dermis.scene import Environment, Scene
from dermis.scene.heads import load_head
from dermis.scene.skin import TissueLayer

SIZE = 72, 64
_LAYERS = [
    TissueLayer(
        name="thin", thickness_mm=0.3, absorption_per_mm=(0.1, 0.3, 0.6), scattering_per_mm=(4.0, 5.0, 6.0)
    ),
    TissueLayer(name="deep", absorption_per_mm=(0.01, 0.1, 0.2), scattering_per_mm=(2.0, 3.0, 4.0)),
]
Change = Callable[[ViewerState, Path], ViewerState]


def with_regions(state: ViewerState, folder: Path) -> ViewerState:
    """Return a state with a table of two regions, and with the roughness that the regions do not replace."""
    labels = np.zeros((16, 16), np.uint8)
    labels[8:] = 3
    Image.fromarray(labels).save(folder / "labels.png")
    rows = [f'"{name}" = {{ m = 0.3, rho_s = {0.1 + 0.05 * k:.2f} }}' for k, name in enumerate(REGIONS)]
    (folder / "regions.toml").write_text("\n".join(['labels = "labels.png"', *rows, ""]))
    return with_region_table(state.with_skin(roughness=0.5), str(folder / "regions.toml")).with_skin(
        oiliness=0.7
    )


def with_surface(state: ViewerState, folder: Path) -> ViewerState:
    del folder
    numbers = {"mix": 0.2, "roughness": 0.22, "rho_s": 0.31, "oiliness": 0.4}
    return state.with_skin(**numbers, specular="two-lobe", fresnel="exact", specular_colour="wrong")


def with_light(state: ViewerState, folder: Path) -> ViewerState:
    del folder
    state = state.with_light_preset("window").with_light(
        1, irradiance=(0.5, 1.0, 2.0), shadows=True, softness_mm=9.0
    )
    around = Environment(name="uniform", rotation_degrees=40.0, exposure=0.3)
    return state.with_environment(around).with_camera(orbit(state.scene.camera, 0.6, -0.2))


def with_settings(state: ViewerState, folder: Path) -> ViewerState:
    del folder
    chosen = {"stretch": "axes", "seams": "clear-colour", "seam_colour": (0.9, 0.1, 0.1), "occlusion": "none"}
    encode_image = {"exposure": 1.7, "bloom": 0.2, "tone": "filmic", "background": (0.1, 0.0, 0.3)}
    return state.with_settings(technique="one-blur", transmission="none", **chosen, **encode_image)


def with_expression(state: ViewerState, folder: Path) -> ViewerState:
    file = write_rigged_head(folder / "rigged.glb")
    posed = Scene(load_head(file), pose=Pose({"jawOpen": 0.7}, {"neck": (0.0, 25.0, 5.0)}))
    return replace(state, scene=posed, head={"name": str(file)})


STATES: dict[str, Change] = {
    "surface": with_surface,
    "light": with_light,
    "settings": with_settings,
    "regions": with_regions,
    "layers": lambda state, _: state.with_skin(profile="skin1", albedo="profile", layers=_LAYERS),
    "structure": lambda state, _: state.with_skin(profile="light", albedo="profile").with_pigments(
        structure="donner2008", epidermal_blood=0.02, melanin=0.03
    ),
    "part": lambda state, _: state.with_view("specular"),
    "pose": with_expression,
}


@pytest.fixture(scope="module")
def view_renderer() -> ViewRenderer:
    return ViewRenderer(ADAPTER)


@pytest.mark.parametrize("name", STATES)
def test_the_command_renders_what_the_viewer_shows(
    name: str,
    view_renderer: ViewRenderer,
    state: ViewerState,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("dermis.human.regions.apply.MIN_MAP_SIDE", 64)
    shown = STATES[name](state, tmp_path).with_settings(size=SIZE)
    view_renderer.screenshot(tmp_path / "shown.png", shown, SIZE)
    save_state(tmp_path / "scene.toml", shown)
    words = ["render", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "made.png"), "--adapter", ADAPTER]
    monkeypatch.setattr(sys, "argv", ["dermis", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    seen, made = (read_image(tmp_path / f"{kind}.png") for kind in ("shown", "made"))
    assert seen.std() > 0.02 and np.array_equal(seen, made)


def test_saved_view_is_restored(state: ViewerState, tmp_path: Path) -> None:
    save_state(tmp_path / "scene.toml", state.with_view("specular"))
    loaded = load_state(tmp_path / "scene.toml", state)
    assert loaded.view == "specular" and loaded.settings.parts == "all"
