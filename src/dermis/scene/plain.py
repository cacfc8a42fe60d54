"""The base of all scene data: frozen, checked, and with errors in the package's own words."""

from __future__ import annotations

import re
from types import UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticUndefined

from dermis.errors import DermisError
from dermis.registry import Named

FARTHEST_MM = 1e6
_LONGEST = 80  # letters of what came
_VAST = 1e5  # bounds beyond it only keep numbers finite


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


class Words:
    """For a field of numbers: `Annotated[float, Words("auto")]` may also be one of some words."""

    def __init__(self, *words: str) -> None:
        self.words = words

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        def check(value: Any, numbers: Any) -> Any:
            return value if isinstance(value, str) and value in self.words else numbers(value)

        as_it_is = core_schema.plain_serializer_function_ser_schema(lambda value: value)
        return core_schema.no_info_wrap_validator_function(check, handler(source), serialization=as_it_is)


class ImpossibleError(DermisError):
    """Values that cannot be.

    findings : by field: what was expected and what came
    """

    def __init__(self, owner: str, findings: dict[str, str]) -> None:
        said = "; ".join(f"{field}: {finding}" if field else finding for field, finding in findings.items())
        super().__init__(f"{owner}: {said}. Correct it.")
        self.findings = findings


class Plain(BaseModel):
    """Immutable settings: unknown names and impossible values are refused.

    The docstring under a field is its help, in the command line, the viewer and the documentation.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, defer_build=True)

    def __init__(self, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as error:
            model = type(self)
            findings = {_place(one): _finding(one, model) for one in error.errors()}
            raise ImpossibleError(model.__name__, findings) from None

    def __eq__(self, other: object) -> bool:
        """As pydantic has it, which takes ten times as long over values that differ."""
        return type(self) is type(other) and vars(self) == vars(other)


class Range(NamedTuple):
    """Where a number lies as a rule: the ends of its slider."""

    low: float
    high: float
    logarithmic: bool = False


def slider(low: float, high: float, *, log: bool = False) -> dict[str, Any]:
    """For a field's `json_schema_extra`: a slider's range, where the bounds are wider than what is useful."""
    return {"slider": Range(low, high, log)}


def help_of(model: type[BaseModel], field: str) -> str:
    """What a field means, on one line, with what each of the names of a registry stands for."""
    info = model.model_fields[field]
    text = re.sub(r"\s+", " ", info.description or "")
    summaries = [one for named in _named(info) for one in named.registry.summaries()]
    return f"{text} {'; '.join(summaries)}." if summaries else text


def choices_of(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """The words that a field may be; none where it is no choice of words."""
    info = model.model_fields[field]
    for named in _named(info):
        return named.names
    words = [word for one in _kinds(info) if get_origin(one) is Literal for word in get_args(one)]
    return tuple(words)


def words_of(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """The words that a field of numbers may be instead."""
    found = [one.words for one in model.model_fields[field].metadata if isinstance(one, Words)]
    return found[0] if found else ()


def range_of(model: type[BaseModel], field: str) -> Range | None:
    """The ends of a number's slider, or of each number in a tuple; None where the model names no two ends."""
    return _range(model.model_fields[field])


def values_of(model: type[BaseModel], field: str) -> str:
    """The words that a field may be, and the bounds of a number where they say something."""
    low, high = _bounds(model.model_fields[field])
    words = [*words_of(model, field), *choices_of(model, field)]
    if low is not None and high is not None and high < _VAST:
        words.append(f"{low:g} to {high:g}")
    return ", ".join(words)


def shown(value: Any) -> str:
    """A default as it is typed; nothing where a setting is off or left out."""
    if isinstance(value, tuple):
        return ("x" if all(isinstance(one, int) for one in value) else ",").join(map(shown, value))
    if value is None or isinstance(value, bool) or value is PydanticUndefined:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _named(info: FieldInfo) -> list[Named]:
    return [one for one in info.metadata if isinstance(one, Named)]


def _kinds(info: FieldInfo) -> tuple[Any, ...]:
    """The types that a field's value may have."""
    kind = info.annotation
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _range(info: FieldInfo) -> Range | None:
    extra = info.json_schema_extra
    if isinstance(extra, dict) and "slider" in extra:
        return Range(*extra["slider"])  # type: ignore[misc]
    for kind in _kinds(info):
        if get_origin(kind) is tuple:
            return _range(FieldInfo.from_annotation(get_args(kind)[0]))
    low, high = _bounds(info)
    return None if low is None or high is None else Range(low, high)


def _bounds(info: FieldInfo) -> tuple[float | None, float | None]:
    low = [getattr(one, name) for one in info.metadata for name in ("ge", "gt") if hasattr(one, name)]
    high = [getattr(one, name) for one in info.metadata for name in ("le", "lt") if hasattr(one, name)]
    return next(iter(low), None), next(iter(high), None)


def _place(one: ErrorDetails) -> str:
    return ".".join(str(part) for part in one["loc"])


def _finding(one: ErrorDetails, model: type[BaseModel]) -> str:
    """One of pydantic's findings as what was expected and what came."""
    if one["type"] == "extra_forbidden":
        return f"expected one of {', '.join(model.model_fields)}, but this name is unknown"
    if one["type"] == "missing":
        return "expected a value, but there is none"
    expected = re.sub("^(Input should be|Tuple should have|Value error,) |, unable to .*", "", one["msg"])
    expected = expected.replace("a valid tuple", "a list")
    if expected.startswith(("greater", "less")):
        expected = f"a number {expected}"
    if len(one["loc"]) == 1 and (words := words_of(model, str(one["loc"][0]))):
        expected = f"{', '.join(words)} or {expected}"
    came = repr(one["input"])
    if not one["loc"] and isinstance(one["input"], dict):  # values that do not go together
        came = ", ".join(f"{name} {value}" for name, value in one["input"].items())
    return f"expected {expected}, but {came if len(came) <= _LONGEST else came[:_LONGEST] + ' …'} came"
