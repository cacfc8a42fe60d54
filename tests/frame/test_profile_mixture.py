"""Skin of mixed profiles, compared with a full sum over the plane in float64."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import entered_light, frontal, head_of, run_frame, scene_of, settings_of

from dermis.base.errors import DermisError
from dermis.frame.features.diffusion.mixture import load_blend_weights
from dermis.frame.inputs import FrameInputs
from dermis.frame.renderer import Renderer
from dermis.gpu import download
from dermis.images.io import write_png
from dermis.mesh.primitives import plane
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.model import Scene

Floats = NDArray[np.float64]
SIDE, SIZE_MM = 128, 32.0
INSIDE = slice(32, 96)
DIFFUSE: dict[str, Any] = {"specular": "none", "energy": "none", "mix": 1.0, "profile": "skin1"}
MIXED, MIXED_RMS = {1: 0.014, 2: 0.06}, {1: 0.002, 2: 0.004}
"""Of the brightest, by how many others there are: shared Gaussians stand for each profile's own, and narrow
ones are a texel wide; six of them follow the photons of two media, but hardly a third profile too."""
KEPT_EVEN, KEPT = 1e-3, 0.01


@pytest.fixture(scope="module")
def maps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write a mask with a sharp and a soft edge, and one of two other profiles."""
    folder = tmp_path_factory.mktemp("masks")
    x = np.linspace(-1.0, 1.0, SIDE)
    one = np.where(x[:, None] < 0.1, x[None] > 0.0, np.clip(0.5 + x[None], 0.0, 1.0))
    two = np.stack([one, 1.0 - one, 0.0 * one], axis=-1)
    found = {"one": folder / "one.png", "two": folder / "two.png"}
    write_png(found["one"], np.round(255 * one).astype(np.uint8))
    write_png(found["two"], np.round(255 * two).astype(np.uint8))
    return found


