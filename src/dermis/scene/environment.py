"""Settings of the environment: the panorama of distant light around a scene."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider


class Environment(FrozenModel):
    """Panorama of distant light around the head.

    The centre of the panorama lies behind the head. A camera in front of the face therefore shows this part
    of the panorama as background.

    Examples
    --------
    >>> import dermis
    >>> dermis.Environment("uniform").exposure
    1.0
    """

    name: str = Field(kw_only=False)
    """Panorama: a sample (royal_esplanade, lebombo), a latitude-longitude picture (.hdr, .exr), or "uniform"
    for radiance 1 from all directions."""
    rotation_degrees: Annotated[
        float,
        Field(ge=-3600, le=3600, json_schema_extra=slider(-180, 180)),
        BoundsReason("degrees: ten turns either way"),
    ] = 0.0
    """Rotation about the upward axis, counter-clockwise as seen from above [degrees]."""
    exposure: Annotated[
        float,
        Field(ge=0, le=1e6, json_schema_extra=slider(0.02, 10, logarithmic=True)),
        BoundsReason("up to 20 stops brighter; light is not negative"),
    ] = 1.0
    """Factor of the panorama's radiance."""
