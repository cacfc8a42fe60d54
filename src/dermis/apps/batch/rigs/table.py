"""Table [rig] of a data set's spec: several cameras that see the same moment."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.apps.batch.distributions import Distribution
from dermis.apps.batch.spec_tables import NumberField
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel


class RigTable(FrozenModel):
    """TOML table of a data set's spec with several cameras; the table [camera] places the rig as a whole."""

    kind: Literal["stereo", "orbit", "file"]
    """Two cameras side by side, cameras on an arc around the head, or the cameras of a file."""
    baseline_mm: Annotated[Distribution | None, NumberField(1, 5000, "mm")] = None
    """Distance of the two cameras of "stereo", by default 120 [mm]."""
    parallel: bool | None = None
    """Whether the cameras of "stereo" have parallel axes; by default they look at the same point."""
    count: Annotated[int | None, Field(ge=2, le=64), BoundsReason("cameras of a light stage")] = None
    """Number of cameras of "orbit", by default 8."""
    arc_deg: Annotated[Distribution | None, NumberField(1, 360, "degrees")] = None
    """Angle between the first and the last camera of "orbit", by default 180; with 360, they are
    evenly spaced on a full circle [degrees]."""
    file: str | None = None
    """File of calibrations for "file": JSON or OpenCV's YAML with K, dist, R, t and size of each camera."""
    unit_mm: Annotated[float | None, Field(gt=0, le=1e6), BoundsReason("mm")] = None
    """Length of one unit of the translations in the file, by default 1 [mm]."""
    anchor: Literal["head", "first"] | None = None
    """Position of the cameras of "file": "head" (default) if R and t are relative to the head's centre, or
    "first" if the table [camera] places the first camera, and the others relative to it."""
