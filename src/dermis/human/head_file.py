"""A person as a file that other programs open."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.build import SMALLEST, build_atlas
from dermis.base.atomic_write import replacing
from dermis.formats.gltf.write import encode_head
from dermis.human.person import Human
from dermis.human.person_file import numbers_of
from dermis.mesh.eyeball import EyePictures
from dermis.mesh.head import Head

_STRETCH = 1024
"""Side of the atlas that tells how long texels are, which changes little from one to the next."""


def write_person(
    path: Path,
    person: Human,
    head: Head,
    *,
    roughness: float,
    weights: Mapping[str, float] | None = None,
    eyes: EyePictures | None = None,
) -> int:
    """Write a person's head as a .glb file, whole or not at all; its length [byte].

    roughness : Beckmann's m of skin without a map of it [-]
    weights : of expressions with which the file rests
    eyes : what its eyes look like; of one colour where None
    """
    notes = {"person": numbers_of(person)}
    data = encode_head(
        head, roughness=roughness, weights=weights, slopes=relief_slopes(head), notes=notes, eyes=eyes
    )
    with replacing(path) as trial:
        trial.write_bytes(data)
    return len(data)


def relief_slopes(head: Head) -> NDArray[np.float32] | None:
    """(n, n, 2) rise of a head's height map to the right and upwards, if other programs need it [-].

    None where it has a map of normals, or no square height map: they need none.
    """
    height = head.maps.height
    if head.maps.normal is not None or height is None:
        return None
    side = len(height)
    if side != height.shape[1] or side < SMALLEST:
        return None
    down, right = np.gradient(height)
    coarse = max(SMALLEST, min(side, _STRETCH))
    stretch = build_atlas(head.mesh, coarse).stretch.astype(np.float32)
    if side > coarse:
        places = np.arange(side) * coarse // side
        stretch = stretch[places][:, places] * np.float32(side / coarse)
    return np.asarray(np.stack([right, -down], axis=-1) * stretch, np.float32)
