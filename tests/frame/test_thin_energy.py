"""Energy of thin parts: they emit no more light than they receive, and transmit as slabs of their medium."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import head_of, run_frame, scene_of
from tolerances import WHITE_THIN

from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import wedge
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import published_media
from dermis.optics.profiles import write_profile
from dermis.optics.slabs import solve_slabs
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float64]
WHITE = np.ones((4, 4, 3))
BODY = published_media()["skin1"].with_eta(1.0)


@pytest.fixture(scope="module")
def skin1(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return a file of the profile of skin1."""
    file: Path = tmp_path_factory.mktemp("profile") / "skin1.toml"
    write_profile(
        file, fit_gaussians(diffusion_profile(BODY).ring_target(), 6, profile_name="skin1").profile, {}
    )
    return str(file)


def left(renderer: Renderer, mesh: Mesh, *lights: DirectionalLight, around: Any = None, **skin: Any) -> Any:
    """Return the (n, 3) diffuse light that leaves the upper and the lower face of a slab far from its rim."""
    scene = replace(scene_of(head_of(mesh, colour=WHITE), *lights, rho_s=0.0, **skin), environment=around)
    inputs = run_frame(renderer, scene, atlas=192, occlusion="none")
    texels = download(renderer.device, inputs.layouts[0].atlas.resources["atlas"])
    light = download(renderer.device, inputs.resources.scattered)[..., :3].astype(float)
    own = texels[..., 0] > 0
    w = np.stack([texels[own][:, 1] & 0xFFFF, texels[own][:, 1] >> 16], axis=-1) / 65535.0
    w = np.column_stack([1 - w.sum(axis=1), w])
    corners = mesh.triangles[texels[own][:, 0].astype(int) - 1]
    points, normals = (np.einsum("nk,nkc->nc", w, a[corners]) for a in (mesh.positions, mesh.normals))
    inner = np.abs(points[:, :2]).max(axis=1) < 8.0
    return [light[own][inner & (sign * normals[:, 2] > 0.9)] for sign in (1.0, -1.0)]


@pytest.mark.parametrize("direction", ["lambertian", "half-space"])
def test_white_slab_passes_the_furnace_test(renderer: Renderer, direction: str) -> None:
    """In uniform light it emits what it receives, without the light that half-spaces transmit unscattered."""
    uniform = Environment(name="uniform")
    thick, thin = (
        np.concatenate(left(renderer, wedge(40.0, d, d), around=uniform, direction=direction))
        for d in (30.0, 1.0)
    )
    share, half_space = thin / thick.mean(axis=0), direction == "half-space"
    assert share.max() < 1.0 + (3.0 if half_space else 1.0) * WHITE_THIN
    assert share.min() > 1.0 - (0.1 if half_space else WHITE_THIN)


@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_thin_half_space_skin_transmits_like_its_medium(
    renderer: Renderer, skin1: str, degrees: float
) -> None:
    """Compare red and green light on both faces with the exact slab."""
    angle = np.radians(degrees)
    way = (float(np.sin(angle)), 0.0, float(np.cos(angle)))
    lamp = DirectionalLight(direction=way, irradiance=(1.0, 1.0, 1.0), shadows=False)
    layer, cosine = BODY.layers[0], float(np.cos(angle))
    for thickness in (1.0, 3.0):
        mesh = wedge(40.0, thickness, thickness)
        skin = {"albedo": "profile", "profile": skin1, "direction": "half-space", "specular": "none"}
        through, back = (face.mean(axis=0) / cosine for face in left(renderer, mesh, lamp, **skin))
        for c in range(2):
            made = solve_slabs(float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c]) * thickness, 1.0)
            exact = [np.interp(cosine, made.cosine, part[0]) for part in (made.transmitted, made.reflected)]
            assert through[c] == pytest.approx(exact[0], rel=0.15)
            assert back[c] == pytest.approx(exact[1], rel=0.25)


@pytest.mark.parametrize("degrees", [0.0, 60.0])
def test_flesh_that_scatters_forward_lets_more_through(
    renderer: Renderer, skin1: str, degrees: float
) -> None:
    """Compare with the exact slab, which transmits twice as much red light as an isotropic one."""
    angle = np.radians(degrees)
    way = (float(np.sin(angle)), 0.0, float(np.cos(angle)))
    lamp = DirectionalLight(direction=way, irradiance=(1.0, 1.0, 1.0), shadows=False)
    skin = {"albedo": "profile", "profile": skin1, "direction": "half-space", "specular": "none"}
    layer, cosine = BODY.layers[0], float(np.cos(angle))
    for thickness, more in ((1.0, 1.5), (3.0, 1.05)):
        mesh = wedge(40.0, thickness, thickness)
        even, forward = (
            float(left(renderer, mesh, lamp, anisotropy=g, **skin)[0][:, 0].mean()) / cosine
            for g in (0.0, 0.8)
        )
        made = solve_slabs(float(layer.alpha_prime[0]), float(layer.sigma_t_prime[0]) * thickness, 1.0, g=0.8)
        assert forward == pytest.approx(float(np.interp(cosine, made.cosine, made.transmitted[0])), rel=0.12)
        assert forward > more * even


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("direction", ["lambertian", "half-space"])
def test_unscattered_colour_is_not_transmitted(renderer: Renderer, tmp_path: Path, direction: str) -> None:
    """All blue light is in the unblurred Gaussian, so that thin parts lose none of it."""
    weight = np.array([[0.2, 0.2, 0.3], [0.2, 0.1, 0.0], [0.2, 0.1, 0.0]])
    write_profile(tmp_path / "red.toml", GaussianSum("red", np.array([1e-4, 0.5, 4.0]), weight), {})
    skin = {"albedo": "profile", "profile": str(tmp_path / "red.toml"), "direction": direction}
    lamp = DirectionalLight(direction=(0.0, 0.0, -1.0), irradiance=(1.0, 1.0, 1.0), shadows=False)
    thick, thin = (left(renderer, wedge(40.0, d, d), lamp, specular="none", **skin) for d in (30.0, 1.0))
    (lit, _), (thinly, behind) = thick, thin
    assert np.isfinite(thinly).all() and np.isfinite(behind).all()
    assert behind[:, 0].min() > 1e-3 and behind[:, 2].max() < 1e-6
    assert thinly[:, 2] == pytest.approx(lit[:, 2].mean(), rel=1e-2)
