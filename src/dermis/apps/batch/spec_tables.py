"""Tables of a spec: their fields, the bounds of these and correlations between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, TypeVar

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, model_validator
from pydantic_core.core_schema import (
    CoreSchema,
    no_info_plain_validator_function,
    plain_serializer_function_ser_schema,
)

from dermis.apps.batch.distributions import Constant, Distribution, Uniform, parse_distribution, require
from dermis.human.published import OLD, YOUNG
from dermis.scene.lights import light_presets
from dermis.scene.plain import Plain

RIG = "rig"
MIXTURE = "mixture"
NONE = "none"
CAMERA, ANGLES = "camera", "angles"
BACKGROUNDS = "none", "gradient", "environment", "colour"
_REACH = "; normal reaches to 6 sd either way, truncated to its ends"


class DistributionField:
    """For pydantic: `Annotated[Distribution, Anything()]` is read from what a spec states."""

    def check(self, value: object) -> Distribution | None:
        """Return the distribution that a value describes; None for a field that is left out.

        Raises ValueError, worded as what was expected, for other values and for distributions out of bounds.
        """
        if value is None:
            return None
        found = parse_distribution(value)
        self.check_support(found)
        return found

    def check_support(self, found: Distribution) -> None:
        """Raise ValueError for values that the field cannot have."""

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        serialised = plain_serializer_function_ser_schema(lambda one: one and one.spec_value())
        return no_info_plain_validator_function(self.check, serialization=serialised)


class Within(DistributionField):
    """Numbers between two bounds.

    why : reason of the bounds
    """

    def __init__(self, low: float, high: float, why: str = "") -> None:
        self.ge, self.le, self.why = low, high, why

    def check_support(self, found: Distribution) -> None:
        if any(isinstance(end, str) or not self.ge <= end <= self.le for end in found.support):
            why = f" ({self.why})" if self.why else ""
            reach = "" if isinstance(found, Constant) else _REACH
            raise ValueError(f"numbers from {self.ge:.10g} to {self.le:.10g}{why}{reach}")


class OneOf(DistributionField):
    """Names out of a list where there is one, else any name, of a file too."""

    def __init__(self, known: Callable[[], Iterable[str]] | None = None) -> None:
        self.known = known

    def check_support(self, found: Distribution) -> None:
        names = list(self.known()) if self.known else []
        for end in found.support:
            if not isinstance(end, str) or (names and end not in names):
                raise ValueError(f"one of {', '.join(names)}" if names else "a name, or a choice of names")
        if names and not found.support:
            raise ValueError(f"one of {', '.join(names)}, no files")


_MOST_NAMES = 50
_Coefficient = Annotated[float, Field(ge=-1, le=1)]


class Correlated(Plain):
    """Correlated parameters: a Gaussian copula, which leaves the distribution of each as it is.

    A greater normal number gives a greater value, or a later one of a choice.
    """

    of: tuple[str, ...]
    """Names of parameters, such as ["camera.yaw_deg", "head.yaw_deg"]; those of a person first."""
    correlation: _Coefficient | tuple[tuple[_Coefficient, ...], ...]
    """Of all pairs alike, or the matrix: rows of as many numbers as there are names."""

    @model_validator(mode="after")
    def _possible(self) -> Correlated:
        count = len(self.of)
        require(2 <= len(set(self.of)) == count <= _MOST_NAMES, f"2 to {_MOST_NAMES} names, each once")
        if isinstance(self.correlation, tuple):
            square = [len(row) for row in self.correlation] == [count] * count
            require(square, f"a correlation of {count} rows of {count} numbers")
        matrix = self.matrix
        symmetric = np.array_equal(matrix, matrix.T) and (np.diag(matrix) == 1).all()
        require(bool(symmetric), "a correlation that is symmetric, with 1 on its diagonal")
        definite = np.linalg.eigvalsh(matrix)[0] >= 1e-6
        require(definite, "a correlation that is positive definite: these cannot all be at once")
        return self

    @property
    def matrix(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Correlation matrix (n, n)."""
        if isinstance(self.correlation, tuple):
            return np.array(self.correlation, np.float64)
        count = len(self.of)
        return np.full((count, count), self.correlation) + (1.0 - self.correlation) * np.eye(count)

    def rows(self) -> dict[str, dict[str, float]]:
        """Return rows of the Cholesky factor: for each name, weights of independent normal numbers."""
        lower = np.linalg.cholesky(self.matrix)
        return {
            name: {other: float(lower[k, j]) for j, other in enumerate(self.of[: k + 1])}
            for k, name in enumerate(self.of)
        }


T = TypeVar("T")