def lit_scene(**skin: Any) -> Scene:
    """Return a scene of a plane that light enters in random patches."""
    patches = np.random.default_rng(5).random((SIDE // 8, SIDE // 8, 3)).repeat(8, axis=0).repeat(8, axis=1)
    return scene_of(head_of(plane(SIZE_MM), colour=0.05 + 0.9 * patches**4), frontal(), **(DIFFUSE | skin))


def lights(renderer: Renderer, scene: Scene) -> tuple[FrameInputs, Floats, Floats]:
    """Draw a frame, and return its inputs and the (n, n, 3) light that enters and leaves the plane."""
    inputs = run_frame(renderer, scene, atlas=SIDE)
    leaves = download(renderer.device, inputs.resources.scattered).astype(float)
    return inputs, entered_light(renderer, inputs)[..., :3], leaves[..., :3]


def pictured(renderer: Renderer, scene: Scene, **settings: Any) -> Floats:
    given = settings_of(atlas=SIDE, **settings)
    return np.asarray(renderer.draw(scene, given).linear(), np.float64)


def spread(light: Floats, variance_mm2: float) -> Floats:
    """Return (n, n, 3) light after a Gaussian blur with exact integrals over texels; the edge is repeated.

    Gaussians narrower than 0.1 mm are evaluated in the picture and not blurred.
    """
    from scipy.special import ndtr

    if variance_mm2 < 0.1**2:
        return light
    edges = np.arange(SIDE + 1.0)
    edges[[0, -1]] = -np.inf, np.inf
    from_here = (edges - np.arange(SIDE)[:, None] - 0.5) * SIZE_MM / SIDE
    along = np.diff(ndtr(from_here / np.sqrt(variance_mm2)), axis=1)
    return np.asarray(np.einsum("yj,jic,xi->yxc", along, light, along, optimize=True))


def solved(light: Floats, profiles: list[GaussianSum], shares: Floats) -> Floats:
    """Return the light that leaves by the texels' own profiles: (w(x) + w(y)) / 2 of each Gaussian."""
    found = np.zeros_like(light)
    for profile, share in zip(profiles, np.moveaxis(shares, -1, 0)[..., None], strict=True):
        for variance, weight in zip(profile.variance_mm2, profile.weight / profile.albedo, strict=True):
            found += 0.5 * weight * (share * spread(light, variance) + spread(share * light, variance))
    return found


def mixed_by(name: Path, *others: str) -> dict[str, Any]:
    return {"profile_map": str(name), "other_profiles": others}


def mixed(renderer: Renderer, scene: Scene, name: Path, others: int) -> tuple[Floats, Floats, Floats]:
    """Return light that enters, light that leaves with the unblurred level, and the blend weights."""
    inputs, light, made = lights(renderer, scene)
    shares = load_blend_weights(str(name)).astype(float)
    changes = inputs.view["unblurred_differences"][:others, :3]
    return light, made + light * (inputs.view["unblurred_weight"] + shares[..., :others] @ changes), shares


@pytest.mark.parametrize("others", [("skin2",), ("skin2", "gpu-gems-3")])
def test_mixture_matches_the_sum_over_the_plane(
    renderer: Renderer, maps: dict[str, Path], others: tuple[str, ...]
) -> None:
    name = maps["one" if len(others) == 1 else "two"]
    light, made, shares = mixed(renderer, lit_scene(**mixed_by(name, *others)), name, len(others))
    parts = np.dstack([1.0 - shares.sum(axis=-1), shares])[..., : 1 + len(others)]
    true = solved(light, [load_profile(one) for one in ("skin1", *others)], parts)
    off = (made - true)[INSIDE, INSIDE] / true.max()
    assert np.abs(off).max() < MIXED[len(others)]
    assert np.sqrt((off**2).mean()) < MIXED_RMS[len(others)]


def test_mixture_conserves_energy(renderer: Renderer, maps: dict[str, Path]) -> None:
    """All uniform light leaves again for any map, and patches of light lose or gain little."""
    even = scene_of(head_of(plane(SIZE_MM)), frontal(), **DIFFUSE, **mixed_by(maps["one"], "skin2"))
    entered, left, _ = mixed(renderer, even, maps["one"], 1)
    assert left.sum() == pytest.approx(entered.sum(), rel=KEPT_EVEN)
    entered, left, _ = mixed(renderer, lit_scene(**mixed_by(maps["one"], "skin2")), maps["one"], 1)
    assert left.sum() == pytest.approx(entered.sum(), rel=KEPT)


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str]:
    """Write two profiles of the same Gaussians, whose narrowest one is not blurred."""
    folder = tmp_path_factory.mktemp("tables")
    rows = {"narrow": ("0.006,0.7,0.8,0.9", "4,0.3,0.2,0.1"), "wide": ("0.006,0.2,0.5,0.6", "4,0.8,0.5,0.4")}
    for name, lines in rows.items():
        text = "\n".join(["variance_mm2,red,green,blue", *lines])
        (folder / f"{name}.csv").write_text(text)
    return str(folder / "narrow.csv"), str(folder / "wide.csv")


@pytest.mark.parametrize("seams", ["stitch", "multi-uv"])
def test_mixture_of_equal_profiles_or_one_profile_is_that_profile(
    renderer: Renderer, maps: dict[str, Path], tables: tuple[str, str], seams: str
) -> None:
    """A mixture of equal profiles is that profile, and a map of ones gives the other profile."""
    narrow, wide = tables
    full = maps["one"].with_name("full.png")
    write_png(full, np.full((4, 4, 1), 255, np.uint8))
    cases = {narrow: mixed_by(maps["one"], narrow), wide: mixed_by(full, wide)}
    for name, mixed in cases.items():
        alone = pictured(renderer, lit_scene(profile=name), seams=seams)
        made = pictured(renderer, lit_scene(profile=narrow, **mixed), seams=seams)
        assert np.abs(made - alone).max() < 1e-6 * alone.max()


def test_other_techniques_use_the_first_profile(renderer: Renderer, maps: dict[str, Path]) -> None:
    plain, mixed = (
        pictured(renderer, lit_scene(**one), technique="screen-space")
        for one in ({}, mixed_by(maps["one"], "skin2"))
    )
    assert np.array_equal(plain, mixed)


@pytest.mark.parametrize(
    ("skin", "told"),
    [
        ({"other_profiles": ("skin2",)}, "there is no map"),
        ({"profile_map": "mask.png"}, "there is only a map"),
        ({"other_profiles": ("skin2",), "profile_map": "none.png"}, "there is no such file"),
        ({"other_profiles": ("no such",), "profile_map": "mask.png"}, "no such"),
    ],
)
def test_invalid_mixtures_are_refused(renderer: Renderer, skin: dict[str, Any], told: str) -> None:
    with pytest.raises(DermisError, match=told):
        pictured(renderer, lit_scene(**skin))
