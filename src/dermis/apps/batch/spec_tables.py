"""Tables of a spec: the keys of each table with their bounds, and correlations between parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, model_validator
from pydantic_core import core_schema

from dermis.apps.batch.distributions import Constant, Distribution, Uniform, parse_distribution, require
from dermis.human.makehuman import OLD_AGE, YOUNG_AGE
from dermis.human.skin.measured import ITA_RANGE, SKIN_ANCESTRIES
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.lights import light_presets

LAMP_RIG = "rig"
RANDOM_EXPRESSION = "mixture"
NO_ENVIRONMENT = "none"
GAZE_CAMERA, GAZE_ANGLES = "camera", "angles"
PICTURE_BACKGROUND, PICTURE_NAME = "picture", "background.picture"
BACKGROUND_KINDS = "none", "gradient", "environment", "colour", PICTURE_BACKGROUND
_DISTRIBUTION_RANGE_NOTE = "; normal extends 6 sd to both sides, truncated to its limits"


class DistributionField:
    """Annotation that makes pydantic parse a field of a spec's table as a distribution."""

    def check(self, spec_value: object) -> Distribution | None:
        """Return the distribution that a value describes; None for an omitted field.

        Raises ValueError, with the valid values, if `spec_value` is not a distribution, or if the
        distribution can give samples that the field does not allow.
        """
        if spec_value is None:
            return None
        distribution = parse_distribution(spec_value)
        self.check_support(distribution)
        return distribution

    def check_support(self, distribution: Distribution) -> None:
        """Raise ValueError if the distribution can give samples that the field does not allow."""

    def __get_pydantic_core_schema__(
        self, source_type: object, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Return the pydantic schema that parses and serialises a distribution."""
        serialise = core_schema.plain_serializer_function_ser_schema(
            lambda value: value and value.spec_value()
        )
        return core_schema.no_info_plain_validator_function(self.check, serialization=serialise)


class NumberField(DistributionField):
    """Annotation of a field whose samples are numbers between two bounds.

    lower_bound, upper_bound : smallest and largest valid sample
    reason : unit or explanation of the bounds, shown in error messages
    """

    def __init__(self, lower_bound: float, upper_bound: float, reason: str = "") -> None:
        self.ge, self.le, self.reason = lower_bound, upper_bound, reason

    def check_support(self, distribution: Distribution) -> None:
        """Raise ValueError unless all samples of the distribution are numbers between the bounds."""
        if any(isinstance(bound, str) or not self.ge <= bound <= self.le for bound in distribution.support):
            reason = f" ({self.reason})" if self.reason else ""
            note = "" if isinstance(distribution, Constant) else _DISTRIBUTION_RANGE_NOTE
            raise ValueError(f"numbers from {self.ge:.10g} to {self.le:.10g}{reason}{note}")


class NameField(DistributionField):
    """Annotation of a field whose samples are names from a list, or any names if there is no list.

    allowed_names : function that returns the list; None if there is no list
    """

    def __init__(self, allowed_names: Callable[[], Iterable[str]] | None = None) -> None:
        self.allowed_names = allowed_names

    def check_support(self, distribution: Distribution) -> None:
        """Raise ValueError unless all samples are names, and in the list of allowed names if there is one."""
        names = list(self.allowed_names()) if self.allowed_names else []
        for value in distribution.support:
            if not isinstance(value, str) or (names and value not in names):
                raise ValueError(f"one of {', '.join(names)}" if names else "a name, or a choice of names")
        if names and not distribution.support:
            raise ValueError(f"one of {', '.join(names)}, no files")


_MAX_CORRELATED_PARAMETERS = 50
_CorrelationCoefficient = Annotated[float, Field(ge=-1, le=1)]


class CorrelationGroup(FrozenModel):
    """Parameters correlated by a Gaussian copula, which preserves the distribution of each parameter.

    For each parameter, a standard normal number is drawn; the numbers of different parameters are correlated.
    The parameter's sample is the quantile of its distribution at the cumulative probability of this number. A
    larger number therefore gives a larger sample, or a later alternative of a choice.
    """

    of: tuple[str, ...]
    """Names of parameters, such as ["camera.yaw_deg", "head.yaw_deg"]; names of [person] come first."""
    correlation: _CorrelationCoefficient | tuple[tuple[_CorrelationCoefficient, ...], ...]
    """Correlation of all pairs, or a symmetric matrix with one row per name."""

    @model_validator(mode="after")
    def _check_correlation_matrix(self) -> CorrelationGroup:
        count = len(self.of)
        require(
            2 <= len(set(self.of)) == count <= _MAX_CORRELATED_PARAMETERS,
            f"2 to {_MAX_CORRELATED_PARAMETERS} names, each once",
        )
        if isinstance(self.correlation, tuple):
            square = [len(row) for row in self.correlation] == [count] * count
            require(square, f"a correlation matrix of {count} rows of {count} numbers")
        matrix = self.matrix
        symmetric = np.array_equal(matrix, matrix.T) and (np.diag(matrix) == 1).all()
        require(bool(symmetric), "a correlation matrix that is symmetric, with 1 on its diagonal")
        definite = np.linalg.eigvalsh(matrix)[0] >= 1e-6
        require(definite, "a correlation matrix that is positive definite: these contradict each other")
        return self

    @property
    def matrix(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Return the correlation matrix (n, n) of the parameters."""
        if isinstance(self.correlation, tuple):
            return np.array(self.correlation, np.float64)
        count = len(self.of)
        return np.full((count, count), self.correlation) + (1.0 - self.correlation) * np.eye(count)

    def cholesky_rows(self) -> dict[str, dict[str, float]]:
        """Return, for each parameter, the weights that turn independent normal numbers into correlated ones.

        The correlated number of a parameter is the weighted sum of the independent numbers of all parameters.
        The weights of one parameter, by parameter name, are a row of the correlation matrix's Cholesky
        factor.
        """
        lower = np.linalg.cholesky(self.matrix)
        return {
            name: {other: float(lower[k, j]) for j, other in enumerate(self.of[: k + 1])}
            for k, name in enumerate(self.of)
        }


T = TypeVar("T")


def table_values(values_by_dotted_name: Mapping[str, T], table_name: str) -> dict[str, T]:
    """Return the entries of one table of the spec, without the table's name in their names.

    values_by_dotted_name : entries of all tables by dotted name, such as "light.key.size_mm"
    table_name : dotted name of the table, such as "light.key"
    """
    start = f"{table_name}."
    return {
        name.removeprefix(start): one for name, one in values_by_dotted_name.items() if name.startswith(start)
    }


_ANGLE_FIELD = NumberField(-180, 180, "degrees")
_ELEVATION_FIELD = NumberField(-85, 85, "degrees: straight above, the yaw is undefined")
_FRACTION_FIELD = NumberField(0, 1)
_AGE_FIELD = NumberField(YOUNG_AGE, OLD_AGE, "years: the ages that the human model covers")
_ITA_FIELD = NumberField(*ITA_RANGE, "degrees: of measured people")
_SIGNED_FRACTION_FIELD = NumberField(-1, 1, "0 is the average")
_HAIR_MELANIN_FIELD = NumberField(0, 10, "0.3 is blond, 8 black")
_CAMERA_DISTANCE_FIELD = NumberField(150, 20_000, "mm: from close-up to telephoto")
_LIGHT_STRENGTH_FIELD = NumberField(0, 100, "light cannot be negative")
_Distributions = dict[str, Annotated[Distribution, DistributionField()]]


class PersonTable(FrozenModel):
    """TOML table of a data set's spec with the people to sample.

    All omitted keys are sampled at random, unless `head` names existing heads.
    """

    head: Annotated[Distribution | None, NameField()] = None
    """Heads in place of sampled people: names as in `dermis render`, or files of people (.json), meshes
    (.glb, .obj, .ply) or scenes (.toml), of which head and skin are used."""
    age: Annotated[Distribution | None, _AGE_FIELD] = None
    """Age, which also determines skin and hair [years]."""
    sex: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Sex, from 0 (female) to 1 (male)."""
    african: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Fraction of African ancestry; the three ancestries are normalised, and omitted ones are 0."""
    asian: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Fraction of Asian ancestry."""
    caucasian: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Fraction of Caucasian ancestry."""
    skin_ancestry: Annotated[Distribution | None, NameField(lambda: SKIN_ANCESTRIES)] = None
    """Measured group that determines the colours of skin, eyes and hair, independently of the shape."""
    ita: Annotated[Distribution | None, _ITA_FIELD] = None
    """Individual typology angle of the cheek, from -65 (darkest) to 70 (lightest) [degrees]; the other
    pigments are typical of measured people with this angle."""
    weight: Annotated[Distribution | None, _SIGNED_FRACTION_FIELD] = None
    """Body weight, from -1 (lowest) to 1 (highest)."""
    muscle: Annotated[Distribution | None, _SIGNED_FRACTION_FIELD] = None
    """Muscle mass, from -1 (lowest) to 1 (highest)."""
    hair_eumelanin: Annotated[Distribution | None, _HAIR_MELANIN_FIELD] = None
    """Eumelanin of the hair before greying: 0.3 is blond, 1.3 brown, 8 black."""
    hair_pheomelanin: Annotated[Distribution | None, _HAIR_MELANIN_FIELD] = None
    """Pheomelanin of the hair before greying: 2 with little eumelanin is red."""
    clothing: Annotated[Distribution | None, NameField()] = None
    """Garment in words, such as "navy denim shirt", or "sampled" for one by chance; by default "none"."""
    glasses: Annotated[Distribution | None, NameField()] = None
    """Glasses in words, such as "brown square", or "sampled" for some people; by default "none"."""
    headwear: Annotated[Distribution | None, NameField()] = None
    """Headwear in words, such as "red beanie", or "sampled" for some people; by default "none"."""
    skin: _Distributions = Field(default_factory=dict)
    """Fields of `SkinLook`: melanin, blood, freckles, spots, oil ..."""
    eyes: _Distributions = Field(default_factory=dict)
    """Fields of `EyeLook`: eumelanin, pupil_mm, redness."""
    hair: _Distributions = Field(default_factory=dict)
    """Fields of `HairLook`: style, length_mm, density, curl, grey, beard_mm ..."""
    targets: _Distributions = Field(default_factory=dict)
    """Weights of MakeHuman's targets by name, see `dermis head --list-targets`."""


class StateTable(FrozenModel):
    """TOML table of a data set's spec with the state of the skin of people, which holds for a whole clip."""

    blush: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Weight of a blush."""
    pallor: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Weight of pallor."""
    cold: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Weight of skin in the cold."""
    exertion: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Weight of exertion, with red and shiny skin."""
    crying: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Weight of crying, with red lids and eyes."""


class ExpressionTable(FrozenModel):
    """TOML table of a data set's spec with the facial expression: a named expression, or random movements."""

    name: Annotated[Distribution, NameField()] = Constant("neutral")
    """Name of an expression of the package or of [expressions.NAME], or "mixture": at most one random
    movement in each part of the face, so that movements do not oppose each other."""
    intensity: Annotated[Distribution, NumberField(0, 1.5, "larger weights distort faces")] = Constant(1.0)
    """Factor of all weights."""
    asymmetry: Annotated[Distribution, NumberField(-1, 1, "1 stills the right side")] = Constant(0.0)
    """Relative increase of the left side's weights and decrease of the right side's [-]."""
    variation: Annotated[Distribution, _FRACTION_FIELD] = Constant(0.0)
    """Random variation of each movement: standard deviation of the logarithm of its weight [-]."""


class HeadRotationTable(FrozenModel):
    """TOML table of a data set's spec with the rotation of the head on the neck."""

    yaw_deg: Annotated[Distribution, NumberField(-60, 60, "degrees: range of the neck")] = Constant(0.0)
    """Rotation to the head's left [degrees]."""
    pitch_deg: Annotated[Distribution, NumberField(-40, 40, "degrees: range of the neck")] = Constant(0.0)
    """Rotation downwards [degrees]."""
    roll_deg: Annotated[Distribution, NumberField(-35, 35, "degrees: range of the neck")] = Constant(0.0)
    """Rotation towards the head's right shoulder [degrees]."""


class GazeTable(FrozenModel):
    """TOML table of a data set's spec with the gaze direction of the eyes."""

    at: Annotated[Distribution, NameField(lambda: (GAZE_CAMERA, GAZE_ANGLES))] = Constant(GAZE_CAMERA)
    """Gaze target: the camera, or the direction given by the two angles."""
    yaw_deg: Annotated[Distribution, NumberField(-36, 36, "degrees: range of the eyes")] = Constant(0.0)
    """Angle to the head's left, relative to the direction of the face [degrees]."""
    pitch_deg: Annotated[Distribution, NumberField(-30, 30, "degrees: range of the eyes")] = Constant(0.0)
    """Angle downwards [degrees]."""


class CameraTable(FrozenModel):
    """TOML table of a data set's spec with the camera; the complete face is always in the picture."""

    distance_mm: Annotated[Distribution, _CAMERA_DISTANCE_FIELD] = Constant(1100.0)
    """Distance to the centre of the face [mm]."""
    yaw_deg: Annotated[Distribution, _ANGLE_FIELD] = Constant(0.0)
    """Angle around the head, from its front to its left [degrees]."""
    pitch_deg: Annotated[Distribution, _ELEVATION_FIELD] = Constant(0.0)
    """Elevation above the level of the head [degrees]."""
    roll_deg: Annotated[Distribution, _ANGLE_FIELD] = Constant(0.0)
    """Rotation of the camera about its axis, clockwise as seen from behind it [degrees]."""
    frame_mm: Annotated[Distribution, NumberField(50, 10_000, "mm: from a nose to a crowd")] = Constant(340.0)
    """Visible height at the head [mm]."""
    focal_mm: Annotated[Distribution | None, NumberField(8, 1200, "mm")] = None
    """Focal length for a sensor 24 mm high, in place of frame_mm [mm]."""
    offset_x: Annotated[Distribution, _SIGNED_FRACTION_FIELD] = Constant(0.0)
    """Offset of the face to the right of the picture's centre, relative to half its width [-]."""
    offset_y: Annotated[Distribution, _SIGNED_FRACTION_FIELD] = Constant(0.0)
    """Offset of the face above the picture's centre, relative to half its height [-]."""


class LampTable(FrozenModel):
    """TOML table of a data set's spec with one lamp: a uniform square area light that faces the head."""

    yaw_deg: Annotated[Distribution, _ANGLE_FIELD] = Constant(0.0)
    """Angle around the head, from its front to its left [degrees]."""
    pitch_deg: Annotated[Distribution, _ELEVATION_FIELD] = Constant(0.0)
    """Elevation above the level of the head [degrees]."""
    distance_mm: Annotated[Distribution, NumberField(400, 20_000, "mm: outside the face")] = Constant(1300.0)
    """Distance to the centre of the head [mm]."""
    size_mm: Annotated[Distribution, NumberField(10, 3000, "mm: from a torch to a wall")] = Constant(500.0)
    """Side length [mm]."""
    strength: Annotated[Distribution, _LIGHT_STRENGTH_FIELD] = Constant(1.0)
    """Irradiance at the head, divided by pi."""
    kelvin: Annotated[Distribution, NumberField(1700, 20_000, "K: candle to blue sky")] = Constant(6500.0)
    """Colour temperature; 6500 is white [K]."""


class LightTable(FrozenModel):
    """TOML table of a data set's spec with the lamps: a preset rig, or sampled key, fill and rim lamps."""

    kind: Annotated[Distribution, NameField(lambda: [LAMP_RIG, *light_presets()])] = Constant("studio")
    """Rig of the package, or "rig" for the key, fill and rim lamps of the tables below."""
    turn_deg: Annotated[Distribution, _ANGLE_FIELD] = Constant(0.0)
    """Rotation of all lamps about the upward axis, to the head's left [degrees]."""
    strength: Annotated[Distribution, _LIGHT_STRENGTH_FIELD] = Constant(1.0)
    """Factor of the irradiance of all lamps [-]."""
    key: LampTable = LampTable(yaw_deg=Uniform(-70, 70), pitch_deg=Uniform(-5, 60))
    """Key lamp, the main light."""
    fill: LampTable = LampTable(yaw_deg=Uniform(-60, 60), size_mm=Constant(900), strength=Constant(0.2))
    """Fill lamp, which lights the shadows."""
    rim: LampTable = LampTable(yaw_deg=Uniform(120, 180), pitch_deg=Constant(25), strength=Constant(0.4))
    """Rim lamp, behind the head."""


class EnvironmentTable(FrozenModel):
    """TOML table of a data set's spec with the environment light."""

    name: Annotated[Distribution, NameField()] = Constant(NO_ENVIRONMENT)
    """Environment: "none", "uniform", a sample (royal_esplanade, lebombo; downloaded once), or files (.hdr,
    .exr)."""
    turn_deg: Annotated[Distribution, _ANGLE_FIELD] = Uniform(-180, 180)
    """Rotation about the upward axis, counter-clockwise as seen from above [degrees]."""
    strength: Annotated[Distribution, _LIGHT_STRENGTH_FIELD] = Constant(1.0)
    """Factor of the environment's radiance [-]."""


_PICTURE_DEFAULTS = {"zoom": Constant(1.0), "crop_x": Uniform(0, 1), "crop_y": Uniform(0, 1)}


class BackgroundTable(FrozenModel):
    """TOML table of a data set's spec with the picture's background, which emits no light."""

    kind: Annotated[Distribution, NameField(lambda: BACKGROUND_KINDS)] = Constant("gradient")
    """"none" for alpha, "gradient", "colour", "picture", or "environment" (a gradient if there is none)."""
    red: Annotated[Distribution, _FRACTION_FIELD] = Uniform(0, 0.6)
    """Red of the colour, linear Rec. 709."""
    green: Annotated[Distribution, _FRACTION_FIELD] = Uniform(0, 0.6)
    """Green of the colour, linear Rec. 709."""
    blue: Annotated[Distribution, _FRACTION_FIELD] = Uniform(0, 0.6)
    """Blue of the colour, linear Rec. 709."""
    blur: Annotated[Distribution, _FRACTION_FIELD] = Constant(0.0)
    """Blur of the background: of an environment, the roughness of a mirror that blurs it as much; of a
    picture, ten times the standard deviation relative to the height [-]."""
    picture: Annotated[Distribution | None, NameField()] = None
    """Picture files for the kind "picture", which cover the background and keep their aspect ratio."""
    zoom: Annotated[Distribution | None, NumberField(1, 20, "1 shows as much as possible")] = None
    """Factor by which the visible part of a picture is smaller than the largest possible, by default 1."""
    crop_x: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Position of the visible part between the left (0) and the right end (1), by default uniform [-]."""
    crop_y: Annotated[Distribution | None, _FRACTION_FIELD] = None
    """Position of the visible part between the upper (0) and the lower end (1), by default uniform [-]."""

    @model_validator(mode="after")
    def _check_pictures(self) -> BackgroundTable:
        keys = [name for name in ("picture", *_PICTURE_DEFAULTS) if getattr(self, name) is not None]
        if PICTURE_BACKGROUND not in self.kind.support:
            require(not keys, f'kind = "picture" for the keys {", ".join(keys)}')
        else:
            require(self.picture is not None, 'picture = {files = "PATTERN"} for the kind "picture"')
            for name, default in _PICTURE_DEFAULTS.items():
                if getattr(self, name) is None:
                    object.__setattr__(self, name, default)
        return self
