"""Hair and beards of the parametric human: positions, density, and who has them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human, Pose
from dermis.base.errors import DermisError
from dermis.human.hair import density, groom
from dermis.human.hair.head_hair import MAX_HAIRS_PER_CM2
from dermis.human.hair.look import HairLook
from dermis.human.hair.root_finder import RootFinder
from dermis.human.hair.skin_surface import SkinSurface
from dermis.human.skin.surface import average_surface
from dermis.mesh.grown_strands import grow_strands
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands

Floats = NDArray[np.float64]
ALL = np.ones(len(average_surface()[0]), bool)
LOOKS = {
    "cropped": HairLook(style="cropped"),
    "short": HairLook(style="short", length_mm=32.0, beard_mm=10.0),
    "coiled": HairLook(style="cropped", curl=1.0, beard_mm=3.0),
}


@cache
def grown(style: str) -> Head:
    return Human(sex=1.0, hair=LOOKS[style]).head(subdivide=0)


def hair(head: Head) -> Strands:
    assert head.hair is not None
    return grow_strands(head.hair, head.mesh, head.mesh.points_mm, len(head.hair))


def knots(head: Head, **pose: float) -> Floats:
    """Return the knots (n, k, 3) in space [mm]."""
    points = (
        head.mesh.points_mm
        if not pose
        else head.control_rig.posed_points_mm(Pose.coerce(pose).to_arrays(head.control_rig))
    )
    assert head.hair is not None
    strands = grow_strands(head.hair, head.mesh, points, len(head.hair))
    return strands.knot_positions_mm(head.mesh, points)


def everywhere(places: Floats) -> Floats:
    return np.ones(len(places))


def test_the_same_seed_has_the_same_hair() -> None:
    one, other, another = (
        hair(Human(hair=HairLook(style="cropped", seed=seed)).head(subdivide=0)) for seed in (3, 3, 4)
    )
    for name in ("knots_mm", "radius_mm", "absorption", "cover"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert np.array_equal(one.roots.quad, other.roots.quad)
    assert len(another) != len(one) or not np.array_equal(another.roots.position, one.roots.position)


def test_root_density_is_as_given() -> None:
    mesh, rng = Human().head(subdivide=0).mesh, np.random.default_rng(0)
    found = density.sample_roots(mesh, density.HairDensity(everywhere, ALL), 40.0, rng)
    quads, count = np.unique(found.quad, return_counts=True)
    area = density.quad_areas_cm2(mesh, quads.astype(np.int64))
    assert count.sum() / area.sum() == pytest.approx(40.0, rel=0.02)
    large = area > np.percentile(area, 70)
    assert count[large] / area[large] == pytest.approx(np.full(large.sum(), 40.0), rel=0.5)


@pytest.mark.parametrize("relative", [0.3, 1.0])
def test_fewer_hairs_are_widened_to_represent_all(relative: float) -> None:
    """Check that the total width per cm2 of the crown is that of 200 hairs times the density."""
    head = Human(hair=HairLook(style="cropped", density=relative)).head(subdivide=0)
    strands, place = hair(head), knots(head)[:, 0]
    top = place[:, 1] > 85.0
    quads = np.unique(strands.roots.quad[top])
    inside = np.isin(strands.roots.quad, quads)
    area = density.quad_areas_cm2(head.mesh, quads.astype(np.int64)).sum()
    assert strands.radius_mm[inside, 0].sum() / area == pytest.approx(
        0.034 * MAX_HAIRS_PER_CM2 * relative, rel=0.12
    )


def test_fraction_of_hairs_keeps_the_coverage() -> None:
    all_of_them, few = (hair(Human(hair=HairLook(style="short")).head(hairs=share)) for share in (1.0, 0.25))
    assert len(few) == pytest.approx(0.25 * len(all_of_them), rel=0.03)
    assert few.radius_mm.mean() == pytest.approx(4 * all_of_them.radius_mm.mean(), rel=0.03)
    assert few.cover is not None and all_of_them.cover is not None
    assert few.cover.mean() == pytest.approx(all_of_them.cover.mean(), rel=0.05)
    with pytest.raises(DermisError, match="hairs"):
        Human().head(hairs=0.0)


@pytest.mark.parametrize("style", LOOKS)
def test_no_hair_grows_on_ears_lips_and_face(style: str) -> None:
    head = grown(style)
    assert not np.isin(hair(head).roots.quad, density._hairless_quads()).any()
    x, y, z = knots(head)[:, 0].T
    assert not ((np.abs(x) < 40) & (y < 55) & (y > -35) & (z > 0)).any()  # forehead, eyes, nose
    if LOOKS[style].beard_mm == 0.0:
        assert not ((y < 30) & (z > -20)).any()


@pytest.mark.parametrize("style", LOOKS)
def test_no_hair_enters_the_head(style: str) -> None:
    head = Human(sex=1.0, hair=LOOKS[style]).head(subdivide=2)
    places = knots(head)
    some = places[:: max(1, len(places) // 4000)]
    project, normal = SkinSurface(head.mesh.positions, head.mesh.normals).project(some.reshape(-1, 3))
    over = ((some.reshape(-1, 3) - project) * normal).sum(axis=1).reshape(some.shape[:2])
    assert np.percentile(np.abs(over[:, 0]), 99.5) < 1.6  # they begin at the skin
    assert (over[:, 1:] > -0.5).mean() > 0.995 and np.percentile(over[:, 1:], 0.1) > -1.0


def test_hair_has_the_given_length() -> None:
    for millimetres in (4.0, 9.0):
        head = Human(hair=HairLook(style="cropped", length_mm=millimetres)).head(subdivide=0)
        length = np.linalg.norm(np.diff(knots(head), axis=1), axis=2).sum(axis=1)
        assert 0.7 * millimetres < np.median(length) < 1.2 * millimetres
        assert np.percentile(length, 99.9) < 2.2 * millimetres


def test_hair_moves_with_the_head_and_not_with_expressions() -> None:
    head = grown("short")
    still, open_ = knots(head), knots(head, jawOpen=1.0)
    chin = (still[:, 0, 1] < -85) & (still[:, 0, 2] > -20)
    moved = np.linalg.norm(open_ - still, axis=2)
    assert np.median(moved[chin]) > 5.0 and moved[still[:, 0, 1] > 60].max() < 0.5


@pytest.mark.parametrize(
    "where", [density.scalp_density(0.0), density.scalp_density(0.8), density.beard_density()]
)
def test_sparse_search_loses_no_hair(where: density.HairDensity) -> None:
    mesh = Human().head(subdivide=0).mesh
    both = where, where._replace(candidates=ALL)
    some, every = (density.sample_roots(mesh, one, 60.0, np.random.default_rng(0)) for one in both)
    assert not where.candidates.all() and len(some.quad) > 1000
    assert np.array_equal(some.position, every.position) and np.array_equal(some.quad, every.quad)


@pytest.mark.parametrize("seed", [2, 11, 30])
def test_brows_lie_on_all_skin(monkeypatch: pytest.MonkeyPatch, seed: int) -> None:
    def every(root_finder: RootFinder) -> NDArray[np.int64]:
        return np.arange(len(root_finder.subdivided_mesh.positions))

    some = Human.sampled(seed).head().strands
    monkeypatch.setattr(groom, "skin_vertices_near_brows", every)
    whole = Human.sampled(seed).head().strands
    assert some is not None and whole is not None and np.array_equal(some.knots_mm, whole.knots_mm)


def test_recession_bares_temples_and_crown() -> None:
    temple, crown = np.array([[33.0, 75.0, -12.0, -50.0]]), np.array([[0.0, 95.0, -122.0, -50.0]])
    middle = np.array([[0.0, 100.0, -50.0, -50.0]])
    full, thin = density.scalp_density(0.0).relative_density, density.scalp_density(1.0).relative_density
    assert full(temple) > 0.4 > 0.05 > thin(temple)
    assert full(crown) > 0.95 and thin(crown) < 0.3 and thin(middle) > 0.9 * full(middle)


def test_hair_depends_on_the_person() -> None:
    people = [Human.sampled(seed) for seed in range(200)]
    men, women = ([one for one in people if (one.sex > 0.5) == man] for man in (True, False))
    bald = [np.mean([one.hair_look.style == "none" for one in group]) for group in (men, women)]
    assert 0.04 < bald[0] < 0.25 and bald[1] < 0.1
    assert not any(one.hair_look.beard_mm for one in women) and any(one.hair_look.beard_mm > 3 for one in men)
    coiled = {one.hair_look.style for one in people if one.hair_look.curl > 0.6}
    assert "afro" in coiled and "long" not in coiled
    assert {"long", "bob", "ponytail"} <= {one.hair_look.style for one in women}
    assert all(one.look.recession == 0.0 for one in women)
    assert np.mean([one.look.recession for one in men if one.age > 55]) > np.mean(
        [one.look.recession for one in men if one.age < 40]
    )
    assert Human(age=85).hair_look.grey > 0.5 > Human(age=30).hair_look.grey == 0.0
    assert Human(hair=HairLook()).head(subdivide=0).hair is None


def test_grey_hair_is_grey_and_fair_hair_is_not() -> None:
    grey, blond = (
        hair(Human(hair=HairLook(style="cropped", eumelanin=dark, grey=share)).head(subdivide=0)).absorption
        for dark, share in ((6.0, 0.7), (0.5, 0.0))
    )
    warmth = [np.median(one[:, 2] / one[:, 0]) for one in (grey, blond)]
    assert warmth[0] < 1.9 < 2.4 < warmth[1]


@pytest.mark.parametrize(
    "bad", [{"style": "mullet"}, {"style": "short", "length_mm": 100.0}, {"density": -1.0}, {"seed": 0.5}]
)
def test_invalid_hair_is_refused(bad: dict[str, object]) -> None:
    with pytest.raises(DermisError):
        HairLook(**bad)  # type: ignore[arg-type]


def test_places_on_the_average_person_are_below_the_crown() -> None:
    """Check also the edge of the chest, which the file stores far above."""
    places = density.average_control_points()[:, :3]
    assert places[:, 1].max() < 130.0 and places[:, 1].min() < -330.0
    assert (knots(grown("cropped"))[:, 0, 1] > -110.0).all()