def table_of(values: Mapping[str, T], table: str) -> dict[str, T]:
    """Return the values whose dotted names begin with a table's, by the rest of their names."""
    start = f"{table}."
    return {name.removeprefix(start): one for name, one in values.items() if name.startswith(start)}


_TURN = Within(-180, 180, "degrees")
_LEAN = Within(-85, 85, "degrees: straight above there is no side")
_SHARE = Within(0, 1)
_AGE = Within(YOUNG, OLD, "years: the ages of the published people")
_TREND = Within(-1, 1, "0 is the average")
_MELANIN = Within(0, 10, "0.3 is blond, 8 black")
_AWAY = Within(150, 20_000, "mm: before the nose, and not across a street")
_STOPS = Within(0, 100, "light is not negative")
_Dials = dict[str, Annotated[Distribution, DistributionField()]]


class PersonTable(Plain):
    """Who is seen: people drawn by a seed, or heads by name. What is left out is as the seed draws it."""

    head: Annotated[Distribution | None, OneOf()] = None
    """Heads instead of drawn people: names that `dermis render` takes, files of people (.json), of meshes
    (.glb, .obj, .ply) or of scenes (.toml), whose head and skin are taken."""
    age: Annotated[Distribution | None, _AGE] = None
    """Age; skin and hair follow it [years]."""
    sex: Annotated[Distribution | None, _SHARE] = None
    """From 0, female, to 1, male."""
    african: Annotated[Distribution | None, _SHARE] = None
    """Share of the ancestry; the ratios of the three count, those left out are 0."""
    asian: Annotated[Distribution | None, _SHARE] = None
    """Share of the ancestry."""
    caucasian: Annotated[Distribution | None, _SHARE] = None
    """Share of the ancestry."""
    weight: Annotated[Distribution | None, _TREND] = None
    """From -1, least, to 1, most."""
    muscle: Annotated[Distribution | None, _TREND] = None
    """From -1, least, to 1, most."""
    hair_eumelanin: Annotated[Distribution | None, _MELANIN] = None
    """Of the hair as it grew: 0.3 is blond, 1.3 brown, 8 black."""
    hair_pheomelanin: Annotated[Distribution | None, _MELANIN] = None
    """Of the hair as it grew: 2 with little of the other is red."""
    skin: _Dials = Field(default_factory=dict)
    """Numbers of `SkinLook`: melanin, blood, freckles, spots, oil ..."""
    eyes: _Dials = Field(default_factory=dict)
    """Numbers of `EyeLook`: eumelanin, pupil_mm, redness."""
    hair: _Dials = Field(default_factory=dict)
    """Of `HairLook`: style, length_mm, density, curl, grey, beard_mm ..."""
    targets: _Dials = Field(default_factory=dict)
    """Weights of published targets by name, see `dermis head --list-targets`."""


class ExpressionTable(Plain):
    """What the face does: a named expression, or muscles at random."""

    name: Annotated[Distribution, OneOf()] = Constant("neutral")
    """Of the package's, of the spec's own under [expressions.NAME], or "mixture": in each part of the face
    one movement or none, so that none works against another."""
    intensity: Annotated[Distribution, Within(0, 1.5, "beyond it faces come apart")] = Constant(1.0)
    """Factor of all weights."""
    asymmetry: Annotated[Distribution, Within(-1, 1, "at 1 the right side rests")] = Constant(0.0)
    """How much more the left side moves, and how much less the right one."""
    variation: Annotated[Distribution, _SHARE] = Constant(0.0)
    """How much each movement differs from what the expression says: standard deviation of the logarithm."""


class TurnTable(Plain):
    """How the head is turned by the neck."""

    yaw_deg: Annotated[Distribution, Within(-60, 60, "degrees that a neck turns")] = Constant(0.0)
    """Turn to the head's left [degrees]."""
    pitch_deg: Annotated[Distribution, Within(-40, 40, "degrees that a neck turns")] = Constant(0.0)
    """Nod downwards [degrees]."""
    roll_deg: Annotated[Distribution, Within(-35, 35, "degrees that a neck turns")] = Constant(0.0)
    """Tilt to the head's right shoulder [degrees]."""


class GazeTable(Plain):
    """Where the eyes look."""

    at: Annotated[Distribution, OneOf(lambda: (CAMERA, ANGLES))] = Constant(CAMERA)
    """The camera, or by the two angles."""
    yaw_deg: Annotated[Distribution, Within(-36, 36, "degrees that eyes turn")] = Constant(0.0)
    """To the head's left, from where the face points [degrees]."""
    pitch_deg: Annotated[Distribution, Within(-30, 30, "degrees that eyes turn")] = Constant(0.0)
    """Downwards [degrees]."""


