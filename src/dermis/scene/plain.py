"""The base of all scene data: frozen, checked, and with errors in the package's own words."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self, Union, get_args, get_origin

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticUndefined

from dermis.errors import DermisError, refuse
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
    meant: ClassVar[Mapping[str, str]] = {}
    """Fields by the names that other programs have for them."""

    def __init__(self, *value: Any, **data: Any) -> None:
        """Values by name; one without a name is that of the one field that has no default."""
        model = type(self)
        if value:
            data[_only_required(model, value)] = value[0]
        try:
            super().__init__(**data)
        except ValidationError as error:
            findings = {_place(one): _finding(one, model) for one in error.errors()}
            raise ImpossibleError(model.__name__, findings) from None

    def __setattr__(self, name: str, value: Any) -> None:
        owner, remedy = type(self).__name__, f"Write replace({name}={value!r:.40}) for a copy with it"
        refuse(owner, "a value that stays as it is", f"{name} was to be changed", remedy)

    def replace(self, **values: Any) -> Self:
        """The same with other values, checked."""
        return type(self)(**{name: getattr(self, name) for name in self.model_fields_set} | values)

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


def _only_required(model: type[BaseModel], value: tuple[Any, ...]) -> str:
    """The field that a value without a name is for."""
    required = [name for name, info in model.model_fields.items() if info.is_required()]
    if len(required) != 1 or len(value) != 1:
        some, came = (
            ", ".join(f"{name}=..." for name in list(model.model_fields)[:3]),
            f"{value[0]!r:.40} came",
        )
        refuse(model.__name__, f"values by name, such as {some}", f"{came} without one", "Name it")
    return required[0]


def _length(one: ErrorDetails, model: type[BaseModel]) -> str:
    """How many numbers a list has that a field wants, where it says so."""
    info = model.model_fields.get(str(one["loc"][0])) if len(one["loc"]) == 1 else None
    count = len([part for part in get_args(info.annotation) if part is not Ellipsis]) if info else 0
    return f" of {count} numbers" if count > 1 else ""


def _place(one: ErrorDetails) -> str:
    return ".".join(str(part) for part in one["loc"])


def _unknown(name: str, model: type[Plain]) -> str:
    """What to say of a name that is no field: the nearest, or whose field it is."""
    known, finding = list(model.model_fields), "but this name is unknown"
    plain = name.lower().replace("-", "_")
    near = [model.meant[plain]] if plain in model.meant else difflib.get_close_matches(plain, known, 1, 0.7)
    if near:
        return f"expected {near[0]}, {finding}"
    owners = [one.__name__ for one in _kinds_of_plain(Plain) if name in one.model_fields]
    if owners:
        finding += f" here (it is one of {owners[0]})"
    return f"expected one of {', '.join(known)}, {finding}"


def _kinds_of_plain(kind: type[Plain]) -> Iterator[type[Plain]]:
    for one in kind.__subclasses__():
        if not one.__name__.startswith("_"):
            yield one
        yield from _kinds_of_plain(one)


def _finding(one: ErrorDetails, model: type[Plain]) -> str:
    """One of pydantic's findings as what was expected and what came."""
    if one["type"] == "extra_forbidden":
        return _unknown(str(one["loc"][-1]), model)
    if one["type"] == "missing":
        return "expected a value, but there is none"
    expected = re.sub("^(Input should be|Tuple should have|Value error,) |, unable to .*", "", one["msg"])
    expected = expected.replace("a valid tuple", f"a list{_length(one, model)}")
    if expected.startswith(("greater", "less")):
        expected = f"a number {expected}"
    if len(one["loc"]) == 1 and (words := words_of(model, str(one["loc"][0]))):
        expected = f"{', '.join(words)} or {expected}"
    came = repr(one["input"])
    if not one["loc"] and isinstance(one["input"], dict):  # values that do not go together
        came = ", ".join(f"{name} {value}" for name, value in one["input"].items())
    return f"expected {expected}, but {came if len(came) <= _LONGEST else came[:_LONGEST] + ' …'} came"
