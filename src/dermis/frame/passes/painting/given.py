"""What the shaders that paint a human's skin read, and the key of what they paint from it."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.disk import array_key
from dermis.base.errors import refuse
from dermis.frame.passes import PASSES, shader_folders
from dermis.gpu.program import source_of
from dermis.gpu.shader_types import record_of, struct_dtype
from dermis.human.skin import face, textures
from dermis.human.skin.colours import colour_tables
from dermis.human.skin.look import SkinLook
from dermis.human.skin.surface import Painting

SKIN, OWNER = "painting/skin.wgsl", "painting/owner.wgsl"
_MOST_TRIANGLES = 1 << 20  # that painted_surface.wgsl has bits for
_TEXEL = 4  # floats of a vector


class Given(NamedTuple):
    """What the shaders read.

    paint, tables : their records of numbers
    colours : (2, n, n, 3) of the face's skin and of the lips'
    """

    paint: Any
    tables: Any
    colours: NDArray[np.float32]
    surface: Painting


def given_for(surface: Painting, look: SkinLook, side: int) -> Given:
    """What maps of a look are painted from.

    side : of the maps [texels]

    Raises DermisError for too many triangles.
    """
    if surface.count >= _MOST_TRIANGLES:
        came = f"{surface.count:,} came"
        refuse("painted skin", f"fewer than {_MOST_TRIANGLES:,} triangles", came, "Subdivide less")
    text = _text(SKIN)
    names = set(struct_dtype(text, "Paint").names or ()) & set(vars(look))
    paint = record_of(text, "Paint", side=side, **{name: getattr(look, name) for name in names})
    tables = np.ndarray((), struct_dtype(text, "Tables"), _face(look.recession))
    return Given(paint, tables, colour_tables(look), surface)


def key_of(given: Given, driver: str) -> str:
    """The key of what a driver's shaders paint."""
    form = "\n".join((driver, _text(SKIN), _text(OWNER)))
    records = (np.frombuffer(record.tobytes(), np.uint8) for record in (given.paint, given.tables))
    return array_key([*records, given.colours, given.surface.vertices, given.surface.triangles], form)


@cache
def _text(shader: str) -> str:
    return source_of(PASSES / shader, shader_folders()).text


def _face(recession: float) -> bytes:
    """Noises, dots, zones, folds and the edge of the hair, as spot.wgsl reads them."""
    folds, edge = face.folds(), face.hairline(recession)
    ends = np.column_stack([folds.first[:-1], folds.first[1:] - 1]).astype(np.float32)
    curves = np.pad(np.hstack([folds.curves, ends]), ((0, 0), (0, _TEXEL - 2)))
    hairline = np.pad(np.column_stack([edge, np.append(edge[1:], edge[-1])]), ((0, 0), (0, _TEXEL - 2)))
    tables = (
        textures.noise_table(),
        textures.dot_table(),
        face.zones(recession),
        curves,
        folds.knots,
        hairline,
    )
    return b"".join(table.tobytes() for table in tables)
