"""The skin of the embedded head: the same everywhere it is asked, and different where skin differs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from dermis.errors import DermisError
from dermis.human.bust.mesh import build_bust
from dermis.human.bust.parameters import BustParameters
from dermis.human.bust.regions import REGIONS, region_of
from dermis.human.bust.shape import landmarks, symmetric
from dermis.human.bust.warp import make_warp
from dermis.human.skin_maps.face import make_face, make_folds
from dermis.human.skin_maps.hairs import make_hairs
from dermis.human.skin_maps.kernels.noise import dots, fractal_noise, gradient_noise
from dermis.human.skin_maps.kernels.places import COLUMNS, locate
from dermis.human.skin_maps.look import Patch, SkinLook
from dermis.human.skin_maps.paint import Painted, paint_skin

Doubles = NDArray[np.float64]

SHAPE = BustParameters()
PLAIN = SkinLook(freckles=0.0, moles=0.0, stubble=0.0)


@lru_cache(maxsize=1)
def skin() -> tuple[Doubles, Doubles]:
    """Places all over a head, and normals."""
    positions, _, normals = build_bust(SHAPE, 2.5)
    return positions, normals


@lru_cache(maxsize=8)
def paint(look: SkinLook = PLAIN, texel_mm: float = 0.2) -> Painted:
    return paint_skin(*skin(), SHAPE, look, texel_mm)


def square(centre: Doubles, normal: Doubles, side_mm: float, texels: int) -> tuple[Doubles, Doubles]:
    """Places on a flat square in space, and their normals."""
    u = np.cross(normal, (0.3, 1.0, 0.2))
    u /= np.linalg.norm(u)
    across = (np.arange(texels) / texels - 0.5) * side_mm
    places = centre + across[:, None, None] * u + across[None, :, None] * np.cross(normal, u)
    return places.reshape(-1, 3), np.tile(normal, (texels * texels, 1))


def cheek(side_mm: float, texels: int) -> tuple[Doubles, Doubles]:
    return square(np.array([40.0, -30.0, 78.0]), np.array([0.6, 0.0, 0.8]), side_mm, texels)


def mean_of(painted: Painted, region: str) -> tuple[NDArray[np.float32], float, float]:
    """Colour, rho_s and m of a region."""
    here = painted.region == REGIONS.index(region)
    return painted.colour[here].mean(axis=0), painted.rho_s[here].mean(), painted.roughness[here].mean()


def redness(colour: NDArray[np.float32]) -> float:
    return float(colour[0] / colour[1])


def check_valid(painted: Painted) -> None:
    assert np.isfinite(painted.colour).all() and painted.colour.min() >= 0 and painted.colour.max() < 0.9
    assert np.isfinite(painted.height_mm).all() and np.abs(painted.height_mm).max() < 1.5
    assert painted.rho_s.min() >= 0.05 and painted.rho_s.max() <= 0.45
    assert painted.roughness.min() >= 0.15 and painted.roughness.max() <= 0.6
    assert painted.region.max() < len(REGIONS)


def test_same_look_same_bytes() -> None:
    look = SkinLook(freckles=0.5, seed=3)
    for one, other in zip(paint(look), paint_skin(*skin(), SHAPE, look, 0.2), strict=True):
        assert one.tobytes() == other.tobytes()


def test_each_place_is_painted_by_itself() -> None:
    """In another order, in other pieces, and on threads that share the work differently."""
    points, normals = skin()
    whole = paint(SkinLook())
    order = np.random.default_rng(0).permutation(len(points))
    for rows in (order, order[:1], order[:77]):
        part = paint_skin(points[rows], normals[rows], SHAPE, SkinLook(), 0.2)
        for one, other in zip(whole, part, strict=True):
            assert one[rows].tobytes() == other.tobytes()


def test_no_places_no_skin() -> None:
    nothing = paint_skin(np.empty((0, 3)), np.empty((0, 3)), SHAPE, PLAIN)
    assert nothing.colour.shape == (0, 3) and nothing.region.dtype == np.uint8


def test_texels_may_differ_from_place_to_place() -> None:
    points, normals = skin()
    texels = np.where(points[:, 0] > 0, 0.1, 0.5)
    mixed, fine, coarse = (paint_skin(points, normals, SHAPE, PLAIN, t) for t in (texels, 0.1, 0.5))
    assert np.array_equal(mixed.height_mm, np.where(points[:, 0] > 0, fine.height_mm, coarse.height_mm))


def test_seeds_differ() -> None:
    one, other = paint(SkinLook(seed=1)), paint(SkinLook(seed=2))
    assert np.abs(one.colour - other.colour).max() > 0.05
    assert np.array_equal(one.region, other.region)


def test_skin_has_no_steps() -> None:
    """A thousandth of a millimetre on, nothing changes by more than a steep slope would make it."""
    points, normals = skin()
    look = SkinLook(freckles=1.0, moles=1.0, age=1.0)
    aside = np.cross(normals, (0.36, 0.48, 0.8))
    here = paint_skin(points, normals, SHAPE, look, 0.1)
    there = paint_skin(points + 1e-3 * aside, normals, SHAPE, look, 0.1)
    assert np.abs(here.height_mm - there.height_mm).max() < 4e-3
    assert np.abs(here.colour - there.colour).max() < 4e-3
    assert np.abs(here.rho_s - there.rho_s).max() < 2e-3
    assert np.abs(here.roughness - there.roughness).max() < 1e-3


def test_noise_has_no_steps_and_no_bias() -> None:
    rng = np.random.default_rng(2)
    points = rng.uniform(-300, 300, (4000, 3))
    points[:2000] = np.round(points[:2000])  # where cells of the lattice meet
    values = np.array([gradient_noise(*p, 5) for p in points])
    aside = np.array([gradient_noise(*(p + 1e-6), 5) for p in points])
    assert np.abs(values - aside).max() < 1e-5
    free = values[2000:]
    assert abs(free.mean()) < 0.03 and 0.2 < free.std() < 0.4 and np.abs(free).max() <= 1.1


def test_noise_does_not_repeat() -> None:
    x = np.linspace(0.3, 4000.3, 40001)
    values = np.array([gradient_noise(one, 0.4, 0.7, 1) for one in x])
    values -= values.mean()
    spectrum = np.abs(np.fft.rfft(values, 2 * len(values))) ** 2
    likeness = np.fft.irfft(spectrum)[: len(values) // 2] / (values @ values)
    assert np.abs(likeness[50:]).max() < 0.1


def test_what_texels_cannot_show_is_left_out() -> None:
    assert fractal_noise(1.3, 2.4, 3.5, 1.0, 0.7, 0.6, 1) == 0.0
    steps = []
    for texel in (0.1, 0.2, 0.4, 0.8):
        points, normals = cheek(24.0, 120)
        painted = paint_skin(points, normals, SHAPE, PLAIN, texel)
        steps.append(np.abs(np.diff(painted.height_mm.reshape(120, 120), axis=0)).mean())
    assert steps[0] > 1.3 * steps[1] > 1.3**2 * steps[2] > 1.3**3 * steps[3]


def test_relief_is_that_of_skin() -> None:
    """Root mean square height of a cheek: a scan of 0.1 mm has 0.03 mm."""
    painted = paint_skin(*cheek(28.0, 280), SHAPE, PLAIN, 0.1)
    assert 0.01 < painted.height_mm.std() < 0.05


def test_a_turned_surface_keeps_its_pores_round() -> None:
    """Dots cover as much of a plane of any direction."""
    covered = []
    for normal in (np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8]), np.array([1.0, 1.0, 1.0]) / 3**0.5):
        points, _ = square(np.array([3.0, 4.0, 5.0]), normal, 60.0, 90)
        covered.append(np.mean([dots(*p, normal, 2.0, 0.2, 0.4, 1.0, 0.01, 9) for p in points]))
    assert max(covered) / min(covered) < 1.15 and min(covered) > 0.015
    assert dots(3.1, 4.1, 5.1, normal, 2.0, 0.2, 0.4, 0.0, 0.01, 9) == 0.0


def test_places_are_found_on_the_symmetric_head() -> None:
    shape = BustParameters(width=1.08, asymmetry=2.0, seed=4)
    points, normals = skin()
    found = np.empty((len(points), COLUMNS))
    locate(Patch(points, normals, np.ones(len(points)), 0), make_face(shape), found)
    assert np.abs(found[:, :3] - make_warp(shape).undo(points)).max() < 0.02


@pytest.mark.parametrize(
    "shape", [SHAPE, BustParameters(width=1.1, nose=1.25, ears=1.2, asymmetry=2.0, seed=3)]
)
def test_regions_are_the_busts_own(shape: BustParameters) -> None:
    points, normals = skin()
    painted = paint_skin(points, normals, shape, PLAIN, 0.5)
    assert (painted.region != region_of(points, shape)).mean() < 0.001


def test_regions_differ_as_skin_does() -> None:
    painted = paint(PLAIN, 0.1)
    colour, strength, roughness = (
        {name: mean_of(painted, name)[k] for name in REGIONS if name != "brow"} for k in range(3)
    )
    red = {name: redness(value) for name, value in colour.items()}
    assert max(red, key=lambda name: red[name]) == "lips" and red["lips"] > 1.25 * red["cheek"]
    assert min(red["cheek"], red["nose"], red["ear"]) > 1.03 * red["forehead"]
    assert strength["nose"] > strength["forehead"] > strength["cheek"] > strength["neck and scalp"]
    assert roughness["nose"] < roughness["cheek"] and roughness["lips"] < roughness["cheek"]


def test_default_skin_is_an_albedo_of_light_skin() -> None:
    """Between published extremes: luminance 0.2 to 0.45, redder than green than blue."""
    cheeks, _, _ = mean_of(paint(), "cheek")
    assert 0.2 < cheeks @ (0.2126, 0.7152, 0.0722) < 0.45
    assert cheeks[0] > 1.3 * cheeks[1] > 1.3 * cheeks[2] > 0.13


def test_brows_and_lashes_are_dark_hairs() -> None:
    painted = paint(PLAIN, 0.1)
    here = painted.region == REGIONS.index("brow")
    luminance = painted.colour @ (0.2126, 0.7152, 0.0722)
    assert luminance[here].min() < 0.4 * np.median(luminance)
    hairs = make_hairs(0)
    left = hairs.pieces[hairs.pieces[:, 0] > 0]
    assert len(left) * 2 == len(hairs.pieces), "as many on either side"
    brow = landmarks(BustParameters(asymmetry=0.0))["left brow"]
    assert np.abs(np.median(left[left[:, 1] > 10, :2], axis=0) - brow[:2]).max() < 6


@pytest.mark.parametrize(("spots", "least"), [("freckles", 0.02), ("moles", 0.0003), ("stubble", 0.9)])
def test_spots_darken_part_of_the_skin(spots: str, least: float) -> None:
    """Freckles on the bridge of the nose, moles on the breast, stubble on the crown."""
    place, side = {
        "freckles": ((0, -14, 98), 20.0),
        "moles": ((0, -215, 20), 150.0),
        "stubble": ((0, 110, 0), 20.0),
    }[spots]
    places = square(np.array(place, dtype=np.float64), np.array([0.0, 0.0, 1.0]), side, 250)
    none = {"freckles": 0.0, "moles": 0.0, "stubble": 0.0}
    plain, spotted = (
        paint_skin(*places, SHAPE, SkinLook(**amounts), 0.3).colour for amounts in (none, none | {spots: 1.0})
    )
    assert least < (spotted.sum(axis=1) < 0.9 * plain.sum(axis=1)).mean() <= 1
    assert (spotted <= plain + 1e-6).all()


def test_age_deepens_folds() -> None:
    young, old = (paint(SkinLook(age=age), 0.2).height_mm for age in (0.0, 1.0))
    assert old.min() < 1.5 * young.min() and old.std() > 1.2 * young.std()


def test_oil_makes_skin_shine() -> None:
    dry, oily = (paint(SkinLook(oil=oil)) for oil in (0.0, 1.0))
    assert oily.rho_s.mean() > 1.2 * dry.rho_s.mean() and oily.roughness.mean() < 0.9 * dry.roughness.mean()


UNIT = st.floats(0, 1)
LOOKS = st.builds(
    SkinLook,
    **{name: UNIT for name in SkinLook.__dataclass_fields__ if name != "seed"},
    seed=st.integers(0, 2**32 - 1),
)


@settings(max_examples=5, deadline=None, derandomize=True)
@example(SkinLook(melanin=0, blood=0, oxygen=0, eumelanin=0, freckles=0, moles=0, oil=0, age=0))
@example(
    SkinLook(melanin=1, blood=1, oxygen=1, eumelanin=1, freckles=1, moles=1, oil=1, age=1, seed=2**32 - 1)
)
@given(LOOKS)
def test_all_looks_are_skins(look: SkinLook) -> None:
    points, normals = skin()
    check_valid(paint_skin(points[::9], normals[::9], SHAPE, look, 0.15))


def test_folds_follow_the_skin_of_other_heads() -> None:
    shape = BustParameters(width=0.92, nose=0.85, jaw=0.9, fullness=-1.0, seed=8)
    folds = make_folds(shape, 1.0)
    assert np.abs(symmetric(folds.knots, shape)).max() < 0.1
    points = make_warp(shape).apply(folds.knots)
    normals = np.tile((0.0, 0.0, 1.0), (len(points), 1))
    young, old = (paint_skin(points, normals, shape, SkinLook(age=age), 0.2).height_mm for age in (0.0, 1.0))
    # a fold wanders to either side of its curve, so that not all of the curve is at its bottom
    assert np.median(young - old) > 0.02 and np.percentile(young - old, 90) > 0.1


@pytest.mark.parametrize(
    ("name", "value"),
    [("melanin", 1.5), ("blood", -0.1), ("oil", float("nan")), ("seed", -1), ("seed", 0.5), ("age", 2)],
)
def test_other_looks_are_refused(name: str, value: float) -> None:
    with pytest.raises(DermisError, match=rf"--{name}: expected a"):
        SkinLook(**{name: value})
