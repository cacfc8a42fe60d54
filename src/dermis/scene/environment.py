"""Light from all around as plain data."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dermis.scene.plain import Plain


class Environment(Plain):
    """A panorama around the head; its middle lies behind the head, where a camera before the face looks.

    name : a sample ("royal_esplanade", "lebombo"), a latitude-longitude picture (.hdr, .exr), or "uniform"
        for radiance 1 from everywhere
    rotation_degrees : turn about the upward axis, counter-clockwise seen from above
    exposure : factor of its radiance [-]
    visible : whether it is seen behind the head, out of focus and without its sun-like peaks
    """

    name: str
    rotation_degrees: Annotated[float, Field(ge=-3600, le=3600)] = 0.0
    exposure: Annotated[float, Field(ge=0, le=1e6)] = 1.0
    visible: bool = False
