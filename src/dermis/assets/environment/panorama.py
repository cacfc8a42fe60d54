"""Latitude-longitude pictures of the light that arrives from all around."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.assets.samples import SAMPLES, fetch
from dermis.errors import refuse
from dermis.images.io import read_image

Floats = NDArray[np.float64]
UNIFORM = "uniform"
"""Name of the panorama with radiance 1 everywhere."""
_WIDEST = 1024  # a wider picture is averaged: the finest lobe still spans 16 of its texels
_LEAST_ROWS = 256  # a smaller one is divided: sums over its texels stand for integrals


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
    if not np.isfinite(rgb).all() or rgb.min() < 0 or not rgb.any():
        came = "it is black, or has negative or infinite pixels"
        refuse(name, "radiance of 0 and more", came, "Export it again")
    height, width = rgb.shape[:2]
    if width != 2 * height:
        came, remedy = f"it is {width}x{height}", "Export it as latitude and longitude"
        refuse(name, "a picture twice as wide as high", came, remedy)
    finer = -(-_LEAST_ROWS // height)
    return reduced(rgb.astype(np.float64).repeat(finer, axis=0).repeat(finer, axis=1))


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


def reduced(radiance: Floats, widest: int = _WIDEST) -> Floats:
    """The panorama at most about `widest` wide: blocks of texels averaged by their solid angle."""
    height, width = radiance.shape[:2]
    factor = width // widest
    while factor > 1 and (height % factor or width % factor):
        factor -= 1
    if factor <= 1:
        return radiance
    weight = solid_angles(height, width)[..., None]
    blocks = (radiance * weight).reshape(height // factor, factor, width // factor, factor, 3)
    total = weight.reshape(height // factor, factor, 1, 1).sum(axis=1) * factor
    return np.asarray(blocks.sum(axis=(1, 3)) / total)


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
