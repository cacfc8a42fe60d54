"""Validation of the numeric fields of settings, and error messages for rejected values."""

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

_BOUND_ERROR_TYPES = {"greater_than", "greater_than_equal", "less_than", "less_than_equal", "finite_number"}
_INT_ERROR_TYPES = {"int_type", "int_parsing", "int_from_float", "int_parsing_size"}
_NUMBER_ERROR_TYPES = {"float_type", "float_parsing"} | _INT_ERROR_TYPES
_TEXT_TYPES = (str, bytes, bytearray)
_MAX_NAME_LENGTH = 80
_MAX_QUOTED_TABLE_LENGTH = 160


class AcceptedWords:
    """Annotation that lets a numeric field also accept words, as in `AcceptedWords("auto")`."""

    def __init__(self, *words: str) -> None:
        self.words = words

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return a pydantic schema that accepts values of the field's type and the words of this annotation.

        source : type of the annotated field
        handler : function that returns the schema of that type
        """
        from pydantic_core import core_schema

        def accept_keyword(value: Any, validate_number: Any) -> Any:
            return value if isinstance(value, str) and value in self.words else validate_number(value)

        unchanged = core_schema.plain_serializer_function_ser_schema(lambda value: value)
        return core_schema.no_info_wrap_validator_function(
            accept_keyword, handler(source), serialization=unchanged
        )


class BoundsReason(str):
    """Annotation of a numeric field: the reason for the field's bounds, which error messages quote."""

    __slots__ = ()


class InvalidFieldsError(DermisError):
    """Error for field values that a settings class rejects.

    messages : dictionary from the name of each rejected field to a text with expected and actual value
    """

    def __init__(self, settings_name: str, message_of_field: dict[str, str]) -> None:
        texts = [f"{field}: {message}" if field else message for field, message in message_of_field.items()]
        super().__init__(f"{settings_name}: {'; '.join(texts)}. Correct it.")
        self.messages = message_of_field


class _NotANumber:
    """Wrapper of a non-numeric value, such as a boolean, which pydantic would accept as a number."""

    def __init__(self, value: object) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


@cache
def numeric_fields(model: type[BaseModel]) -> Mapping[str, bool]:
    """Return a mapping from the names of a model's numeric fields to whether the field also accepts text."""
    found = {}
    for name, info in model.model_fields.items():
        kinds = set(_scalar_types(info.annotation))
        if kinds & {float, int} and kinds <= {float, int, NoneType}:
            found[name] = any(isinstance(one, AcceptedWords) or hasattr(one, "func") for one in info.metadata)
    return found


def to_python_numbers(field_value: Any, accepts_text: bool = False) -> Any:
    """Convert NumPy scalars and arrays to Python numbers, and wrap booleans and text in `_NotANumber`.

    accepts_text : whether text is a valid value, which is then not wrapped
    """
    import numpy as np  # importing it takes longer than printing help

    if isinstance(field_value, np.generic | np.ndarray):
        field_value = field_value.tolist()
    if isinstance(field_value, list | tuple):
        return [to_python_numbers(one) for one in field_value]
    if isinstance(field_value, Mapping):
        return {name: to_python_numbers(one) for name, one in field_value.items()}
    if isinstance(field_value, bool | set | frozenset) or (
        isinstance(field_value, _TEXT_TYPES) and not accepts_text
    ):
        return _NotANumber(field_value)
    return field_value


