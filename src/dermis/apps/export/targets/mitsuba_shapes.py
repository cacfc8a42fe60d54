"""A head's skin as Mitsuba takes it: closed surfaces around a medium."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dermis.apps.export.targets.mitsuba_ply import ply
from dermis.apps.validation.truths.mitsuba_scene import gap_of
from dermis.apps.validation.truths.mitsuba_solid import Solid, inwards, skin_solid
from dermis.mesh.head import Head


class Surfaces(NamedTuple):
    """Files of triangles by the names of their shapes.

    skin, caps : with normals and uv, and what shuts its openings
    upper, upper_caps : the same a little outside, for a matched surface, which is there twice
    """

    skin: bytes
    caps: bytes | None
    upper: bytes
    upper_caps: bytes | None


def surfaces(words: Any, head: Head) -> Surfaces:
    """The head about its centre [mm].

    words : the module `mitsuba`, or what stands in for it

    Raises DermisError when the skin encloses no volume.
    """
    mesh, centre = head.mesh, np.array(head.centre_mm, np.float32)
    solid = skin_solid(mesh, head.name)
    solid = replace(solid, positions=(solid.positions - centre).astype(np.float32))
    skin = np.array([material.kind == "skin" for material in mesh.materials])[mesh.material]
    outer, _ = inwards(solid, -gap_of(words, solid), head.name)
    used, corners = np.unique(mesh.triangles[skin], return_inverse=True)
    of_solid = np.unique(mesh.point[used], return_inverse=True)[1]  # as the solid's points are numbered
    given = mesh.normals[used], mesh.uv[used]
    count = int(skin.sum())
    sheets = [ply(corners.reshape(-1, 3), one.positions[of_solid], *given) for one in (solid, outer)]
    caps = [_caps(one, count) for one in (solid, outer)]
    return Surfaces(sheets[0], caps[0], sheets[1], caps[1])


def files_of(made: Surfaces) -> Iterator[tuple[str, bytes]]:
    """Names and contents."""
    for name, content in made._asdict().items():
        if content is not None:
            yield f"meshes/{name}.ply", content


def _caps(solid: Solid, first: int) -> bytes | None:
    """The triangles from one on, None for none."""
    if len(solid.triangles) == first:
        return None
    used, corners = np.unique(solid.triangles[first:], return_inverse=True)
    return ply(corners.reshape(-1, 3), solid.positions[used])
