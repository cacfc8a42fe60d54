"""The base of all scene data: frozen, checked, and with errors in the package's own words."""

from __future__ import annotations

import re
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from dermis.errors import DermisError

FARTHEST_MM = 1e6
_LONGEST = 80  # letters of what came


def _direction(v: tuple[float, float, float]) -> tuple[float, float, float]:
    if sum(abs(c) for c in v) < 1e-6:
        raise ValueError("a direction other than (0, 0, 0)")
    return v


# The bounds are far beyond any use; they keep single precision on the device from overflowing.
Coordinate = Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]
Vector = tuple[Coordinate, Coordinate, Coordinate]
Direction = Annotated[Vector, AfterValidator(_direction)]
Intensity = Annotated[float, Field(ge=0, le=1e6)]
Colour = tuple[Intensity, Intensity, Intensity]


class ImpossibleError(DermisError):
    """Values that cannot be.

    findings : by field: what was expected and what came
    """

    def __init__(self, owner: str, findings: dict[str, str]) -> None:
        said = "; ".join(f"{field}: {finding}" if field else finding for field, finding in findings.items())
        super().__init__(f"{owner}: {said}. Correct it.")
        self.findings = findings


class Plain(BaseModel):
    """Immutable settings: unknown names and impossible values are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            model = type(self)
            findings = {_place(one): _finding(one, list(model.model_fields)) for one in error.errors()}
            raise ImpossibleError(model.__name__, findings) from None


def _place(one: ErrorDetails) -> str:
    return ".".join(str(part) for part in one["loc"])


def _finding(one: ErrorDetails, known: list[str]) -> str:
    """One of pydantic's findings as what was expected and what came."""
    if one["type"] == "extra_forbidden":
        return f"expected one of {', '.join(known)}, but this name is unknown"
    if one["type"] == "missing":
        return "expected a value, but there is none"
    expected = re.sub("^(Input should be|Tuple should have|Value error,) |, unable to .*", "", one["msg"])
    expected = expected.replace("a valid tuple", "a list")
    if expected.startswith(("greater", "less")):
        expected = f"a number {expected}"
    came = repr(one["input"])
    if not one["loc"] and isinstance(one["input"], dict):  # values that do not go together
        came = ", ".join(f"{name} {value}" for name, value in one["input"].items())
    return f"expected {expected}, but {came if len(came) <= _LONGEST else came[:_LONGEST] + ' …'} came"
