"""Order of the images of clips and of several cameras, and the parameters of each frame."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from dermis.apps.batch.clips.motion import clip_pulse, motion_at, pulse_time_s
from dermis.apps.batch.clips.table import GENERATED_MOTION

MOTION_NAMES = (
    "clip.head_yaw_deg",
    "clip.head_pitch_deg",
    "clip.head_roll_deg",
    "clip.gaze_yaw_deg",
    "clip.gaze_pitch_deg",
    "clip.blink",
)
"""Parameters of generated motion at the time of a frame."""
PULSE_NAMES = "clip.pulse_seed", "clip.pulse_blood"
VIEW_NAME = "rig.view"
"""Parameter with the number of the camera."""
FRAME_NAMES = "clip.number", "clip.frame", "clip.time_s"
_SEED_COUNT = 2**32
_TIME_DECIMALS = 9  # of times in seconds
Values = dict[str, float | int | str]


class ImagePlace(NamedTuple):
    """Place of an image in a data set: number of its moment or clip, of its camera, and of its frame.

    The frame is a fraction for times between frames, such as those of motion blur.
    """

    moment: int
    view: int
    frame: float


@dataclass(frozen=True)
class ImageSequence:
    """Division of the images of a data set into moments or clips, these into cameras, and these into frames.

    frames : number of frames of a clip; 1 for single pictures
    rate_hz : frames per second; 0 for single pictures
    views : number of cameras
    """

    frames: int = 1
    rate_hz: float = 0.0
    views: int = 1

    @property
    def images(self) -> int:
        """Return the number of images of a moment or clip with all its cameras."""
        return self.frames * self.views

    def place(self, image_number: int) -> ImagePlace:
        """Return the place of an image."""
        moment, within = divmod(image_number, self.images)
        view, frame = divmod(within, self.frames)
        return ImagePlace(moment, view, frame)


def frame_parameters(
    sequence: ImageSequence,
    place: ImagePlace,
    sampled: Mapping[str, float | int | str],
    uniform_number: Callable[[str], float],
    round_number: Callable[[float], float],
) -> Values:
    """Return the parameters of a frame that follow from the motion and the pulse of its clip.

    place : place of the image; its frame may also precede or follow those of the clip
    sampled : sampled parameters of the clip
    uniform_number : function that returns a uniform random number of the clip for a parameter's name
    round_number : function that rounds the numbers of records

    The weights of moved morph targets are in the result as "pose.NAME" if `sampled` has them.
    """
    time_s = place.frame / sequence.rate_hz
    values: Values = {
        "clip.number": place.moment,
        "clip.frame": place.frame,
        "clip.time_s": round(time_s, _TIME_DECIMALS),  # six digits would be coarse late in long clips
    }
    clip = {
        k.removeprefix("clip."): float(v)
        for k, v in sampled.items()
        if k.startswith("clip.") and not isinstance(v, str)
    }
    if sampled["clip.motion"] == GENERATED_MOTION:
        seed = int(uniform_number("clip.motion_seed") * _SEED_COUNT)
        moved = motion_at(seed, sequence.frames / sequence.rate_hz, clip, time_s)
        numbers = (*moved.head_deg, *moved.gaze_deg, moved.blink)
        values |= {name: round_number(one) for name, one in zip(MOTION_NAMES, numbers, strict=True)}
        for name, weight in sampled.items():
            if name.startswith("pose."):
                values[name] = round_number(moved.moved_weight(name.removeprefix("pose."), float(weight)))
    if clip.get("pulse_per_min"):
        seed = int(uniform_number("clip.pulse_seed") * _SEED_COUNT)
        blood = clip_pulse(seed, clip).truth_at(pulse_time_s(seed, clip, time_s))[1]
        values |= {"clip.pulse_seed": seed, "clip.pulse_blood": round_number(blood)}
    return values
