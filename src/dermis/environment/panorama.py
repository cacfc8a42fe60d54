"""Latitude-longitude pictures of the light that arrives from all around."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.errors import refuse
from dermis.images.io import read_image
from dermis.mesh.samples import SAMPLES, fetch

Floats = NDArray[np.float64]
UNIFORM = "uniform"
"""Name of the panorama with radiance 1 everywhere."""
_LEAST_ROWS, _MOST_ROWS = 256, 512
"""Fewer are divided, for sums over texels stand for integrals; more averaged: a fine lobe spans 16 texels."""
_BRIGHTEST = 1e12  # far beyond any sun; keeps single precision on the device from overflowing


def load_panorama(name: str) -> Floats:
    """(h, w, 3) radiance, linear Rec. 709; the picture's middle lies at -Z, its right at +X, its top at +Y.

    name : a sample, a file (.hdr, .exr), or "uniform"

    Raises DermisError for a name that is neither, and for a picture that holds no radiance.
    """
    path = panorama_file(name)
    if path is None:
        return np.ones((_LEAST_ROWS, 2 * _LEAST_ROWS, 3))
    image = read_image(path)
    if image.dtype != np.float32:
        came, remedy = f"it is a picture of {image.dtype.name}", "Take its .hdr or .exr version"
        refuse(name, "a picture of radiance (.hdr, .exr)", came, remedy)
    rgb = np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]
    low, high = float(rgb.min()), float(rgb.max())
    if low < 0 or not 0 < high <= _BRIGHTEST:
        expected = f"radiance from 0 to {_BRIGHTEST:g}, not all of it 0"
        refuse(name, expected, f"it is from {low:g} to {high:g}", "Export it again")
    height, width = rgb.shape[:2]
    if width != 2 * height:
        came, remedy = f"it is {width}x{height}", "Export it as latitude and longitude"
        refuse(name, "a picture twice as wide as high", came, remedy)
    return resampled(rgb.astype(np.float32, copy=False), min(max(height, _LEAST_ROWS), _MOST_ROWS))


def directions(height: int, width: int) -> Floats:
    """(h, w, 3) unit vectors towards the centres of a panorama's texels."""
    theta = np.pi * (np.arange(height) + 0.5) / height
    phi = 2.0 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    sine = np.sin(theta)[:, None]
    parts = sine * np.sin(phi), np.cos(theta)[:, None] * np.ones(width), -sine * np.cos(phi)
    return np.stack(parts, axis=-1)


def solid_angles(height: int, width: int) -> Floats:
    """(h, 1) solid angle of a texel of each row [sr]."""
    edges = np.cos(np.pi * np.arange(height + 1) / height)
    angles: Floats = (edges[:-1] - edges[1:])[:, None] * 2.0 * np.pi / width
    return angles


def mean_radiance(radiance: Floats) -> Floats:
    """(3,) mean over all directions."""
    height, width = radiance.shape[:2]
    mean: Floats = (radiance * solid_angles(height, width)[..., None]).sum(axis=(0, 1)) / (4.0 * np.pi)
    return mean


def resampled(radiance: NDArray[np.floating], height: int) -> Floats:
    """The panorama as (height, 2 height, 3): means over each texel's solid angle, whatever the sizes."""
    rows, columns = radiance.shape[:2]
    ours, theirs = (-np.cos(np.linspace(0.0, np.pi, n + 1)) for n in (rows, height))
    upright = _means(radiance, ours, theirs)
    ours, theirs = (np.linspace(0.0, 1.0, n + 1) for n in (columns, 2 * height))
    return _means(upright.swapaxes(0, 1), ours, theirs).swapaxes(0, 1)


def _means(values: NDArray[np.floating], edges: Floats, wanted: Floats) -> Floats:
    """Means between each two of `wanted` of what is constant between each two of `edges`; first axis."""
    first = np.clip(np.searchsorted(edges, wanted[:-1], "right") - 1, 0, len(values) - 1)
    after = np.clip(np.searchsorted(edges, wanted[1:], "left"), 1, len(values))
    means = np.empty((len(first), *values.shape[1:]))
    for k, (a, b) in enumerate(zip(first, after, strict=True)):
        share = np.diff(np.clip(edges[a : b + 1], wanted[k], wanted[k + 1]))
        means[k] = np.tensordot(share / share.sum(), values[a:b], 1)
    return means


def panorama_file(name: str) -> Path | None:
    """Where a panorama lies; None for the uniform one.

    Raises DermisError when there is none of this name.
    """
    if name == UNIFORM:
        return None
    sample = SAMPLES.get(name)
    if sample is None:
        if not Path(name).is_file():
            known = ", ".join([*_sample_names(), UNIFORM])
            expected, came = f"an .hdr or .exr file or one of {known}", "it is neither"
            refuse(f"environment {name!r}", expected, came, "Check the name")
        return Path(name)
    if sample.kind != "environment":
        known = ", ".join(_sample_names())
        refuse(name, "an environment", f"this sample is a {sample.kind}", f"Use one of {known}")
    return fetch(name)["environment"]


def _sample_names() -> list[str]:
    return [name for name, sample in SAMPLES.items() if sample.kind == "environment"]
