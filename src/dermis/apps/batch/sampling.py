"""Sampling of the parameters of images by hashing, independently of the machine and of the images' order."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from math import exp

from scipy.special import ndtr, ndtri

from dermis.apps.batch.clips.frames import (
    FRAME_NAMES,
    MOTION_NAMES,
    PULSE_NAMES,
    VIEW_NAME,
    ImagePlace,
    ImageSequence,
    frame_parameters,
)
from dermis.apps.batch.clips.motion import MOVED_TARGETS
from dermis.apps.batch.clips.table import GENERATED_MOTION
from dermis.apps.batch.distributions import Constant, Distribution
from dermis.apps.batch.spec_tables import (
    GAZE_ANGLES,
    LAMP_RIG,
    NO_ENVIRONMENT,
    PICTURE_BACKGROUND,
    RANDOM_EXPRESSION,
    table_values,
)
from dermis.base.tables import read_rows
from dermis.human.expressions import EXPRESSIONS, TARGET_SIDES, Weights, expand_sides, expand_targets

Parameters = dict[str, float | int | str]
_JAW_MORPH_TARGET = "jawOpen"
_MOVEMENT_WEIGHT_EXPONENT = 1.5  # power of uniform numbers, so that small weights are more frequent
_UNIFORM_NUMBER_BITS = (
    52  # used bits of the hash; integers of so many bits plus one half are exact in double precision
)
_PERSON_PREFIX = "person."
_HEAD_PARAMETER = "person.head"
_SENSOR_PREFIX, _SENSOR_SEED = "sensor.", "sensor.seed"
_LENS_NAME = "lens.k1"
_SEED_COUNT = 2**32
_EXPRESSION_VARIATION_KEYS = "intensity", "asymmetry", "variation"
_LAMP_PREFIXES = tuple(f"light.{lamp}." for lamp in ("key", "fill", "rim"))
_BACKGROUND_CHANNELS = "background.red", "background.green", "background.blue"
_CONDITIONAL_PARAMETERS: tuple[tuple[str | tuple[str, ...], Callable[[Parameters], bool]], ...] = (
    (_LAMP_PREFIXES, lambda sampled: sampled["light.kind"] == LAMP_RIG),
    (("gaze.yaw_deg", "gaze.pitch_deg"), lambda sampled: sampled["gaze.at"] == GAZE_ANGLES),
    (
        ("environment.turn", "environment.strength"),
        lambda sampled: sampled["environment.name"] != NO_ENVIRONMENT,
    ),
    (_BACKGROUND_CHANNELS, lambda sampled: sampled["background.kind"] == "colour"),
    ("background.blur", lambda sampled: sampled["background.kind"] in ("environment", PICTURE_BACKGROUND)),
    (
        ("background.picture", "background.zoom", "background.crop"),
        lambda sampled: sampled["background.kind"] == PICTURE_BACKGROUND,
    ),
    ("camera.frame_mm", lambda sampled: "camera.focal_mm" not in sampled),
    ("sensor.white_kelvin", lambda sampled: sampled.get("sensor.white_balance") == "kelvin"),
    (
        ("sensor.full_well_electrons", "sensor.read_noise_electrons", _SENSOR_SEED),
        lambda sampled: bool(sampled.get("sensor.iso")),
    ),
    (("sensor.contrast", "sensor.shoulder"), lambda sampled: sampled.get("sensor.tone_curve") == "phone"),
    (
        ("clip.blinks", "clip.gaze", "clip.head", "clip.speech", "clip.syllables"),
        lambda sampled: sampled.get("clip.motion") == GENERATED_MOTION,
    ),
    ("blur.focus_mm", lambda sampled: bool(sampled.get("blur.f_number"))),
    ("clip.motion_start", lambda sampled: sampled.get("clip.motion") != GENERATED_MOTION),
    (
        ("clip.pulse_amplitude", "clip.pulse_variability", "clip.respiration"),
        lambda sampled: bool(sampled.get("clip.pulse_per_min")),
    ),
)
"""Prefixes of parameters that only some images have, and the condition under which an image has them."""


def table_numbers(parameters: Mapping[str, float | int | str], table_name: str) -> dict[str, float]:
    """Return the numeric parameters of one table of the spec, without the table's name in their names.

    table_name : dotted name of the table, such as "light.key"
    """
    return {
        name: one for name, one in table_values(parameters, table_name).items() if not isinstance(one, str)
    }


def hashed_uniform(seed: int, item_number: int, parameter: str) -> float:
    """Return a uniform random number in (0, 1) that depends only on a seed, an image and a parameter.

    The random number is a BLAKE2b hash of the three arguments as text. Random numbers for different arguments
    are therefore independent.

    item_number : number of the image, or of the person for parameters of people
    parameter : name of the parameter
    """
    digest = hashlib.blake2b(f"{seed} {item_number} {parameter}".encode(), digest_size=8).digest()
    step = int.from_bytes(digest, "little") >> (64 - _UNIFORM_NUMBER_BITS)
    return (step + 0.5) / float(1 << _UNIFORM_NUMBER_BITS)


def round_significant(number: float) -> float:
    """Return a number with six significant digits.

    After the sixth digit, computed logarithms and roots can differ between machines.
    """
    return float(f"{number:.6g}") + 0.0  # no -0.0


@dataclass(frozen=True)
class Movement:
    """Movement of a part of the face in random expressions: a row of mixture.csv.

    probability : probability of this movement among the movements of the same part of the face [-]
    max_weight : factor of `target_weights` for the movement at full strength [-]
    target_weights : relative weights of the morph targets, by name
    jaw_closing : fraction by which the movement, at full strength, reduces the opening of the jaw [-]
    """

    probability: float
    max_weight: float
    target_weights: Weights
    jaw_closing: float


@cache
def load_movements() -> Mapping[str, tuple[Movement, ...]]:
    """Return the facial movements in mixture.csv, grouped by part of the face."""
    by_part: dict[str, tuple[Movement, ...]] = {}
    for row in read_rows(str(__package__), "mixture"):
        words = row["moves"].split()
        weights = {name: float(weight) for name, weight in zip(words[::2], words[1::2], strict=True)}
        movement = Movement(float(row["chance"]), float(row["most"]), weights, float(row["shuts"]))
        by_part[row["part"]] = (*by_part.get(row["part"], ()), movement)
    return by_part


def random_expression(sample_uniform: Callable[[str], float]) -> dict[str, float]:
    """Return random weights of morph targets, with at most one movement in each part of the face.

    sample_uniform : function that returns a uniform random number in (0, 1) for the name of a parameter
    """
    weights: dict[str, float] = {}
    jaw_factor = 1.0
    for part, movements in load_movements().items():
        remaining, amount = (
            sample_uniform(f"{part}.which"),
            sample_uniform(f"{part}.weight") ** _MOVEMENT_WEIGHT_EXPONENT,
        )
        for movement in movements:
            if 0 <= remaining < movement.probability:
                scale = movement.max_weight * amount
                weights |= {name: scale * weight for name, weight in movement.target_weights.items()}
                jaw_factor *= 1.0 - movement.jaw_closing * amount
            remaining -= movement.probability
    if _JAW_MORPH_TARGET in weights:
        weights[_JAW_MORPH_TARGET] *= jaw_factor
    return weights


def expression_weights(
    target_weights: Weights,
    intensity: float,
    asymmetry: float,
    variation: float,
    sample_normal: Callable[[str], float],
) -> dict[str, float]:
    """Return the morph target weights (0 to 1) of a named expression, varied at random for one image.

    target_weights : weights of the expression by name of the morph target; a name without Left or Right
        moves both sides
    intensity : factor of all weights [-]
    asymmetry : relative increase of the weights on the left side, and relative decrease on the right side [-]
    variation : standard deviation of the logarithm of each weight [-]
    sample_normal : function that returns a standard normal random number for a target name
    """
    varied = {}
    for name, weight in target_weights.items():
        mean = weight * intensity * exp(variation * sample_normal(name)) if weight else 0.0
        for target in expand_sides(name):
            side = 0.0 if target == name and not _is_one_sided(name) else 1.0 - 2.0 * target.endswith("Right")
            varied[target] = min(max(mean * (1.0 + asymmetry * side), 0.0), 1.0)
    return varied


def _is_one_sided(target_name: str) -> bool:
    """Return whether a morph target acts on one side of the face and has a mirrored counterpart.

    False for targets such as mouthLeft and jawRight, which move the middle of the face sideways.
    """
    return target_name.endswith(TARGET_SIDES) and not target_name.startswith(
        ("jaw", "mouthLeft", "mouthRight")
    )


_SINGLE_PICTURES = ImageSequence()


@dataclass(frozen=True)
class Sampler:
    """Sampler of the parameters of each image of a data set.

    seed : seed of the data set
    images_per_person : number of consecutive images that show the same person
    distributions : distribution of each parameter by its dotted name
    cholesky_rows : weights of independent normal numbers for each correlated parameter, see
        `CorrelationGroup.cholesky_rows`
    expressions : weights of morph targets by name of the expression
    sequence : division of the images into clips and cameras
    lenses : parameters of the table [lens] for each calibrated camera of a rig; empty for other rigs
    """

    seed: int
    images_per_person: int
    distributions: Mapping[str, Distribution]
    cholesky_rows: Mapping[str, Mapping[str, float]]
    expressions: Mapping[str, Weights]
    sequence: ImageSequence = _SINGLE_PICTURES
    lenses: tuple[Mapping[str, float], ...] = ()

    def parameters(self, image_number: int, frame_offset: float = 0) -> Parameters:
        """Return the sampled parameters of one image by dotted name, independently of other images.

        frame_offset : number of frames after the image, in its clip or beyond
        """
        place = self.sequence.place(image_number)
        sampled = self._image_parameters(image_number)
        if self.sequence.views > 1:
            sampled[VIEW_NAME] = place.view
            lens = self.lenses[place.view] if self.lenses and _LENS_NAME in self.distributions else {}
            sampled |= {name: round_significant(value) for name, value in lens.items()}
        if self.sequence.rate_hz:
            frame = place._replace(frame=place.frame + frame_offset)
            sampled |= self._frame_parameters(frame, image_number, sampled)
        return sampled

    def _frame_parameters(self, frame: ImagePlace, image_number: int, sampled: Parameters) -> Parameters:
        uniform = lambda name: self._uniform_number(image_number, name)  # noqa: E731
        return frame_parameters(self.sequence, frame, sampled, uniform, round_significant)

    def _image_parameters(self, image_number: int) -> Parameters:
        """Return the parameters of an image without those of its frame and its camera."""
        person = image_number // self.images_per_person
        sampled: Parameters = {"person.number": person}
        if _HEAD_PARAMETER not in self.distributions:
            sampled["person.seed"] = int(hashed_uniform(self.seed, person, "person.seed") * _SEED_COUNT)
        for name, distribution in self.distributions.items():
            if not name.startswith("pose."):
                sampled[name] = self._sample_parameter(image_number, name, distribution)
        if self._has_sensor:
            sampled[_SENSOR_SEED] = int(hashed_uniform(self.seed, image_number, _SENSOR_SEED) * _SEED_COUNT)
        if sampled["background.kind"] == "environment" and sampled["environment.name"] == NO_ENVIRONMENT:
            sampled["background.kind"] = "gradient"
        for prefixes, applies in _CONDITIONAL_PARAMETERS:
            if not applies(sampled):
                sampled = {name: value for name, value in sampled.items() if not name.startswith(prefixes)}
        return sampled | {
            f"pose.{name}": weight for name, weight in self._target_weights(image_number, sampled).items()
        }

    @cached_property
    def parameter_names(self) -> tuple[str, ...]:
        """Return the names of all parameters that images can have, in the order of `parameters`."""
        person = (
            ["person.number"] if _HEAD_PARAMETER in self.distributions else ["person.number", "person.seed"]
        )
        names = [name for name in self.distributions if not name.startswith("pose.")]
        sensor = [_SENSOR_SEED] if self._has_sensor else []
        rig = [VIEW_NAME] if self.sequence.views > 1 else []
        clip = [*FRAME_NAMES, *MOTION_NAMES, *PULSE_NAMES] if self.sequence.rate_hz else []
        return *person, *names, *sensor, *rig, *clip, *(f"pose.{target}" for target in self.targets)

    @cached_property
    def _has_sensor(self) -> bool:
        return any(name.startswith(_SENSOR_PREFIX) for name in self.distributions)

    def _sample_parameter(self, image_number: int, parameter: str, distribution: Distribution) -> float | str:
        is_constant = isinstance(distribution, Constant)
        value = distribution.quantile(
            0.5 if is_constant else self._random_probability(image_number, parameter)
        )
        return value if isinstance(value, str) else round_significant(value)

    def _random_probability(self, image_number: int, parameter: str) -> float:
        """Return the random probability in (0, 1) for the `quantile` of a parameter's distribution.

        image_number : number of the image
        """
        weights = self.cholesky_rows.get(parameter)
        if weights is None:
            return self._uniform_number(image_number, parameter)
        return float(
            ndtr(sum(weight * self._normal_number(image_number, other) for other, weight in weights.items()))
        )

    def _uniform_number(self, image_number: int, parameter: str) -> float:
        is_of_person = parameter.startswith(_PERSON_PREFIX)
        number = image_number // (self.images_per_person if is_of_person else self.sequence.images)
        return hashed_uniform(self.seed, number, parameter)

    def _normal_number(self, image_number: int, parameter: str) -> float:
        return float(ndtri(self._uniform_number(image_number, parameter)))

    def _target_weights(self, image_number: int, sampled_parameters: Parameters) -> dict[str, float]:
        """Return a dictionary from morph target name to the target's weight in one image.

        It has an entry for each morph target that the spec can use, also for those with weight 0.

        image_number : number of the image
        sampled_parameters : parameters of the image that have been sampled so far
        """
        name = str(sampled_parameters["expression.name"])
        if name == RANDOM_EXPRESSION:
            weights: Weights = random_expression(
                lambda part: self._uniform_number(image_number, f"expression.mixture.{part}")
            )
        else:
            weights = self.expressions[name]
        intensity, asymmetry, variation = (
            float(sampled_parameters[f"expression.{key}"]) for key in _EXPRESSION_VARIATION_KEYS
        )
        varied = expression_weights(
            weights,
            intensity,
            asymmetry,
            variation,
            lambda name: self._normal_number(image_number, f"expression.variation.{name}"),
        )
        target_weights: dict[str, float | str] = {**varied}
        for target, distribution in table_values(self.distributions, "pose").items():
            weight = self._sample_parameter(image_number, f"pose.{target}", distribution)
            target_weights |= dict.fromkeys(expand_targets([target]), weight)
        return {target: round_significant(float(target_weights.get(target, 0.0))) for target in self.targets}

    @cached_property
    def targets(self) -> tuple[str, ...]:
        """Return the sorted names of all morph targets that the spec can use."""
        names = set(table_values(self.distributions, "pose"))
        for name in map(str, self.distributions["expression.name"].support):
            if name == RANDOM_EXPRESSION:
                for movements in load_movements().values():
                    names.update(*(movement.target_weights for movement in movements))
            else:
                names |= set(self.expressions[name])
        if self.sequence.rate_hz:
            names |= set(MOVED_TARGETS)
            if set(self.distributions["clip.motion"].support) != {GENERATED_MOTION}:
                names.update(*EXPRESSIONS.values())  # the targets of captures
        return tuple(sorted(expand_targets(sorted(names))))
