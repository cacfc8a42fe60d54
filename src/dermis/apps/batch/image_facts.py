"""Facts about an image that follow from its scene: the person, gaze errors and face boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache

from dermis.apps.batch.blur.samples import FOCUS_FACT_NAMES
from dermis.apps.batch.face_boxes import Box
from dermis.apps.batch.sampling import Parameters, hashed_uniform, round_significant
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import PICTURE_NAME
from dermis.base.arrays import Doubles
from dermis.human.person import Human, worn_items
from dermis.human.wear.look import NOTHING
from dermis.scene.opencv import OpenCvCamera

SPLITS = ("train", 0.8), ("val", 0.1), ("test", 0.1)
"""Names and fractions of the parts into which a data set is split by person."""
SPLIT_NAMES = tuple(name for name, _ in SPLITS)
"""Names of the splits, in the order of their numbers in `dermis.dataset.arrays`."""
SENSOR_FACT_NAMES = (
    "sensor.light_red",
    "sensor.light_green",
    "sensor.light_blue",
    "sensor.white_red",
    "sensor.white_green",
    "sensor.white_blue",
    "sensor.clipped_fraction",
)
"""Facts about the exposure of an image: the linear Rec. 709 colours, with luminance 1, of the lights of the
scene together and of the light that the white balance makes white, and the fraction of the pixels in which
the sensor is saturated."""
_SEED_FIELD = "seed"
_NO_FACTS: Mapping[str, float | str | None] = {}


@dataclass(frozen=True)
class ImageFacts:
    """Facts about an image that its parameters do not state.

    person : properties of the person by parameter name, such as "person.age", from `person_facts`
    gaze_error_deg : angles by which the left and the right eye miss the target of the gaze [degrees]; None
        for heads whose eyes cannot turn
    boxes : boxes around the face, see `face_boxes`; None if they are unknown
    light_colour : colour of the lights, see `lighting.light_colour`; None for a spec without [sensor]
    picture_K : intrinsic matrix (3, 3) of the picture, without the distortion of its lens; None if unknown
    sensor : facts about the exposure, by the names of `SENSOR_FACT_NAMES`; empty for a spec without [sensor]
    captured : weights of morph targets by captured motion, which replace those of the expression, by
        parameter name such as "pose.jawOpen"
    rig : all cameras of the rig by name, without distortion; empty for a spec without [rig]
    blur : facts about the aperture, by the names of `FOCUS_FACT_NAMES`; empty without depth of field
    """

    person: Mapping[str, float | str | None] = field(default_factory=lambda: _NO_FACTS)
    gaze_error_deg: tuple[float, float] | None = None
    boxes: Mapping[str, Box] | None = None
    light_colour: tuple[float, float, float] | None = None
    picture_K: Doubles | None = None
    sensor: Mapping[str, float] = field(default_factory=dict)
    captured: Mapping[str, float] = field(default_factory=dict)
    rig: Mapping[str, OpenCvCamera] = field(default_factory=dict)
    blur: Mapping[str, float] = field(default_factory=dict)


def person_facts(person: Human) -> dict[str, float | str | None]:
    """Return sex, age, ancestry, looks and clothing of a person by parameter name, such as "person.age".

    Numbers are rounded to six significant digits; None stands for a field without a value. Morph targets and
    seeds are not included.
    """
    looks = {"skin": person.look, "eyes": person.iris, "hair": person.hair_look}
    values = {f"person.{name}": value for name, value in _scalar_fields(person).items()}
    for part, look in looks.items():
        values |= {f"person.{part}.{name}": value for name, value in _scalar_fields(look).items()}
    values |= {f"person.{name}": item.text if item else NOTHING for name, item in worn_items(person).items()}
    return values


@cache
def person_fact_names() -> tuple[str, ...]:
    """Return the sorted names of all properties that `person_facts` returns."""
    return tuple(sorted(person_facts(Human())))


@cache
def text_fact_names() -> frozenset[str]:
    """Return the names of values in records that are strings, but that some images do not have."""
    of_people = (name for name, value in person_facts(Human()).items() if isinstance(value, str))
    return frozenset((*of_people, PICTURE_NAME))


def fact_names(spec: Spec) -> tuple[str, ...]:
    """Return the names of all facts that records list among the parameters of an image of a spec."""
    sensor = SENSOR_FACT_NAMES if spec.sensor is not None else ()
    return (*person_fact_names(), *sensor, *(FOCUS_FACT_NAMES if spec.blur is not None else ()))


def record_parameters(
    spec: Spec, parameters: Parameters, facts: Mapping[str, float | str | None]
) -> dict[str, float | int | str | None]:
    """Return the parameters of an image by name, with the same names for all images of a spec.

    The value is None for parameters that the image does not use.

    facts : properties of the person and facts about the exposure; a sampled parameter of the same name takes
        precedence
    """
    values: dict[str, float | int | str | None] = dict.fromkeys(spec.parameter_names)
    values |= dict.fromkeys(fact_names(spec))
    return values | dict(facts) | dict(parameters)


def image_split(spec: Spec, parameters: Parameters) -> str:
    """Return "train", "val" or "test", the same for all images of a person.

    If the spec names heads or files, images of the same head are in the same part, because several person
    numbers can share a head.
    """
    key = f"split {parameters.get('person.head', '')}"
    number = 0 if "person.head" in parameters else int(parameters["person.number"])
    threshold = hashed_uniform(spec.seed, number, key)
    for name, fraction in SPLITS:
        if threshold < fraction:
            return name
        threshold -= fraction
    return SPLITS[-1][0]


def _scalar_fields(owner: object) -> dict[str, float | str | None]:
    """Return the numbers and strings among the fields of a dataclass, by name."""
    found: dict[str, float | str | None] = {}
    for one in fields(owner):  # type: ignore[arg-type]
        value = getattr(owner, one.name)
        if one.name == _SEED_FIELD or not isinstance(value, int | float | str | None):
            continue
        found[one.name] = value if value is None or isinstance(value, str) else round_significant(value)
    return {name: value for name, value in found.items() if name not in ("skin", "eyes", "hair")}
