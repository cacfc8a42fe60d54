"""Maps of a head as picture files, for targets that read such."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.export.subject import Subject
from dermis.images.colour import encode_srgb8
from dermis.images.io import write_png
from dermis.mesh.maps import Maps

Files = dict[str, Path]


def painted(subject: Subject, side: int, adapter: str) -> Subject:
    """The subject with all maps of its head as arrays; it is itself where nothing has to be painted.

    side : of maps that are painted, a power of two from 256 to 4096 [texels]
    adapter : that paints
    """
    if subject.head is None or not subject.head.maps.painted:
        return subject
    from dermis.frame.painted import with_painted_maps
    from dermis.gpu.failures import on_device

    head = subject.head
    return subject.with_head(on_device(adapter, lambda device: with_painted_maps(device, head, side)))


def write_maps(subject: Subject, folder: Path, stem: str = "") -> Files:
    """The maps that a head has, as PNG, by role: colour (sRGB), normal (green up), grey ones.

    stem : what their names begin with, such as "skin_"
    """
    head = subject.head
    if head is None:
        return {}
    pictures = _pictures(head.maps)
    written = {}
    for role, levels in pictures.items():
        written[role] = folder / f"{stem}{role}.png"
        write_png(written[role], levels)
    return written


def _pictures(maps: Maps) -> dict[str, NDArray[Any]]:
    found = {}
    if maps.colour is not None:
        found["colour"] = encode_srgb8(maps.colour)
    if maps.normal is not None:
        slopes = np.concatenate([-maps.normal, np.ones((*maps.normal.shape[:2], 1))], axis=-1)
        unit = slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
        found["normal"] = _levels(0.5 + 0.5 * unit)
    for role in ("roughness", "specular"):
        if (grey := getattr(maps, role)) is not None:
            found[role] = _levels(grey)
    return found


def _levels(values: NDArray[Any]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(255.0 * np.clip(values, 0.0, 1.0)), np.uint8)
