"""Dials of hair: what each field of `HairLook` changes in the strands that grow."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import HairLook, Human
from dermis.base.errors import DermisError
from dermis.human.hair.look import BEARD_STYLES
from dermis.mesh.grown_strands import _growing_root_indices, grow_strands
from dermis.mesh.head import Head
from dermis.mesh.strands import Strands
from dermis.specular.hair import absorption_per_mm

Floats = NDArray[np.float64]
STRAND_COUNT = 2_500


@cache
def head_with(**look: Any) -> Head:
    values: dict[str, Any] = {"style": "short", "flyaways": 0.0} | look
    return Human(sex=1.0, hair=HairLook(**values)).head(subdivide=0)


def strands_of(head: Head, knots: int = 0) -> Strands:
    assert head.hair is not None
    groom = replace(head.hair, knots=knots or head.hair.knots)
    return grow_strands(groom, head.mesh, head.mesh.points_mm, STRAND_COUNT)


def grown(**look: Any) -> tuple[Strands, Floats]:
    """Return the strands of a look, and the positions of their knots (n, k, 3) [mm]."""
    head = head_with(**look)
    strands = strands_of(head)
    return strands, strands.knot_positions_mm(head.mesh, head.mesh.points_mm)


def lengths_mm(knots: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.diff(knots, axis=1), axis=2).sum(axis=1))


def deviation_mm(**look: Any) -> float:
    """Return the root mean square distance of knots from the chord of their strand [mm]."""
    _, knots = grown(**look)
    chord = np.linspace(knots[:, 0], knots[:, -1], knots.shape[1], axis=1)
    return float(np.sqrt(((knots - chord) ** 2).sum(axis=2).mean()))


def test_each_dial_has_a_range_and_is_documented() -> None:
    documented = HairLook.__doc__ or ""
    for field in fields(HairLook):
        assert field.name in documented
        if field.name not in ("style", "beard_style"):
            with pytest.raises(DermisError, match=field.name):
                HairLook(**{field.name: -100.0})  # type: ignore[arg-type]


def test_diameter_widens_strands() -> None:
    fine, coarse = (grown(diameter_mm=d)[0].radius_mm.mean() for d in (0.04, 0.08))
    assert coarse == pytest.approx(2.0 * fine, rel=1e-3)


def test_curls_have_the_given_radius_and_pitch() -> None:
    style = {"style": "long", "length_mm": 300.0, "frizz_mm": 0.0, "clump": 0.0, "curl_coherence": 1.0}
    straight = grown(**style, curl_radius_mm=0.0)[1]
    for radius, pitch in ((3.0, 60.0), (6.0, 60.0), (6.0, 90.0)):
        curled = grown(**style, curl_radius_mm=radius, curl_pitch_mm=pitch)[1]
        knots = min(straight.shape[1], curled.shape[1])
        t = np.linspace(0, 1, knots)
        both = [
            strands_of(head_with(**style, curl_radius_mm=r, curl_pitch_mm=pitch), 160) for r in (0.0, radius)
        ]
        head = head_with(**style, curl_radius_mm=0.0)
        offset = np.subtract(*(one.knot_positions_mm(head.mesh, head.mesh.points_mm) for one in both))
        assert len(t) and np.median(np.linalg.norm(offset, axis=2)[:, 60:]) == pytest.approx(radius, rel=0.12)
        spectrum = np.abs(
            np.fft.rfft(offset[:, 32:, 1] - offset[:, 32:, 1].mean(axis=1, keepdims=True), axis=1)
        )
        turns = spectrum.mean(axis=0)[1:].argmax() + 1
        assert turns == pytest.approx(np.median(lengths_mm(straight)) * 128 / 160 / pitch, abs=1.2)


def test_coherent_curls_of_a_clump_run_together() -> None:
    style = {"style": "long", "curl": 0.35, "frizz_mm": 0.0}
    loose, together = (deviation_between_neighbours(**style, curl_coherence=c) for c in (0.0, 1.0))
    assert together < 0.85 * loose


def deviation_between_neighbours(**look: Any) -> float:
    """Return the median change of the distance to the nearest root's strand, from the root to half length."""
    from scipy.spatial import cKDTree

    _, knots = grown(**look)
    near = np.asarray(cKDTree(knots[:, 0]).query(knots[:, 0], k=2)[1])[:, 1]
    apart = np.linalg.norm(knots[near] - knots, axis=2)
    return float(np.median(apart[:, knots.shape[1] // 2]))


def clump_radius_mm(**look: Any) -> float:
    """Return the median horizontal distance of tips from the mean tip of their clump [mm]."""
    hair, tips = head_with(**look).hair, grown(**look)[1][:, -1]
    assert hair is not None
    clump = hair.roots.clump[_growing_root_indices(hair, STRAND_COUNT)]
    _, index, count = np.unique(clump, return_inverse=True, return_counts=True)
    mean = np.stack([np.bincount(index, tips[:, c]) / count for c in (0, 2)], axis=1)
    distance = np.linalg.norm(tips[:, [0, 2]] - mean[index], axis=1)
    return float(np.median(distance[count[index] > 3]))


def test_clumps_gather_strands_and_frizz_and_flyaways_scatter_them() -> None:
    style = {"style": "bob", "curl": 0.0, "frizz_mm": 0.0}
    large = style | {"clump_mm": 16.0}
    assert clump_radius_mm(**large, clump=0.9) < 0.7 * clump_radius_mm(**large, clump=0.0)
    calm, frizzy = (grown(style="bob", curl=0.0, frizz_mm=f)[1][:, -1] for f in (0.0, 2.0))
    moved = np.linalg.norm(frizzy - calm, axis=1)
    assert 0.5 < np.median(moved) < 5.0
    flying = grown(style="bob", curl=0.0, frizz_mm=2.0, flyaways=1.0)[1][:, -1]
    assert np.median(np.linalg.norm(flying - calm, axis=1)) == pytest.approx(5 * np.median(moved), rel=0.3)


def test_size_of_clumps_is_that_of_their_roots() -> None:
    for size in (6.0, 12.0):
        head = head_with(style="bob", clump_mm=size)
        assert head.hair is not None
        clumps = len(np.unique(head.hair.roots.clump))
        assert len(head.hair.roots) / clumps == pytest.approx(150.0 * (size / 10.0) ** 2, rel=0.1)


def test_parting_divides_hair() -> None:
    for parting in (-30.0, 30.0):
        _, knots = grown(style="bob", parting_mm=parting, baby_hairs=0.0)
        root, way = knots[:, 0], knots[:, knots.shape[1] // 4, 0] - knots[:, 0, 0]
        top = (root[:, 1] > 95.0) & (root[:, 2] > -80.0) & (np.abs(root[:, 0] - parting) > 8.0)
        assert top.sum() > 50
        assert (np.sign(way[top]) == np.sign(root[top, 0] - parting)).mean() > 0.9


def test_widows_peak_and_recession_move_the_hairline() -> None:
    def middle(**look: Any) -> float:
        roots = grown(baby_hairs=0.0, **look)[1][:, 0]
        return float(np.quantile(roots[(np.abs(roots[:, 0]) < 5.0) & (roots[:, 2] > -40.0), 1], 0.05))

    assert middle(widows_peak=0.0) - middle(widows_peak=1.0) > 4.0


def test_baby_hairs_are_short_and_fine_and_at_the_hairline() -> None:
    few, many = (grown(style="long", baby_hairs=much) for much in (0.0, 1.0))
    short = lengths_mm(many[1]) < 20.0
    assert (lengths_mm(few[1]) < 20.0).mean() < 0.01 < 0.04 < short.mean() < 0.4
    assert many[0].radius_mm[short, 0].mean() < 0.6 * many[0].radius_mm[~short, 0].mean()
    edge = np.isin(np.arange(len(short)), np.flatnonzero(short))
    assert many[1][edge, 0, 1].mean() < many[1][~edge, 0, 1].mean()


@pytest.mark.parametrize("style", ["short", "bob", "bun"])
def test_hairline_has_no_edge(style: str) -> None:
    """Check that the hair's width per area rises over more than a centimetre above the forehead."""
    strands, knots = grown(style=style)
    root = knots[:, 0]
    front = (np.abs(root[:, 0]) < 25.0) & (root[:, 2] > -45.0)
    width, _ = np.histogram(root[front, 1], np.arange(56.0, 92.0, 3.0), weights=strands.radius_mm[front, 0])
    full = width[-3:].mean()
    rising = np.interp([0.1, 0.7], np.maximum.accumulate(width) / full, np.arange(len(width)) * 3.0)
    assert rising[1] - rising[0] > 6.0


def test_grey_temples_are_greyer_than_the_top() -> None:
    strands, knots = grown(temple_grey=0.8, eumelanin=4.0)
    root, dark = knots[:, 0], strands.absorption[:, 0]
    side = (root[:, 1] < 20.0) & (root[:, 2] > -90.0)
    top = root[:, 1] > 80.0
    assert side.sum() > 50 and np.median(dark[side]) < 0.4 * np.median(dark[top])


def test_dye_colours_hair_beyond_its_roots() -> None:
    natural = grown(eumelanin=6.0)[0].absorption
    dye = absorption_per_mm(0.2, 1.5)
    dyed, grown_out = (
        grown(eumelanin=6.0, dye_eumelanin=0.2, dye_pheomelanin=1.5, roots_mm=mm)[0].absorption
        for mm in (0.0, 15.0)
    )
    ratio = np.median(dyed / natural, axis=0)
    assert ratio == pytest.approx(dye / absorption_per_mm(6.0, 0.3), rel=0.15)
    assert (np.median(dyed, axis=0) < np.median(grown_out, axis=0)).all()
    assert (np.median(grown_out, axis=0) < np.median(natural, axis=0)).all()


@pytest.mark.parametrize("name", BEARD_STYLES[1:])
def test_beards_grow_where_their_name_says(name: str) -> None:
    head = head_with(style="none", beard_style=name)
    strands = strands_of(head)
    knots = strands.knot_positions_mm(head.mesh, head.mesh.points_mm)
    x, y, _ = np.abs(knots[:, 0].T) * [[1], [0], [1]] + knots[:, 0].T * [[0], [1], [0]]
    assert len(strands) > 60 and (y < -35.0).all()
    if name == "moustache":
        assert (x < 36.0).all() and (y > -72.0).all()
    elif name == "goatee":
        assert (x < 36.0).all() and (y < -85.0).mean() > 0.3
    else:
        assert (x > 50.0).mean() > 0.1
    assert np.median(lengths_mm(knots)) == pytest.approx(HairLook(beard_style=name).beard_mm, rel=0.5)


def test_a_length_without_a_style_is_a_full_beard() -> None:
    assert HairLook(beard_mm=4.0).beard_style == "full" and HairLook().beard_style == "none"
    assert HairLook(beard_style="goatee").beard_mm > 5.0
    sampled = Human.sampled(3, sex=1.0, hair={"beard_style": "moustache"}).hair_look
    assert sampled.beard_style == "moustache" and sampled.beard_mm > 0.0


@pytest.mark.parametrize(
    ("style", "curl"), [("long", 0.35), ("shoulder-length", 0.6), ("afro", 0.95), ("twists", 0.9)]
)
def test_segments_follow_curls(style: str, curl: float) -> None:
    """Compare strands with strands of many more knots: no polyline is visible at 1024 pixels (0.4 mm)."""
    head = head_with(style=style, curl=curl)
    assert head.hair is not None
    own = head.hair.knots
    coarse, fine = (
        strands_of(head, k).knot_positions_mm(head.mesh, head.mesh.points_mm) for k in (own, 2 * own - 1)
    )
    error = np.linalg.norm(fine[:, 1::2] - 0.5 * (coarse[:, :-1] + coarse[:, 1:]), axis=2)
    assert np.median(error) < 0.15 and np.quantile(error, 0.95) < 0.4


def test_sampled_hair_fits_a_given_style() -> None:
    for seed in range(12):
        sampled, cropped = Human.sampled(seed).hair, Human.sampled(seed, hair={"style": "cropped"}).hair
        assert cropped.style == "cropped" and cropped.length_mm <= 60.0
        assert Human.sampled(seed, hair={"style": sampled.style}).hair.length_mm == pytest.approx(
            sampled.length_mm
        )
    assert Human.sampled(3, hair={"style": "long", "length_mm": 250.0}).hair.length_mm == 250.0
