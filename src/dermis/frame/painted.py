"""A head whose painted maps are arrays, for files and for whatever else reads no textures."""

from __future__ import annotations

from dataclasses import fields, replace

from dermis.base.errors import refuse
from dermis.frame.passes.painting import paint
from dermis.frame.passes.painting.eye_pictures import eye_pictures
from dermis.gpu import Device
from dermis.human.skin.painted import PaintedMaps
from dermis.human.skin.surface import painting
from dermis.mesh.eyeball import EyePictures
from dermis.mesh.head import Head


def painted_head(device: Device, head: Head, side: int) -> tuple[Head, EyePictures | None]:
    """The head `with_painted_maps`, and what its eyes look like, if they are of true shape."""
    eyes = None if head.eyes is None else eye_pictures(device, head.eyes.look)
    return with_painted_maps(device, head, side), eyes


def with_painted_maps(device: Device, head: Head, side: int) -> Head:
    """The head with its painted maps as arrays; maps of its own stay, and other heads are as they were.

    side : of the painted maps, a power of two from 256 to 4096 [texels]

    Raises DermisError for other sides.
    """
    if not paint.LEAST <= side <= paint.MOST or side & (side - 1):
        expected = f"a power of two from {paint.LEAST} to {paint.MOST}"
        refuse("size of the maps", expected, f"{side} came", "Take 1024, 2048 or 4096")
    maps = head.maps
    if not isinstance(maps, PaintedMaps):
        return head
    found = paint.painted_maps(device, painting(head.mesh, head.control.stencils), maps.look, side)
    given = {one.name: getattr(maps, one.name) for one in fields(found)}
    if given["normal"] is not None:
        found = replace(found, height=None)
    return replace(head, maps=replace(found, **{k: v for k, v in given.items() if v is not None}))
