"""Reference implementations of the frame's shaders in float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from dermis.atlas.atlas import Atlas
from dermis.frame.features.diffusion.kernels import (
    CHAINED_TRUNCATION_SIGMAS,
    MAX_TABLE_VARIANCE,
    ROWS_PER_UNIT_VARIANCE,
    kernel_ratio_table,
)
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight
from dermis.scene.model import Scene
from dermis.scene.skin import Skin
from dermis.specular.albedo import albedo_table
from dermis.specular.beckmann import beckmann_table
from dermis.specular.fresnel import ENERGY_SCHEMES

Floats = NDArray[np.float64]
SMOOTH = 1.6
USUAL = str(Skin().specular)
WIDE_TRUNCATION = 4.0
DEFAULT_COLOUR = float(np.float16(0.8))  # maps are stored as halves


def _table_ratio(relative: Floats) -> Floats:
    """Interpolate the kernel table between its rows."""
    taps = np.ceil(CHAINED_TRUNCATION_SIGMAS * np.sqrt(relative)).astype(int)
    row = relative * ROWS_PER_UNIT_VARIANCE
    table = kernel_ratio_table().astype(np.float64)
    low, high = table[row.astype(int), taps], table[row.astype(int) + 1, taps]
    return np.asarray(low + (high - low) * (row % 1))


class Kernel(NamedTuple):
    """For each texel: texels between taps, taps on each side, the first tap's weight over the centre's."""

    step: NDArray[np.int64]
    taps: NDArray[np.int64]
    q: Floats

    @classmethod
    def of(cls, variance: Floats, step: Floats) -> Kernel:
        """Return the kernel of a variance [texel^2]."""
        relative = variance / step**2
        wide = relative > MAX_TABLE_VARIANCE
        taps = np.ceil(np.where(wide, WIDE_TRUNCATION, CHAINED_TRUNCATION_SIGMAS) * np.sqrt(relative)).astype(
            int
        )
        narrow = _table_ratio(np.minimum(relative, MAX_TABLE_VARIANCE))
        return cls(step.astype(int), taps, np.where(wide, np.exp(-0.5 / np.maximum(relative, 1)), narrow))

    def weight(self, n: int) -> Floats:
        return np.asarray(np.where(n <= self.taps, self.q ** (n * n), 0.0))


def _step(sigma: Floats, sigma_before: Floats) -> Floats:
    return np.asarray(np.maximum(1, np.floor(np.minimum(SMOOTH * sigma_before, sigma))))


def _added_by_lean(lean: Floats, kernel: Kernel) -> Floats:
    """Return the variance that interpolation between two texels adds [texel^2]."""
    added, total = np.zeros(lean.shape), np.ones(lean.shape)
    for n in range(1, kernel.taps.max() + 1):
        f = (lean * n * kernel.step) % 1.0
        added += 2 * kernel.weight(n) * f * (1 - f)
        total += 2 * kernel.weight(n)
    return np.asarray(added / total)


def _between(source: Floats, y: NDArray[np.int64], x: Floats) -> Floats:
    """Return texels of row y, interpolated between two columns; the texture repeats its border."""
    n = len(source)
    column = np.floor(x).astype(int)
    one, other = (source[np.clip(y, 0, n - 1), np.clip(column + k, 0, n - 1)] for k in (0, 1))
    return np.asarray(one + (other - one) * (x - column)[..., None])


def spread(
    source: Floats,
    metric: Floats,
    reach: NDArray[np.integer] | None,
    variance: float,
    before: float,
    axis: int,
) -> Floats:
    """Blur a source of variance `before` to `variance` along one axis [mm2].

    source : (n, n, 4) light and coverage, metric : (n, n, 3) texels per mm along u, v and the cosine between
    reach : (n, n, 4) left, right, up, down; None reads the whole texture
    """
    along_u, along_v, cosine = np.moveaxis(np.asarray(metric, float), -1, 0)
    covered = along_v > 0
    lean = np.where(covered, -cosine * along_u / np.where(covered, along_v, 1), 0.0)
    upright = along_v / np.sqrt(1 - cosine**2)
    sigma, sigma_before = (np.sqrt(v) * np.stack([along_u, upright]) for v in (variance, before))
    step = _step(sigma, sigma_before)
    kernel = Kernel.of(sigma[1] ** 2, step[1])
    if axis == 0:
        kernel = Kernel.of(np.maximum(0, sigma[0] ** 2 - _added_by_lean(lean, kernel)), step[0])
    y, x = np.indices(lean.shape)
    total = source.copy()
    for n in range(1, kernel.taps.max() + 1):
        weight = kernel.weight(n)[..., None]
        for side, sign in enumerate((-1, 1)):
            move = n * kernel.step
            move = sign * (
                move if reach is None else np.minimum(move, reach[..., 2 * axis + side].astype(int))
            )
            total += weight * (
                _between(source, y + move, x + lean * move) if axis else _between(source, y, x + move)
            )
    share = np.where(covered, total[..., 3], 1.0)[..., None]
    return np.asarray(np.where(covered[..., None], total / share, 0.0))


def levels(
    source: Floats, metric: Floats, reach: NDArray[np.integer] | None, variances: ArrayLike
) -> list[Floats]:
    """Return the blurred levels of (n, n, 3) light, each computed from the one before.

    metric : (n, n, 2 or 3) texels per mm along u, v, and the cosine between them, 0 by default
    """
    metric = np.concatenate([metric, np.zeros((*metric.shape[:2], 3 - metric.shape[2]))], axis=-1)
    made, before = [np.dstack([source, np.ones(source.shape[:2])])], 0.0
    for variance in np.asarray(variances, float):
        along_u = spread(made[-1], metric, reach, variance - before, before, 0)
        made.append(spread(along_u, metric, reach, variance - before, before, 1))
        before = float(variance)
    return [level[..., :3] for level in made[1:]]


def gaussian_sum(profile: GaussianSum, first: int, r2_mm2: Floats) -> Floats:
    """Return the (..., 3) sum of the profile's Gaussians from `first` on at squared distances [1/mm2]."""
    total = np.zeros((*r2_mm2.shape, 3))
    for variance, weight in zip(profile.variance_mm2[first:], profile.weight[first:], strict=True):
        total += (np.exp(-r2_mm2 / (2 * variance)) / (2 * np.pi * variance))[..., None] * weight
    return total