class CameraTable(Plain):
    """From where the face is seen. Whatever is drawn, the whole face is in the picture."""

    distance_mm: Annotated[Distribution, _AWAY] = Constant(1100.0)
    """From the middle of the face [mm]."""
    yaw_deg: Annotated[Distribution, _TURN] = Constant(0.0)
    """Around the head, to its left [degrees]."""
    pitch_deg: Annotated[Distribution, _LEAN] = Constant(0.0)
    """Above it [degrees]."""
    roll_deg: Annotated[Distribution, _TURN] = Constant(0.0)
    """Turn of the camera about its axis, clockwise as it looks [degrees]."""
    frame_mm: Annotated[Distribution, Within(50, 10_000, "mm: from a nose to a crowd")] = Constant(340.0)
    """Height of what the picture shows at the head [mm]."""
    focal_mm: Annotated[Distribution | None, Within(8, 1200, "mm: lenses for a sensor 24 mm high")] = None
    """Focal length of a lens before a sensor 24 mm high, instead of frame_mm [mm]."""
    offset_x: Annotated[Distribution, _TREND] = Constant(0.0)
    """How far the face is right of the picture's middle, of half its width [-]."""
    offset_y: Annotated[Distribution, _TREND] = Constant(0.0)
    """How far the face is above the picture's middle, of half its height [-]."""


class LampTable(Plain):
    """A lamp of the rig: an even square that faces the head."""

    yaw_deg: Annotated[Distribution, _TURN] = Constant(0.0)
    """Around the head, to its left, from where it faces [degrees]."""
    pitch_deg: Annotated[Distribution, _LEAN] = Constant(0.0)
    """Above it [degrees]."""
    distance_mm: Annotated[Distribution, Within(400, 20_000, "mm: not in the face")] = Constant(1300.0)
    """From the middle of the head [mm]."""
    size_mm: Annotated[Distribution, Within(10, 3000, "mm: from a flashlight to a wall")] = Constant(500.0)
    """Length of its sides [mm]."""
    strength: Annotated[Distribution, _STOPS] = Constant(1.0)
    """Irradiance over pi where the head is."""
    kelvin: Annotated[Distribution, Within(1700, 20_000, "K: from a candle to a blue sky")] = Constant(6500.0)
    """Colour temperature, white at 6500 [K]."""


class LightTable(Plain):
    """Lamps: a rig of the package, or one of three lamps at random."""

    kind: Annotated[Distribution, OneOf(lambda: [RIG, *light_presets()])] = Constant("studio")
    """Of the package's rigs, or "rig": key, fill and rim as their tables say."""
    turn_deg: Annotated[Distribution, _TURN] = Constant(0.0)
    """Turn of all lamps about the upward axis, to the head's left [degrees]."""
    strength: Annotated[Distribution, _STOPS] = Constant(1.0)
    """Factor of all lamps: what they have beside the environment."""
    key: LampTable = LampTable(yaw_deg=Uniform(-70, 70), pitch_deg=Uniform(-5, 60))
    """The lamp that draws the face."""
    fill: LampTable = LampTable(yaw_deg=Uniform(-60, 60), size_mm=Constant(900), strength=Constant(0.2))
    """The lamp that lights its shadows."""
    rim: LampTable = LampTable(yaw_deg=Uniform(120, 180), pitch_deg=Constant(25), strength=Constant(0.4))
    """The lamp behind the head."""


class EnvironmentTable(Plain):
    """Light from all around."""

    name: Annotated[Distribution, OneOf()] = Constant(NONE)
    """"none", "uniform", a sample (royal_esplanade, lebombo; fetched once) or files (.hdr, .exr)."""
    turn_deg: Annotated[Distribution, _TURN] = Uniform(-180, 180)
    """Turn about the upward axis, counter-clockwise as seen from above [degrees]."""
    strength: Annotated[Distribution, _STOPS] = Constant(1.0)
    """Factor of its radiance."""


class BackgroundTable(Plain):
    """What is behind the head, which sheds no light."""

    kind: Annotated[Distribution, OneOf(lambda: BACKGROUNDS)] = Constant("gradient")
    """"none" for alpha, "gradient", "colour", or the "environment", where there is one, else the gradient."""
    red: Annotated[Distribution, _SHARE] = Uniform(0, 0.6)
    """Of the colour, linear Rec. 709."""
    green: Annotated[Distribution, _SHARE] = Uniform(0, 0.6)
    """Of the colour, linear Rec. 709."""
    blue: Annotated[Distribution, _SHARE] = Uniform(0, 0.6)
    """Of the colour, linear Rec. 709."""
    blur: Annotated[Distribution, _SHARE] = Constant(0.0)
    """Roughness of the mirror in which the environment behind the head is seen."""
