"""Pulse of the skin: settings, and scenes with the pulse at a time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, NamedTuple

from pydantic import Field, model_validator

from dermis.base.errors import refuse
from dermis.base.quantities import checked_number
from dermis.human.living import TYPICAL_BEAT
from dermis.scene.field_errors import BoundsReason
from dermis.scene.frozen_model import FrozenModel, slider

if TYPE_CHECKING:  # NumPy takes longer to import than the help of the command line takes to print
    from dermis.base.arrays import Doubles
    from dermis.human.living.heartbeat import ModelledPulse, RecordedPulse
    from dermis.scene.model import Scene

_FACE_LEVER_MM = 90.0  # distance of the face in front of the joint of the head, about which the head nods
_MAX_TIME_S = 1e6
FIELDS_OF_MODEL = ("rate_per_min", "variability_ms", "respiration_per_min", "seed")
"""Fields of `Pulse` that do not apply to recordings."""


class PulseSample(NamedTuple):
    """Blood volume and head rotation at a time of the pulse.

    blood : (16,) relative change of the blood volume, see `SkinState` [-]
    nod_degrees : rotation of the head about x by the recoil of the heartbeat [degrees]
    """

    blood: Doubles
    nod_degrees: float


class Pulse(FrozenModel):
    """Heartbeat of a person, which changes the blood volume of the skin and moves the head.

    Sources: [Tang2020] for the waveform, docs/living.md for amplitudes and delays.

    Examples
    --------
    >>> import dermis
    >>> scene = dermis.Scene(dermis.Human().head(subdivide=0))
    >>> frames = [dermis.Pulse(rate_per_min=72).scene_at(scene, k / 25) for k in range(50)]
    >>> len(frames[0].state.blood)
    16
    """

    rate_per_min: Annotated[
        float,
        Field(ge=20, le=250, json_schema_extra=slider(40, 180)),
        BoundsReason("1/min: the range of human hearts"),
    ] = 72.0
    """Mean heart rate [1/min]."""
    amplitude: Annotated[
        float, Field(ge=0, le=0.5, json_schema_extra=slider(0, 0.2)), BoundsReason("of the blood volume")
    ] = 0.02
    """Peak-to-peak range of the blood volume of the forehead over a beat, relative to its mean."""
    variability_ms: Annotated[
        float, Field(ge=0, le=200), BoundsReason("ms: larger values are arrhythmias")
    ] = 0.0
    """Standard deviation of the intervals between beats [ms]."""
    respiration_per_min: Annotated[
        float, Field(ge=0, le=60), BoundsReason("1/min: nobody breathes faster")
    ] = 0.0
    """Rate of breathing, which modulates intervals, strength and blood volume; 0 for no effect [1/min]."""
    head_motion_mm: Annotated[
        float, Field(ge=0, le=5, json_schema_extra=slider(0, 1)), BoundsReason("mm: larger motions are nods")
    ] = 0.1
    """Peak-to-peak vertical motion of the face by the recoil of the heartbeat [mm]."""
    waveform: str = TYPICAL_BEAT
    """Waveform: "typical", a CSV file with one column (values of one beat at equal intervals), or a CSV file
    with the columns time [s] and value (a photoplethysmogram, in which higher values mean more blood)."""
    seed: Annotated[int, Field(ge=0, le=2**32 - 1), BoundsReason("a seed has 32 bits")] = 0
    """Seed of the random intervals between beats."""

    @model_validator(mode="after")
    def _check_recording(self) -> Pulse:
        if self.is_recording:
            for name in FIELDS_OF_MODEL:
                if name in self.model_fields_set:
                    advice = "Leave it out, or name a file with one beat"
                    refuse(f"pulse: {name}", "no value for a recording", "it is given", advice)
        return self

    @property
    def is_recording(self) -> bool:
        """Return whether the pulse is a recording, not a sequence of beats of one waveform."""
        from dermis.human.living.heartbeat import RecordedPulse

        return self.waveform != TYPICAL_BEAT and isinstance(self.signal(), RecordedPulse)

    def signal(self) -> ModelledPulse | RecordedPulse:
        """Return the pulse as a function of time; the contents of files are cached."""
        from dermis.scene.pulse_files import load_signal

        return load_signal(
            self.waveform, self.rate_per_min, self.variability_ms, self.respiration_per_min, self.seed
        )

    def at(self, seconds: float) -> PulseSample:
        """Return the pulse at a time.

        Parameters
        ----------
        seconds : float
            Time since the start of the first beat or of the recording, at least 0 [s].

        Returns
        -------
        PulseSample
            Changes of the blood volume for `SkinState`, and rotation of the head.

        Raises
        ------
        DermisError
            For an invalid time.
        """
        import numpy as np

        from dermis.human.living.zones import longest_delay_s
        from dermis.scene.living import PULSE_SAMPLE_COUNT

        signal = self.signal()
        end_s = min(signal.duration_s, _MAX_TIME_S)
        reason = "s: the length of the recording" if self.is_recording else "s"
        time_s = checked_number("pulse: time", seconds, 0.0, end_s, reason)
        delays = np.linspace(0.0, longest_delay_s(), PULSE_SAMPLE_COUNT)
        nod_degrees = math.degrees(self.head_motion_mm / _FACE_LEVER_MM) * signal.recoil(time_s)
        return PulseSample(self.amplitude * signal.blood(time_s - delays), nod_degrees)

    def truth_at(self, seconds: float) -> tuple[float, float, float]:
        """Return the ground truth of the pulse at a time.

        Parameters
        ----------
        seconds : float
            Time since the start of the first beat or of the recording, at least 0 [s].

        Returns
        -------
        tuple of float
            Time [s], relative change of the blood volume where the relative amplitude is 1 and the delay is 0
            [-], and upward motion of the face by the recoil [mm].
        """
        sample = self.at(seconds)
        return seconds, float(sample.blood[0]), -math.radians(sample.nod_degrees) * _FACE_LEVER_MM

    def scene_at(self, scene: Scene, seconds: float) -> Scene:
        """Return a copy of a scene with the pulse at a time, in addition to its states and its pose.

        Parameters
        ----------
        scene : Scene
            Scene with a person.
        seconds : float
            Time since the start of the first beat or of the recording, at least 0 [s].

        Returns
        -------
        Scene
            Scene with the blood volume and the head rotation at the time.

        Raises
        ------
        DermisError
            For an invalid time, and for heads without painted skin.
        """
        from dermis.scene.living import SkinState, check_living_head
        from dermis.scene.pulse_files import with_nod

        check_living_head(scene.head, scene.skin.albedo)  # before the pose, for which a head may lack bones
        sample = self.at(seconds)
        weights = scene.state.weights if scene.state else {}
        pose = scene.pose if self.head_motion_mm == 0.0 else with_nod(scene.pose, sample.nod_degrees)
        return scene.replace(state=SkinState(weights, sample.blood), pose=pose)
