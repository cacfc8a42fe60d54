"""Isotropic approximations of lobes compared with sums over the whole lobe."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis.environment import isotropic_fits
from dermis.environment.isotropic_fits import LOBE_TABLE_ROUGHNESSES
from dermis.environment.isotropic_lobes import isotropic_lobe_table
from dermis.environment.panorama import texel_directions, texel_solid_angles
from dermis.environment.prefilter import LAYER_HEIGHT, LAYER_ROUGHNESSES, isotropic_lobe, prefilter
from dermis.images.io import write_exr
from dermis.specular.cosines import cosines
from dermis.specular.models import MODELS

Floats = NDArray[np.float64]


def test_lobes_at_normal_view_equal_the_specular_lobe() -> None:
    """Check that their sum points along the normal and that their weights sum to 1."""
    table = isotropic_lobe_table()
    assert np.allclose(table[..., 3].sum(axis=-1), 1) and table[..., 3].min() >= 0
    assert np.allclose(table[:, -1, :, :2], 0)


@pytest.mark.parametrize("model", MODELS)
def test_lobes_are_symmetric_about_the_plane_of_incidence(model: str) -> None:
    """Check that lobes outside of the plane of incidence are symmetric pairs."""
    table = isotropic_lobe_table(model)
    assert np.allclose(table[..., :3, 1], 0) and np.allclose(table[..., 3, 1], -table[..., 4, 1], atol=1e-4)
    beside = table[..., 3, 1] > 0
    assert beside.any() and np.allclose(
        table[beside][:, 3, [0, 2, 3]], table[beside][:, 4, [0, 2, 3]], atol=1e-4
    )


def test_at_most_five_lobes_and_three_at_steep_views_have_weight() -> None:
    weights = isotropic_lobe_table()[..., 3] > 0
    assert (weights.sum(axis=-1) == np.array([5] * 10 + [4] * 3 + [3] * 3)).all()


@pytest.mark.parametrize("model", MODELS)
def test_lobes_preserve_the_mean_direction(model: str) -> None:
    """Compare mean direction and width with samples of the hemisphere, at a node of the table."""
    light, area = texel_directions(256, 512)[:128], texel_solid_angles(256, 512)[:128]
    cosine, m = (7 / 15) ** 2, LOBE_TABLE_ROUGHNESSES[6]
    view, up = np.array([-np.sqrt(1 - cosine**2), cosine, 0]), np.array([0.0, 1.0, 0.0])
    weight = MODELS[model].lobe(cosines(up, light, view), m) * light[..., 1] * area
    weight /= weight.sum()
    x, _, z = np.moveaxis(light, -1, 0)
    mean = np.array([(weight * x).sum(), (weight * light[..., 1]).sum()])
    made, across = np.zeros(2), 0.0
    along, ahead, aside = np.array([1.0, 0.0, 0.0]), view * [-1, 1, 1], np.array([0.0, 0.0, 1.0])
    away = cosine * along - np.sqrt(1 - cosine**2) * up
    for x, y, wide, share in isotropic_lobe_table(model)[6, 7]:
        to = (2 * (x * away + y * aside) + (1 - x**2 - y**2) * ahead) / (1 + x**2 + y**2)
        own = isotropic_lobe(np.arccos(light[..., 1]), wide) * area
        own /= own.sum()
        inward, tilt = (own * light[..., 1]).sum(), to @ aside
        made += share * np.array([to @ along, to @ up]) * inward
        across += share * ((own * light[..., 1] ** 2).sum() * tilt**2 + (own * z**2).sum() * (1 - tilt**2))
    assert np.allclose(made, mean, atol=3e-3)
    assert across < 1.2 * (weight * z**2).sum()
    assert model in ("two-lobe", "phong", "phong-plain") or across > 0.97 * (weight * z**2).sum()


def test_lobes_of_a_registered_model_are_fitted_on_demand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Compare the two roughest rows of a fit on demand with the table."""
    shipped = isotropic_lobe_table("kelemen")
    monkeypatch.setattr(isotropic_fits, "ROUGHNESS_COUNT", 3)
    monkeypatch.setattr(isotropic_fits, "LOBE_TABLE_ROUGHNESSES", LOBE_TABLE_ROUGHNESSES[-3:])
    with MODELS.temporary_entry("theirs", MODELS["kelemen"]):
        made = isotropic_lobe_table("theirs")
    assert made.shape == (3, *shipped.shape[1:])
    assert np.allclose(made[-2:], shipped[-2:], atol=2e-3)


@pytest.fixture(scope="module")
def lit_room(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Floats]:
    """Return the file of a dim room with a bright window and a coloured floor, and its radiance."""
    towards = texel_directions(256, 512)
    radiance = 0.3 + 0.2 * towards * [1, 0.5, -0.5]
    radiance[towards[..., 0] > 0.9] += [4.0, 5.0, 6.0]
    radiance[towards[..., 1] < -0.5] *= [1.5, 0.8, 0.4]
    path = tmp_path_factory.mktemp("environment") / "room.exr"
    write_exr(path, radiance.astype(np.float32))
    return str(path), radiance