def surface_albedo(
    cosine: ArrayLike, m: float, model: str = USUAL, fresnel: str = "schlick"
) -> tuple[Floats, Floats]:
    """Return the directional albedo of the surface and its mean, from the shader's table."""
    table = albedo_table(model, fresnel).astype(np.float64)
    column = np.sqrt(np.clip(np.asarray(cosine, float), 0, None)) * (table.shape[1] - 1)
    where = [np.full(column.shape, (np.sqrt(m) - 0.2) / 0.8 * (len(table) - 1)), column]
    albedo, mean = (map_coordinates(table[..., k], where, order=1, mode="nearest") for k in (0, 1))
    return albedo, mean


def enters(cosine: ArrayLike, m: float, rho_s: float) -> Floats:
    """Return the fraction of light from a direction that enters the skin."""
    return ENERGY_SCHEMES["full"].entering_fraction(surface_albedo(cosine, m)[0], rho_s)


def leaves(cosine: ArrayLike, m: float, rho_s: float) -> Floats:
    """Return the fraction of uniform light that leaves in a direction."""
    return ENERGY_SCHEMES["full"].exitance_factor(*surface_albedo(cosine, m), rho_s)


def beckmann_by_table(cos_h: Floats, m: float) -> Floats:
    """Return Beckmann's distribution from the shader's table."""
    table = beckmann_table().astype(np.float64)
    where = [np.full(cos_h.shape, m * len(table) - 0.5), cos_h * (len(table) - 1)]
    return np.asarray((2.0 * map_coordinates(table, where, order=1, mode="nearest")) ** 10)


def incident(
    light: PointLight | SpotLight | DirectionalLight, centre: ArrayLike, points: Floats
) -> tuple[Floats, Floats]:
    """Return (..., 3) unit vectors to the light, and (..., 3) irradiance on a surface that faces it."""
    colour = np.array(light.irradiance)
    if isinstance(light, DirectionalLight):
        way = np.array(light.direction) / np.linalg.norm(light.direction)
        return np.broadcast_to(-way, points.shape), np.broadcast_to(colour, points.shape)
    path = np.subtract(light.target, light.position)
    towards = np.add(light.position, centre) - points
    distance = np.linalg.norm(towards, axis=-1, keepdims=True)
    to_light = towards / distance
    arriving = colour * (path @ path) / distance**2
    if isinstance(light, SpotLight):
        outer, inner = np.cos(np.radians([light.outer_degrees, light.inner_degrees]))
        cosine = -to_light @ (path / np.linalg.norm(path))
        t = np.clip((cosine - outer) / (inner - outer), 0, 1)
        arriving = arriving * (t * t * (3 - 2 * t))[..., None]
    return to_light, arriving


def entering(scene: Scene, points: Floats, normals: Floats) -> Floats:
    """Return the (..., 3) irradiance that enters the surface, without shadows, relief and colour."""
    total = np.zeros(points.shape)
    for light in scene.lights:
        to_light, arriving = incident(light, scene.head.centre_mm, points)
        cosine = np.maximum((to_light * normals).sum(-1), 0.0)
        share = cosine * enters(cosine, scene.skin.roughness, scene.skin.rho_s)
        total += arriving * share[..., None]
    return total


def surface(atlas: Atlas, head: Head) -> tuple[Floats, Floats]:
    """Return the position and the unit normal of each texel, 0 outside charts."""
    point = atlas.interpolate(head.mesh, head.mesh.positions)
    normal = atlas.interpolate(head.mesh, head.mesh.normals)
    length = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    covered = atlas.lit_mask[..., None]
    return np.where(covered, point, 0.0), np.where(covered, normal / length, 0.0)
