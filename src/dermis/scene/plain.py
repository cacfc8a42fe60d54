"""The base of all scene data: frozen, checked, and with errors in the package's own words."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from dermis.errors import DermisError


def _length(v: tuple[float, float, float]) -> float:
    return float(sum(c * c for c in v) ** 0.5)


def _direction(v: tuple[float, float, float]) -> tuple[float, float, float]:
    if _length(v) < 1e-9:
        raise ValueError("a direction must not be (0, 0, 0)")
    return v


Finite = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Direction = Annotated[Vector, AfterValidator(_direction)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Colour = tuple[NonNegative, NonNegative, NonNegative]


class Plain(BaseModel):
    """Immutable settings: unknown names and impossible values are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise DermisError(explain(type(self).__name__.lower(), error)) from None


def explain(culprit: str, error: ValidationError) -> str:
    """Pydantic's findings as sentences: what was expected, what came."""
    findings = []
    for one in error.errors():
        place = ".".join(str(part) for part in one["loc"])
        findings.append(f"{place}: {one['msg']}, but {one['input']!r} came" if place else one["msg"])
    return f"{culprit}: {'; '.join(findings)}. Correct the value."
