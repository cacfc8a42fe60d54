"""Table [blur] of a data set's spec: depth of field, and motion blur."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.spec_tables import NumberField
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel


class BlurTable(FrozenModel):
    """TOML table of a data set's spec with the blur of pictures; labels stay sharp."""

    samples: Annotated[int, Field(ge=2, le=1024), BoundsReason("frames for each picture")] = 16
    """Number of frames whose average is a picture, at points of the aperture and times of the exposure."""
    f_number: Annotated[Distribution, NumberField(0, 64, "0 is a pinhole")] = Constant(0.0)
    """Focal length divided by the diameter of the aperture, for a sensor 24 mm high; 0 for a pinhole [-]."""
    focus_mm: Annotated[Distribution, NumberField(-2000, 2000, "mm")] = Constant(0.0)
    """Distance of the plane in focus behind the cornea of the nearer eye; negative in front of it [mm]."""
    shutter_ms: Annotated[Distribution, NumberField(0, 1000, "ms")] = Constant(0.0)
    """Duration of the exposure, whose middle is the time of the frame; requires [clip] if above 0 [ms]."""
