"""Latitude-longitude panoramas of distant light, and extraction of suns from panoramas."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse
from dermis.base.reading import is_file
from dermis.formats.samples import SAMPLES, fetch_sample
from dermis.images.colour import luminance
from dermis.images.io import read_colours, repair_radiance

Floats = NDArray[np.float64]
UNIFORM_PANORAMA = "uniform"
"""Name of the panorama with radiance 1 everywhere."""
_MIN_PANORAMA_ROWS, _MAX_PANORAMA_ROWS = 256, 512
"""Least and largest number of rows of a loaded panorama.

Smaller panoramas are resampled for accuracy, larger panoramas for speed.
"""
_MAX_RADIANCE = 1e12  # far above the radiance of the sun; prevents overflow of single precision
MAX_SUNS = 4
_SUN_PEAK_FACTOR = 32.0  # radiance above which a texel may belong to a sun, relative to the mean
_SUN_CLUSTER_DEGREES = 8.0
_MIN_SUN_IRRADIANCE_FRACTION = (
    0.05  # least irradiance by a sun, relative to that by a uniform sky of mean radiance
)


def load_panorama(panorama_name: str, max_rows: int = _MAX_PANORAMA_ROWS) -> Floats:
    """Load a panorama of radiance (h, 2 h, 3), linear Rec. 709, with -Z at the centre, +X right and +Y up.

    panorama_name : name of a sample panorama, path of a file (.hdr, .exr), or "uniform"
    max_rows : largest number of rows h; larger pictures are reduced by averaging

    A few infinite, NaN or negative pixels are repaired, with a note to the user.

    Raises DermisError for an unknown name, and for a picture that is not a panorama of radiance.
    """
    path = panorama_file(panorama_name)
    if path is None:
        return np.ones((_MIN_PANORAMA_ROWS, 2 * _MIN_PANORAMA_ROWS, 3))
    image, space = read_colours(path)
    if image.dtype != np.float32:
        actual, advice = f"it is a picture of {image.dtype.name}", "Take its .hdr or .exr version"
        refuse(panorama_name, "a picture of radiance (.hdr, .exr)", actual, advice)
    rgb = space.to_linear(repair_radiance(panorama_name, np.asarray(image[..., :3], np.float32)))
    if (highest := float(rgb.max())) > _MAX_RADIANCE:
        refuse(
            panorama_name, f"radiance up to {_MAX_RADIANCE:g}", f"it is up to {highest:g}", "Export it again"
        )
    height, width = rgb.shape[:2]
    if width != 2 * height:
        actual, advice = f"it is {width}x{height}", "Export it as latitude and longitude"
        refuse(panorama_name, "a picture twice as wide as high", actual, advice)
    return resample_panorama(
        rgb.astype(np.float32, copy=False), min(max(height, _MIN_PANORAMA_ROWS), max_rows)
    )


def texel_directions(height: int, width: int) -> Floats:
    """Return the unit vectors (h, w, 3) towards the centres of a panorama's texels."""
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    sine = np.sin(theta)[:, None]
    parts = sine * np.sin(phi), np.cos(theta)[:, None] * np.ones(width), -sine * np.cos(phi)
    return np.stack(parts, axis=-1)


