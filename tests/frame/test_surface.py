"""Surface settings of the skin in one pixel seen from straight above, against closed forms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import twins
from numpy.typing import NDArray
from setups import front_camera, head_of, run_frame, scene_of
from tolerances import TWIN

from dermis.frame.features.surface import record as surface
from dermis.frame.programs import FEATURES_FOLDER, shader_folders
from dermis.frame.renderer import Renderer
from dermis.gpu import ComputeProgram, download
from dermis.mesh.primitives import plane
from dermis.optics.gaussians import GaussianSum
from dermis.scene.lights import DirectionalLight
from dermis.scene.skin import Skin
from dermis.specular.cosines import cosines
from dermis.specular.fresnel import ENERGY_SCHEMES, FRESNEL
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]
Z = np.array([0.0, 0.0, 1.0])
COLOUR = np.array([0.5, 0.25, 0.75])
PATCH = head_of(plane(100.0), colour=np.broadcast_to(COLOUR, (8, 8, 3)))
SURFACE = FEATURES_FOLDER / "surface/surface.wgsl"
PROFILE = GaussianSum("white", np.array([1.0]), np.ones((1, 3)))
LIGHT = DirectionalLight(direction=(0.6, 0, -1), irradiance=(2.0, 2.0, 2.0), shadows=False)


def pixel(renderer: Renderer, head: Any = PATCH, **skin: Any) -> Floats:
    """Return the (3,) radiance below the camera."""
    scene = scene_of(head, LIGHT, camera=front_camera(head), **skin)
    inputs = run_frame(renderer, scene, size=(1, 1), technique="none")
    return download(renderer.device, inputs.resources.post.picture.exposed).astype(float)[0, 0, :3]


def parts(m: float, rho_s: float, model: str, fresnel: str, energy: str) -> tuple[Floats, float]:
    """Return the (3,) radiance from below the surface, and the reflected radiance."""
    to_light = np.array([-0.6, 0.0, 1.0]) / np.sqrt(1.36)
    arriving, law = 2.0 * to_light[2], ENERGY_SCHEMES[energy]
    entering = law.entering_fraction(twins.surface_albedo([to_light[2]], m, model, fresnel)[0], rho_s)
    leaving = law.exitance_factor(*twins.surface_albedo([1.0], m, model, fresnel), rho_s)
    lobe = MODELS[model].lobe(cosines(Z, to_light, Z), m, FRESNEL[fresnel])
    return arriving * entering * leaving * COLOUR / np.pi, float(arriving * rho_s * lobe)


@pytest.mark.parametrize("energy", ENERGY_SCHEMES)
@pytest.mark.parametrize("fresnel", FRESNEL)
@pytest.mark.parametrize("model", MODELS)
def test_every_surface_option_changes_the_picture(
    renderer: Renderer, model: str, fresnel: str, energy: str
) -> None:
    chosen = {"specular": model, "fresnel": fresnel, "energy": energy}
    below, mirrored = parts(0.4, 0.9, model, fresnel, energy)
    assert mirrored > 20 * TWIN * below.max()  # or the lobe would not be tested
    made = pixel(renderer, roughness=0.4, rho_s=0.9, **chosen)
    assert np.abs(made - below - mirrored).max() < TWIN * made.max()


def test_skin_without_reflection_receives_all_light(renderer: Renderer) -> None:
    made = pixel(renderer, specular="none", rho_s=0.9)
    assert np.abs(made - 2.0 / np.sqrt(1.36) * COLOUR / np.pi).max() < TWIN * made.max()


def test_the_wrong_reflection_has_the_colour_of_the_map(renderer: Renderer) -> None:
    below, mirrored = parts(0.4, 0.9, "kelemen", "schlick", "full")
    made = pixel(renderer, roughness=0.4, rho_s=0.9, specular="kelemen", specular_colour="wrong")
    assert np.abs(made - below - mirrored * COLOUR).max() < TWIN * made.max()


@pytest.mark.parametrize(("oiliness", "m", "rho_s"), [(0.0, 0.4, 0.2), (0.5, 0.32, 0.3), (1.0, 0.24, 0.4)])
def test_oiliness_changes_strength_and_roughness(
    renderer: Renderer, oiliness: float, m: float, rho_s: float
) -> None:
    oily = pixel(renderer, roughness=0.4, rho_s=0.2, oiliness=oiliness)
    assert np.abs(oily - pixel(renderer, roughness=m, rho_s=rho_s)).max() < TWIN * oily.max()


def test_oil_smoothes_a_roughness_map_too(renderer: Renderer) -> None:
    even = {"colour": np.broadcast_to(COLOUR, (8, 8, 3))}
    mapped = head_of(plane(100.0), roughness=np.full((4, 4), 0.5), **even)
    oily, plain = pixel(renderer, mapped, oiliness=1.0, rho_s=0.2), pixel(renderer, roughness=0.3, rho_s=0.4)
    assert np.abs(oily - plain).max() < TWIN * plain.max()


def test_strength_stays_within_one() -> None:
    assert Skin(rho_s=0.9, oiliness=1.0).specular_strength == 1.0
    assert Skin(rho_s=0.9, specular="none").specular_strength == 0.0


class WaxedSkin(Skin):
    """Skin with a field that the package does not know."""

    wax: float = 0.25


def skin_struct(tmp_path: Path, renderer: Renderer, *members: str) -> ComputeProgram:
    """Return a shader with the package's struct `Skin`, with more members at its start."""
    declared = SURFACE.read_text("utf-8").replace("struct Skin {", "\n".join(["struct Skin {", *members]))
    path = tmp_path / "waxed.wgsl"
    path.write_text(f"{declared}\n@compute @workgroup_size(1) fn main() {{}}", "utf-8")
    return ComputeProgram(renderer.device, path, shader_folders())


def test_new_skin_field_fills_the_struct_member_of_its_name(tmp_path: Path, renderer: Renderer) -> None:
    program = skin_struct(tmp_path, renderer, "wax: f32,")
    record = surface.skin_record(program, WaxedSkin(), PATCH.maps, PROFILE, 1)
    assert record["wax"] == 0.25 and record["mix"] == 0.5


def test_every_member_of_the_struct_is_filled_in(tmp_path: Path, renderer: Renderer) -> None:
    skin = Skin(direction="half-space", specular_colour="wrong")  # so that none should be 0
    record = surface.skin_record(skin_struct(tmp_path, renderer), skin, PATCH.maps, PROFILE, 1)
    empty = [name for name in record.dtype.names if not record[name].any()]
    assert empty == ["vellus_per_mm"]  # skin of files has no vellus hair, see test_vellus.py


def test_only_non_default_models_need_another_pipeline() -> None:
    assert surface.surface_constants(Skin()) == surface.surface_constants(Skin(specular="none")) == ()
    assert surface.surface_constants(Skin(specular="phong")) == (("MODEL", 6),)
    assert surface.surface_constants(Skin(fresnel="exact")) == (("EXACT_FRESNEL", 1),)
