"""Homogeneous half-spaces by Monte Carlo tables, and profiles counted from photons."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.tables import read_rows
from dermis.optics.curve import Curve, between
from dermis.optics.media import SKIN_ETA, Floats, Medium
from dermis.optics.radial import RadialProfile, light_beyond, radius_grid, ring_edges

Kind = Literal["skin", "matched", "walk"]
"""A smooth surface of index 1.4 lit at right angles, an index-matched one, and an index-matched one that
light enters by the cosine of all directions."""

SOURCES = ("Wang1995",)
ALBEDOS = 0.02, 0.99999
"""Least and most of the tables [-]."""
_PLAIN = ("kind", "albedo", "total")
Counted = Literal["counted"]
COUNTED: Counted = "counted"
"""Name of the model."""
_LEAST_STEP, _MOST_STEP = 0.05, 0.4  # of log r across which R(r) is told: more where few photons leave
_STEP = 0.02  # by the root of mean free paths over r


class _Table(NamedTuple):
    """By how far an albedo is from 1, as `_scale` has it (m,): totals, and shares within the edges (k,)."""

    scale: Floats
    total: Floats
    edges: Floats
    share: Callable[[Floats], Floats]
    totals: Callable[[Floats], Floats]


def kind_under(eta: float) -> Kind | None:
    """The kind of half-spaces lit at right angles through a surface of this index; None without a table."""
    return "skin" if eta == SKIN_ETA else "matched" if eta == 1.0 else None


def half_space(kind: Kind, albedo: ArrayLike, mfp_mm: ArrayLike) -> Curve:
    """The curve of a half-space in three channels.

    albedo : (3,) of one scattering, 0 to 1; beyond those of the table as there [-]
    mfp_mm : (3,) mean free path [mm]

    Source: [Wang1995].
    """
    table = _table(kind)
    return Curve.of(shares_within(kind, albedo, mfp_mm), table.totals(_place(table, albedo)))


def shares_within(kind: Kind, albedo: ArrayLike, mfp_mm: ArrayLike) -> Callable[[Floats], Floats]:
    """A function of radii (n,) [mm]: share (n, 3) of what leaves a half-space that leaves within them.

    albedo, mfp_mm : as of `half_space`
    """
    table = _table(kind)
    share, mfp = table.share(_place(table, albedo)), np.asarray(mfp_mm, np.float64)

    def within(radius_mm: Floats) -> Floats:
        columns = [between(radius_mm / mfp[i], table.edges, share[i, :, None])[:, 0] for i in range(3)]
        return np.stack(columns, axis=-1)

    return within


def albedo_of(kind: Kind, total: ArrayLike) -> Floats:
    """Albedos of one scattering with which half-spaces return these totals, within the table's range [-]."""
    table = _table(kind)
    fine = np.linspace(table.scale[0], table.scale[-1], 2000)
    place = np.interp(np.asarray(total, np.float64), table.totals(fine)[::-1], fine[::-1])
    return np.asarray(1.0 - place**2)


def _place(table: _Table, albedo: ArrayLike) -> Floats:
    return np.clip(_scale(albedo), table.scale[0], table.scale[-1])


def _scale(albedo: ArrayLike) -> Floats:
    """Roots of what is absorbed: totals and profiles are smooth by them up to an albedo of 1."""
    return np.sqrt(np.maximum(1.0 - np.asarray(albedo, np.float64), 0.0))


@cache
def _table(kind: Kind) -> _Table:
    from scipy.interpolate import PchipInterpolator

    rows = [row for row in read_rows("dermis.optics", "data/half_space") if row["kind"] == kind]
    columns = [name for name in rows[0] if name not in _PLAIN]
    scale = _scale([float(row["albedo"]) for row in rows])
    total = np.array([float(row["total"]) for row in rows])
    share = np.array([[float(row[name]) for name in columns] for row in rows])
    order = np.argsort(scale)
    known: Any = [PchipInterpolator(scale[order], values[order], axis=0) for values in (share, total)]
    edges = np.array([0.0, *map(float, columns)])
    from_axis = lambda place: np.pad(known[0](place), ((0, 0), (1, 0)))  # noqa: E731
    return _Table(scale[order], total[order], edges, from_axis, known[1])


def is_counted(medium: Medium) -> bool:
    """Whether tables have a medium: one layer without end, in three channels, under a surface they know."""
    layer = medium.layers[0]
    plain = len(medium.layers) == 1 and medium.semi_infinite and medium.channels == 3
    least, most = ALBEDOS
    told = (layer.alpha_prime >= least) & (layer.alpha_prime <= most)
    return plain and kind_under(medium.eta) is not None and bool(told.all())


def counted_curve(medium: Medium) -> Curve | None:
    """The curve of a medium that tables have, scattering made isotropic; None for others."""
    kind, layer = kind_under(medium.eta), medium.layers[0]
    if kind is None or not is_counted(medium):
        return None
    return half_space(kind, layer.alpha_prime, layer.mean_free_path_mm)


def tabulated_profile(medium: Medium) -> RadialProfile | None:
    """R(r) of a medium that tables have, scattering made isotropic; None for others."""
    curve, kind, layer = counted_curve(medium), kind_under(medium.eta), medium.layers[0]
    if curve is None or kind is None:
        return None
    path, edges, radius = layer.mean_free_path_mm, ring_edges(), radius_grid()
    within = shares_within(kind, layer.alpha_prime, path)
    rings = np.diff(within(edges), axis=0) * curve.energy
    step = np.clip(_STEP * np.sqrt(path.min() / radius), _LEAST_STEP, _MOST_STEP)
    rate = (within(radius * np.exp(step)) - within(radius * np.exp(-step))) / (2.0 * step)[:, None]
    return RadialProfile(
        name=medium.name,
        model=COUNTED,
        radius_mm=radius,
        reflectance=curve.energy * rate / (2.0 * np.pi * radius[:, None] ** 2),
        total=curve.energy,
        edges_mm=edges,
        ring_energy=rings,
        warnings=tuple(light_beyond(curve.energy, rings)),
        sources=(*medium.sources, *SOURCES),
    )