def field_keywords(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """Return the words that a numeric field accepts besides numbers, such as "auto"."""
    found = [one.words for one in model.model_fields[field].metadata if isinstance(one, AcceptedWords)]
    return found[0] if found else ()


def field_bounds(field_info: FieldInfo) -> tuple[float | None, float | None]:
    """Return the lower and the upper bound of a numeric field; a missing bound is None."""
    low = [getattr(one, name) for one in field_info.metadata for name in ("ge", "gt") if hasattr(one, name)]
    high = [getattr(one, name) for one in field_info.metadata for name in ("le", "lt") if hasattr(one, name)]
    return next(iter(low), None), next(iter(high), None)


def messages_by_field(errors: list[ErrorDetails], model: type[BaseModel]) -> dict[str, str]:
    """Convert validation errors of pydantic to a dictionary from dotted field names to messages for users."""
    return {".".join(str(part) for part in one["loc"]): _format_error(one, model) for one in errors}


def _format_error(pydantic_error: ErrorDetails, model: type[BaseModel]) -> str:
    """Return the message "expected ..., but got ..." for one validation error of pydantic."""
    if pydantic_error["type"] == "extra_forbidden":
        return _unknown_field_message(str(pydantic_error["loc"][-1]), model)
    if pydantic_error["type"] == "missing":
        return "expected a value, but there is none"
    expected = re.sub(
        "^(Input should be|Tuple should have|Value error,) |, unable to .*", "", pydantic_error["msg"]
    )
    expected = expected.replace("a valid tuple", f"a list{_tuple_length_text(pydantic_error, model)}")
    if pydantic_error["type"] in _BOUND_ERROR_TYPES | _NUMBER_ERROR_TYPES:
        expected = _range_text(pydantic_error["loc"], model) or re.sub(
            "^(greater|less)", r"a number \1", expected
        )
    if len(pydantic_error["loc"]) == 1 and (words := field_keywords(model, str(pydantic_error["loc"][0]))):
        expected = f"{', '.join(words)} or {expected}"
    actual = format_value(pydantic_error["input"])
    if not pydantic_error["loc"] and isinstance(
        pydantic_error["input"], dict
    ):  # inconsistent values of several fields
        values = ", ".join(f"{name} {format_value(value)}" for name, value in pydantic_error["input"].items())
        actual = shorten(values, _MAX_QUOTED_TABLE_LENGTH)
    return f"expected {expected}, but got {actual}"


def _range_text(number_location: tuple[int | str, ...], model: type[BaseModel]) -> str:
    """Return the range of a number as text, such as "a number from 0 to 1"; "" for a number without bounds.

    If the field has a `BoundsReason`, the text ends with this reason in parentheses.

    number_location : path of the number in the model: the field name, then indices
    """
    info = model.model_fields.get(str(number_location[0])) if number_location else None
    if info is None:
        return ""
    if len(number_location) > 1 and get_args(info.annotation):
        info = FieldInfo.from_annotation(get_args(info.annotation)[-1])
    low, high = field_bounds(info)
    reasons = [one for one in info.metadata if isinstance(one, BoundsReason)]
    reason = f" ({reasons[0]})" if reasons else ""
    kind = "a whole number" if set(_scalar_types(info.annotation)) <= {int, NoneType} else "a number"
    return f"{kind} from {low:.10g} to {high:.10g}{reason}" if low is not None and high is not None else ""


def _scalar_types(annotation: Any) -> Iterator[Any]:
    """Yield the scalar types inside an annotation, such as float for tuple[float, ...] | None."""
    parts = get_args(annotation)
    if get_origin(annotation) is dict:
        yield from _scalar_types(parts[1])
    elif get_origin(annotation) in (tuple, list, Union, UnionType):
        for part in parts:
            yield from _scalar_types(part)
    elif hasattr(annotation, "__metadata__"):
        yield from _scalar_types(parts[0])
    elif annotation is not Ellipsis:
        yield annotation


def _tuple_length_text(pydantic_error: ErrorDetails, model: type[BaseModel]) -> str:
    """Return " of N numbers" if the error is in a tuple field of fixed length N, otherwise ""."""
    info = model.model_fields.get(str(pydantic_error["loc"][0])) if len(pydantic_error["loc"]) == 1 else None
    count = len([part for part in get_args(info.annotation) if part is not Ellipsis]) if info else 0
    return f" of {count} numbers" if count > 1 else ""


def _unknown_field_message(field_name: str, model: type[Any]) -> str:
    """Return the message for an unknown field name, with a suggestion.

    The suggestion is a similar field name, or another settings class that has a field of this name.
    """
    known, finding = list(model.model_fields), "but this name is unknown"
    plain = field_name[:_MAX_NAME_LENGTH].lower().replace("-", "_")
    similar = difflib.get_close_matches(plain, known, 1, 0.7)
    if plain in model.synonyms:
        similar = [model.synonyms[plain]]
    if similar:
        return f"expected {similar[0]}, {finding}"
    base = [one for one in model.__mro__ if "synonyms" in vars(one)][-1]
    owners = [one.__name__ for one in _subclasses(base) if field_name in one.model_fields]
    if owners:
        finding += f" here (it is one of {owners[0]})"
    return f"expected one of {', '.join(known)}, {finding}"


def _subclasses(base_class: type[Any]) -> Iterator[type[BaseModel]]:
    for one in base_class.__subclasses__():
        if not one.__name__.startswith("_"):
            yield one
        yield from _subclasses(one)
