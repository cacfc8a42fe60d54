"""Light from all around as plain data."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider


class Environment(FrozenModel):
    """A panorama around the head; its middle lies behind the head, where a camera before the face looks."""

    name: str = Field(kw_only=False)
    """Light from all around: a sample (royal_esplanade, lebombo), a latitude-longitude picture (.hdr, .exr),
    or "uniform" for radiance 1 from everywhere."""
    rotation_degrees: Annotated[
        float,
        Field(ge=-3600, le=3600, json_schema_extra=slider(-180, 180)),
        BoundsReason("degrees: ten turns either way"),
    ] = 0.0
    """Turn of the environment about the upward axis, counter-clockwise as seen from above [degrees]."""
    exposure: Annotated[
        float,
        Field(ge=0, le=1e6, json_schema_extra=slider(0.02, 10, log=True)),
        BoundsReason("20 stops more; light is not negative"),
    ] = 1.0
    """Factor of the environment's radiance."""
