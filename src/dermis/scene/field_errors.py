"""What is said of values that a model cannot have: what was expected, why, and what came."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping
from functools import cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from dermis.base.errors import DermisError, format_value, shorten

_BOUND_ERRORS = {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}
_NUMBER_ERRORS = {
    "float_type",
    "float_parsing",
    "int_type",
    "int_parsing",
    "int_from_float",
    "int_parsing_size",
}
_TEXT_TYPES = (str, bytes, bytearray)
_MAX_NAME_LENGTH = 80
_MAX_TABLE_LENGTH = 160


class Keywords:
    """For a field of numbers: `Annotated[float, Words("auto")]` may also be one of some words."""

    def __init__(self, *words: str) -> None:
        self.words = words

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        def check(value: Any, numbers: Any) -> Any:
            return value if isinstance(value, str) and value in self.words else numbers(value)

        as_it_is = core_schema.plain_serializer_function_ser_schema(lambda value: value)
        return core_schema.no_info_wrap_validator_function(check, handler(source), serialization=as_it_is)


class BoundsReason(str):
    """For a field of numbers: why its bounds are where they are."""

    __slots__ = ()


class InvalidFieldsError(DermisError):
    """Values that cannot be.

    findings : by field: what was expected and what came
    """

    def __init__(self, owner: str, messages: dict[str, str]) -> None:
        said = "; ".join(f"{field}: {finding}" if field else finding for field, finding in messages.items())
        super().__init__(f"{owner}: {said}. Correct it.")
        self.messages = messages


class _NotANumber:
    """What stands where a number is wanted: no field of numbers takes it."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


@cache
def numeric_fields(model: type[BaseModel]) -> Mapping[str, bool]:
    """Fields that hold numbers and nothing else, each with whether text can stand for them."""
    found = {}
    for name, info in model.model_fields.items():
        kinds = set(_leaf_types(info.annotation))
        if kinds & {float, int} and kinds <= {float, int, NoneType}:
            found[name] = any(isinstance(one, Keywords) or hasattr(one, "func") for one in info.metadata)
    return found


def python_numbers(value: Any, text: bool = False) -> Any:
    """NumPy's numbers and arrays as Python's; what only looks like a number is made to be refused.

    text : whether a text can stand for the value
    """
    import numpy as np  # loading it takes longer than all of --help

    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [python_numbers(one) for one in value]
    if isinstance(value, Mapping):
        return {name: python_numbers(one) for name, one in value.items()}
    if isinstance(value, bool | set | frozenset) or (isinstance(value, _TEXT_TYPES) and not text):
        return _NotANumber(value)
    return value


def field_keywords(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """The words that a field of numbers may be instead."""
    found = [one.words for one in model.model_fields[field].metadata if isinstance(one, Keywords)]
    return found[0] if found else ()


def field_bounds(info: FieldInfo) -> tuple[float | None, float | None]:
    """The least and the greatest that a field's number may be; None where there is none."""
    low = [getattr(one, name) for one in info.metadata for name in ("ge", "gt") if hasattr(one, name)]
    high = [getattr(one, name) for one in info.metadata for name in ("le", "lt") if hasattr(one, name)]
    return next(iter(low), None), next(iter(high), None)


def messages_by_field(errors: list[ErrorDetails], model: type[BaseModel]) -> dict[str, str]:
    """Findings of an `InvalidFieldsError` by field, from pydantic's."""
    return {".".join(str(part) for part in one["loc"]): _message(one, model) for one in errors}


def _message(one: ErrorDetails, model: type[BaseModel]) -> str:
    """One of pydantic's findings as what was expected and what came."""
    if one["type"] == "extra_forbidden":
        return _unknown_field(str(one["loc"][-1]), model)
    if one["type"] == "missing":
        return "expected a value, but there is none"
    expected = re.sub("^(Input should be|Tuple should have|Value error,) |, unable to .*", "", one["msg"])
    expected = expected.replace("a valid tuple", f"a list{_list_length(one, model)}")
    if one["type"] in _BOUND_ERRORS | _NUMBER_ERRORS:
        expected = _number_range(one["loc"], model) or re.sub("^(greater|less)", r"a number \1", expected)
    if len(one["loc"]) == 1 and (words := field_keywords(model, str(one["loc"][0]))):
        expected = f"{', '.join(words)} or {expected}"
    actual = format_value(one["input"])
    if not one["loc"] and isinstance(one["input"], dict):  # values that do not go together
        values = ", ".join(f"{name} {format_value(value)}" for name, value in one["input"].items())
        actual = shorten(values, _MAX_TABLE_LENGTH)
    return f"expected {expected}, but got {actual}"


def _number_range(place: tuple[int | str, ...], model: type[BaseModel]) -> str:
    """The range of the number at a place, with its reason; nothing where it has none."""
    info = model.model_fields.get(str(place[0])) if place else None
    if info is None:
        return ""
    if len(place) > 1 and get_args(info.annotation):
        info = FieldInfo.from_annotation(get_args(info.annotation)[-1])
    low, high = field_bounds(info)
    reasons = [one for one in info.metadata if isinstance(one, BoundsReason)]
    why = f" ({reasons[0]})" if reasons else ""
    whole = "a whole number" if set(_leaf_types(info.annotation)) <= {int, NoneType} else "a number"
    return f"{whole} from {low:.10g} to {high:.10g}{why}" if low is not None and high is not None else ""


def _leaf_types(kind: Any) -> Iterator[Any]:
    """All types that an annotation is made of."""
    parts = get_args(kind)
    if get_origin(kind) is dict:
        yield from _leaf_types(parts[1])
    elif get_origin(kind) in (tuple, list, Union, UnionType):
        for part in parts:
            yield from _leaf_types(part)
    elif hasattr(kind, "__metadata__"):
        yield from _leaf_types(parts[0])
    elif kind is not Ellipsis:
        yield kind


def _list_length(one: ErrorDetails, model: type[BaseModel]) -> str:
    """How many numbers a list has that a field wants, where it says so."""
    info = model.model_fields.get(str(one["loc"][0])) if len(one["loc"]) == 1 else None
    count = len([part for part in get_args(info.annotation) if part is not Ellipsis]) if info else 0
    return f" of {count} numbers" if count > 1 else ""


def _unknown_field(name: str, model: type[Any]) -> str:
    """What to say of a name that is no field: the nearest, or whose field it is."""
    known, finding = list(model.model_fields), "but this name is unknown"
    plain = name[:_MAX_NAME_LENGTH].lower().replace("-", "_")
    near = (
        [model.synonyms[plain]]
        if plain in model.synonyms
        else difflib.get_close_matches(plain, known, 1, 0.7)
    )
    if near:
        return f"expected {near[0]}, {finding}"
    base = [one for one in model.__mro__ if "synonyms" in vars(one)][-1]
    owners = [one.__name__ for one in _subclasses(base) if name in one.model_fields]
    if owners:
        finding += f" here (it is one of {owners[0]})"
    return f"expected one of {', '.join(known)}, {finding}"


def _subclasses(kind: type[Any]) -> Iterator[type[BaseModel]]:
    for one in kind.__subclasses__():
        if not one.__name__.startswith("_"):
            yield one
        yield from _subclasses(one)
