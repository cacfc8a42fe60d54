"""Table [clip] of a data set's spec: consecutive images that are the frames of a person in motion."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from dermis.apps.batch.distributions import Constant, Distribution, Uniform
from dermis.apps.batch.spec_tables import NameField, NumberField
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel

GENERATED_MOTION = "generated"
"""Value of `motion` for generated motion, without a capture."""
_FRACTION = NumberField(0, 1)
_RATE_REASON = BoundsReason("frames per second")


class ClipTable(FrozenModel):
    """TOML table of a data set's spec with clips: consecutive images are the frames of a person in motion.

    The other tables are sampled once for each clip: one expression, light and camera, to which the motion is
    added.
    """

    frames: Annotated[int, Field(ge=2, le=100_000), BoundsReason("an hour at 28 frames per second")]
    """Number of frames of each clip."""
    rate_hz: Annotated[float, Field(ge=1, le=240), _RATE_REASON] = 30.0
    """Frames per second [1/s]."""
    flow: Annotated[bool | None, AfterValidator(lambda flow: flow or None)] = None
    """Whether to store the optical flow to the previous and the next frame, with masks of hidden points."""
    motion: Annotated[Distribution, NameField()] = Constant(GENERATED_MOTION)
    """Motion: "generated" from the other keys, or captures (.csv of Live Link Face, .json of MediaPipe)."""
    motion_start: Annotated[Distribution, _FRACTION] = Uniform(0, 1)
    """Start of the clip in its capture, from the earliest (0) to the latest (1) possible one [-]."""
    blinks_per_min: Annotated[Distribution, NumberField(0, 60, "1/min")] = Constant(17.0)
    """Mean rate of blinks [1/min]."""
    gaze_shifts_per_min: Annotated[Distribution, NumberField(0, 240, "1/min")] = Constant(40.0)
    """Mean rate of saccades between fixations around the target of the gaze [1/min]."""
    gaze_spread_deg: Annotated[Distribution, NumberField(0, 15, "degrees")] = Constant(5.0)
    """Standard deviation of the yaw of fixations; that of their pitch is 0.6 times as large [degrees]."""
    head_motion_deg: Annotated[Distribution, NumberField(0, 10, "degrees")] = Constant(1.5)
    """Root mean square of the head's yaw by motion; pitch has 0.6 and roll 0.4 times as much [degrees]."""
    head_motion_hz: Annotated[Distribution, NumberField(0.02, 2, "1/s")] = Constant(0.25)
    """Mean frequency of the head's motion [1/s]."""
    speech: Annotated[Distribution, _FRACTION] = Constant(0.0)
    """Amount of speech-like movement of jaw and lips, from 0 for silence to 1 [-]."""
    syllables_per_s: Annotated[Distribution, NumberField(1, 8, "1/s")] = Constant(4.5)
    """Rate of syllables within phrases of speech [1/s]."""
    pulse_per_min: Annotated[Distribution, NumberField(0, 250, "1/min")] = Constant(0.0)
    """Heart rate, at least 20; 0 for skin without a pulse [1/min]."""
    pulse_amplitude: Annotated[Distribution, NumberField(0, 0.5)] = Constant(0.02)
    """Peak-to-peak change of the blood volume by the pulse, relative to its mean [-]."""
    pulse_variability_ms: Annotated[Distribution, NumberField(0, 200, "ms")] = Constant(0.0)
    """Standard deviation of the intervals between beats [ms]."""
    respiration_per_min: Annotated[Distribution, NumberField(0, 60, "1/min")] = Constant(0.0)
    """Rate of breathing, which modulates the pulse; 0 for no effect [1/min]."""