@pytest.mark.parametrize(
    ("m", "angle", "most"),
    [
        (0.15, 12, 0.015),
        (0.3, 12, 0.025),
        (0.15, 78, 0.01),
        (0.3, 45, 0.03),
        (0.3, 66, 0.035),
        (0.3, 78, 0.03),
        (0.3, 85, 0.02),
        (0.5, 66, 0.035),
    ],
)
def test_reflections_match_the_specular_lobe(
    lit_room: tuple[str, Floats], m: float, angle: float, most: float
) -> None:
    """Compare with a direct sum of the whole lobe, over 24 views.

    Four lobes in the plane of incidence, with directions interpolated between columns of the table, have
    errors of 49, 21, 1.5, 2.7, 3.6, 1.9, 0.8 and 5.7 %.
    """
    pairs = np.random.default_rng(5).normal(size=(24, 2, 3))
    assert error_of(lit_room, pairs, float(np.cos(np.radians(angle))), m) < most


@pytest.mark.parametrize(("cosine", "most"), [(0.7, 0.03), (0.4, 0.025), (0.2, 0.025)])
def test_grazing_reflections_match_the_specular_lobe(
    lit_room: tuple[str, Floats], cosine: float, most: float
) -> None:
    """Check roughness 0.3 over all azimuths; one isotropic lobe has errors of 7, 20 and 25 %."""
    tangents = [np.array([np.cos(turn), 0.3, np.sin(turn)]) for turn in np.linspace(0, 2 * np.pi, 7)[:-1]]
    pairs = np.array([[np.cross(tangent, [0.2, 1.0, -0.4]), tangent] for tangent in tangents])
    pairs[:, 1] = np.cross(pairs[:, 1], pairs[:, 0])
    assert error_of(lit_room, pairs, cosine, 0.3) < most


def error_of(lit_room: tuple[str, Floats], pairs: Floats, cosine: float, m: float) -> float:
    """Return the RMS error of isotropic lobes relative to the mean, for (n, 2, 3) normals and tangents."""
    name, radiance = lit_room
    layers, towards, area = prefilter(name).layers, texel_directions(256, 512), texel_solid_angles(256, 512)
    made, exact = [], []
    for normal, tangent in pairs:
        normal = normal / np.linalg.norm(normal)
        along = np.cross(normal, tangent)
        along /= np.linalg.norm(along)
        sine = np.sqrt(1 - cosine**2)
        view = cosine * normal - sine * along
        frame = np.array(
            [cosine * along - sine * normal, np.cross(normal, along), cosine * normal + sine * along]
        )
        weight = MODELS["kelemen"].lobe(cosines(normal, towards, view), m) * np.maximum(towards @ normal, 0)
        weight *= area
        exact.append(np.einsum("yxc,yx->c", radiance, weight) / weight.sum())
        seen = [one[3] * seen_in(layers, frame, one) for one in lobes_between(cosine, m)]
        made.append(np.sum(seen, axis=0))
    return float(np.sqrt(np.mean(np.subtract(made, exact) ** 2)) / np.mean(exact))


def lobes_between(cosine: float, m: float) -> Floats:
    """Return isotropic lobes (5, 4) between the nodes of the table."""
    x, y = np.sqrt(cosine) * 15, np.interp(np.log(m), np.log(LOBE_TABLE_ROUGHNESSES), np.arange(12))
    j, i = int(x), int(y)
    five = isotropic_lobe_table()[i : i + 2, j : j + 2]
    return np.asarray(np.einsum("i,j,ijlk->lk", [1 - (y - i), y - i], [1 - (x - j), x - j], five))


def seen_in(layers: NDArray[np.float32], frame: Floats, lobe: Floats) -> Floats:
    """Return the mean radiance (3,) of an isotropic lobe, interpolated between texels and layers.

    frame : (3, 3) mirror direction last, preceded by the axes in and across the plane of incidence
    """
    x, y = lobe[:2]
    direction = np.array([2 * x, 2 * y, 1 - x**2 - y**2]) / (1 + x**2 + y**2) @ frame
    row = np.arccos(direction[1]) / np.pi * LAYER_HEIGHT - 0.5
    column = (0.5 + np.arctan2(direction[0], -direction[2]) / (2 * np.pi)) * 2 * LAYER_HEIGHT - 0.5
    at = np.interp(np.log(lobe[2]), np.log(LAYER_ROUGHNESSES), np.arange(len(LAYER_ROUGHNESSES)))
    layer = min(int(at), len(LAYER_ROUGHNESSES) - 2)
    seen = np.zeros(3)
    for k, j, i in np.ndindex(2, 2, 2):
        y, x = int(np.floor(row)) + j, int(np.floor(column)) + i
        share = np.prod(1 - np.abs([layer + k - at, y - row, x - column]))
        seen += share * layers[1 + layer + k, np.clip(y, 0, LAYER_HEIGHT - 1), x % (2 * LAYER_HEIGHT)]
    return seen