def texel_solid_angles(height: int, width: int) -> Floats:
    """Return the solid angle (h, 1) of a texel in each row [sr]."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    return np.asarray((edges[:-1] - edges[1:])[:, None] * 2.0 * np.pi / width)


def mean_radiance(radiance: Floats) -> Floats:
    """Return the mean radiance (3,) over all directions."""
    height, width = radiance.shape[:2]
    return np.asarray(
        (radiance * texel_solid_angles(height, width)[..., None]).sum(axis=(0, 1)) / (4.0 * np.pi)
    )


def resample_panorama(radiance: NDArray[np.floating], height: int) -> Floats:
    """Resample a panorama to (height, 2 height, 3) by averaging over the solid angle of each new texel."""
    rows, columns = radiance.shape[:2]
    edges, target_edges = (-np.cos(np.linspace(0.0, np.pi, n + 1)) for n in (rows, height))
    upright = _interval_means(radiance, edges, target_edges)
    edges, target_edges = (np.linspace(0.0, 1.0, n + 1) for n in (columns, 2 * height))
    return _interval_means(upright.swapaxes(0, 1), edges, target_edges).swapaxes(0, 1)


def _interval_means(interval_values: NDArray[np.floating], edges: Floats, target_edges: Floats) -> Floats:
    """Return the means of a piecewise constant function over target intervals, along the first axis.

    interval_values : (n, ...) values of the function between consecutive `edges`
    edges : (n + 1,) increasing positions of the ends of the intervals on which the function is constant
    target_edges : (k + 1,) edges of the target intervals, over which the k means are taken
    """
    first = np.clip(np.searchsorted(edges, target_edges[:-1], "right") - 1, 0, len(interval_values) - 1)
    after = np.clip(np.searchsorted(edges, target_edges[1:], "left"), 1, len(interval_values))
    means = np.empty((len(first), *interval_values.shape[1:]))
    for k, (a, b) in enumerate(zip(first, after, strict=True)):
        overlap = np.diff(np.clip(edges[a : b + 1], target_edges[k], target_edges[k + 1]))
        means[k] = np.tensordot(overlap / overlap.sum(), interval_values[a:b], 1)
    return means


def panorama_file(panorama_name: str) -> Path | None:
    """Return the path of a panorama's picture, downloading a sample if necessary; None for "uniform".

    panorama_name : see `load_panorama`

    Raises DermisError for an unknown name.
    """
    if panorama_name == UNIFORM_PANORAMA:
        return None
    sample = SAMPLES.get(panorama_name)
    if sample is None:
        if not is_file(panorama_name):
            known = ", ".join([*_sample_names(), UNIFORM_PANORAMA])
            expected, actual = f"an .hdr or .exr file or one of {known}", "it is neither"
            refuse(f"environment {panorama_name!r}", expected, actual, "Check the name")
        return Path(panorama_name)
    if sample.kind != "environment":
        known = ", ".join(_sample_names())
        refuse(panorama_name, "an environment", f"this sample is a {sample.kind}", f"Use one of {known}")
    return fetch_sample(panorama_name)["environment"]


def _sample_names() -> list[str]:
    return [name for name, sample in SAMPLES.items() if sample.kind == "environment"]


@dataclass(frozen=True)
class Sun:
    """Bright peak of a panorama, rendered as a directional light.

    direction : (3,) unit vector towards the sun
    irradiance : (3,) irradiance of a surface that faces the sun, linear Rec. 709
    radius : angular radius [rad]
    """

    direction: Floats
    irradiance: Floats
    radius: float


def split_suns(radiance: Floats) -> tuple[Floats, list[Sun]]:
    """Extract suns from a panorama; return the panorama without the light of the suns, and the suns.

    Suns are sorted by irradiance, the strongest first.

    radiance : (h, w, 3) radiance of the panorama

    A sun is the radiance in excess of 32 times the mean, within 8 degrees of the centre of a bright cluster.
    At most four suns are extracted. Each sun causes at least 5 % of the irradiance that a uniform sky with
    the panorama's mean radiance would cause. This is a simplified median cut of light probes [Debevec2005].
    """
    mean = float(luminance(mean_radiance(radiance)))
    brightness = np.asarray(luminance(radiance), np.float64)
    above = brightness > _SUN_PEAK_FACTOR * mean
    towards = texel_directions(*radiance.shape[:2])[above]
    weight = np.broadcast_to(texel_solid_angles(*radiance.shape[:2]), above.shape)[above]
    kept_fraction = _SUN_PEAK_FACTOR * mean / brightness[above]
    light = radiance[above] * ((1.0 - kept_fraction) * weight)[:, None]
    remaining, suns = np.ones(len(kept_fraction)), list[Sun]()
    clusters = _bright_clusters(brightness[above], towards, weight)
    for inside in sorted(clusters, key=lambda cluster: -_luminance_sum(light[cluster])):
        if (
            len(suns) == MAX_SUNS
            or _luminance_sum(light[inside]) < _MIN_SUN_IRRADIANCE_FRACTION * np.pi * mean
        ):
            break
        suns.append(_fit_sun(light[inside], towards[inside], weight[inside]))
        remaining[inside] = kept_fraction[inside]
    remainder = radiance.copy()
    remainder[above] *= remaining[:, None]
    return remainder, suns


def _luminance_sum(colours: Floats) -> float:
    return float(luminance(colours.sum(axis=0)))


def _fit_sun(irradiances: Floats, unit_vectors: Floats, solid_angles: Floats) -> Sun:
    """Return the sun that replaces a cluster of n texels.

    The sun is a uniform disc with the irradiance of the cluster and the same integral of squared radiance.

    irradiances : (n, 3) radiance of each texel times the solid angle of the texel
    unit_vectors : (n, 3) unit vectors to the texels
    solid_angles : (n,) solid angles of the texels [sr]
    """
    grey = np.asarray(luminance(irradiances), np.float64)
    centre = grey @ unit_vectors
    solid_angle = grey.sum() ** 2 / (grey**2 / solid_angles).sum()
    return Sun(centre / np.linalg.norm(centre), irradiances.sum(axis=0), float(np.sqrt(solid_angle / np.pi)))


def _bright_clusters(
    brightness: Floats, unit_vectors: Floats, solid_angles: Floats
) -> list[NDArray[np.bool_]]:
    """Group n bright texels into clusters; return the mask (n,) of each cluster, brightest peak first.

    brightness : (n,) luminance of the texels
    unit_vectors : (n, 3) unit vectors to the texels
    solid_angles : (n,) solid angles of the texels [sr]
    """
    near = np.cos(np.radians(_SUN_CLUSTER_DEGREES))
    remaining = np.ones(len(brightness), bool)
    clusters = []
    while remaining.any():
        peak = np.where(remaining, brightness, 0.0).argmax()
        around = remaining & (unit_vectors @ unit_vectors[peak] > near)
        centre = solid_angles[around] @ unit_vectors[around]
        inside = remaining & (unit_vectors @ centre > near * np.linalg.norm(centre))
        inside[peak] = True
        remaining &= ~inside
        clusters.append(inside)
    return clusters
