"""Base class of scene data: immutable pydantic models with validated fields."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Mapping
from functools import reduce
from inspect import Parameter, Signature, cleandoc, formatannotation
from operator import or_
from types import FunctionType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    Self,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
)

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, PrivateAttr, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from dermis.base.errors import format_value, refuse
from dermis.base.registry import RegisteredName
from dermis.scene.field_errors import (
    InvalidFieldsError,
    Reason,
    field_bounds,
    field_keywords,
    messages_by_field,
    numeric_fields,
    python_numbers,
)

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

MAX_COORDINATE_MM = 1e6
_DISPLAYED_BOUND = 1e5  # larger bounds only keep numbers finite
_MEMBER_TYPES = FunctionType, classmethod, property
_DOCSTRING_WIDTH = 92


def _direction(v: tuple[float, float, float]) -> tuple[float, float, float]:
    if sum(abs(c) for c in v) < 1e-6:
        raise ValueError("a direction other than (0, 0, 0)")
    return v


Coordinate = Annotated[
    float,
    Field(ge=-MAX_COORDINATE_MM, le=MAX_COORDINATE_MM),
    Reason("mm: beyond a kilometre single precision is too coarse for skin"),
]
Vector = tuple[Coordinate, Coordinate, Coordinate]
_Component = Annotated[
    float, Field(ge=-MAX_COORDINATE_MM, le=MAX_COORDINATE_MM), Reason("only their ratios count")
]
Direction = Annotated[tuple[_Component, _Component, _Component], AfterValidator(_direction)]
Intensity = Annotated[
    float, Field(ge=0, le=1e6), Reason("light is not negative, and the sun on skin is about 3")
]
Colour = tuple[Intensity, Intensity, Intensity]


@dataclass_transform(kw_only_default=True, field_specifiers=(Field, PrivateAttr))
class _Documented(ModelMetaclass):
    # Metaclass of all models: signature and docstring list the fields, and `dir` omits the names of pydantic.
    # Type checkers read the fields themselves.
    if not TYPE_CHECKING:

        @property
        def __signature__(self) -> Signature:
            return constructor_signature(self)

        @__signature__.setter
        def __signature__(self, signature: Any) -> None:
            """Ignore the signature of pydantic, which shows the parameters of `__init__`."""

        @property
        def __doc__(self) -> str:
            return model_docstring(self)

        def __dir__(self) -> list[str]:
            bases = self.__mro__[: self.__mro__.index(BaseModel)]
            members = {name: member for base in reversed(bases) for name, member in vars(base).items()}
            public = ((name, member) for name, member in members.items() if name[0] != "_")
            return [name for name, member in public if isinstance(member, _MEMBER_TYPES)]


class FrozenModel(BaseModel, metaclass=_Documented):
    """Base class of immutable settings with validated fields.

    The docstring below a field is its help text in Python, on the command line, in the viewer and in the
    documentation.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, defer_build=True)
    synonyms: ClassVar[Mapping[str, str]] = {}
    """Names that other programs use, and the fields that they correspond to."""

    def __init__(self, *value: Any, **data: Any) -> None:
        """Set fields by name; if exactly one field is required, it may be positional."""
        model = type(self)
        if value:
            data[_positional_field(model, value)] = value[0]
        for name, text in numeric_fields(model).items():
            if name in data:
                data[name] = python_numbers(data[name], text)
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InvalidFieldsError(model.__name__, messages_by_field(error.errors(), model)) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuse assignments, with advice to use `replace`."""
        owner, advice = type(self).__name__, f"Write replace({name}={format_value(value)}) for a changed copy"
        refuse(owner, "no assignment, as settings are immutable", f"got one to {name}", advice)

    def replace(self, **values: Any) -> Self:
        """Return a validated copy with other values of some fields."""
        return type(self)(**{name: getattr(self, name) for name in self.model_fields_set} | values)

    def __eq__(self, other: object) -> bool:
        """Return whether the other object has the same class and equal fields.

        This is ten times as fast as the comparison of pydantic.
        """
        return type(self) is type(other) and vars(self) == vars(other)


class SliderRange(NamedTuple):
    """Ends of the slider of a numeric field."""

    low: float
    high: float
    logarithmic: bool = False


def slider(low: float, high: float, *, log: bool = False) -> dict[str, Any]:
    """Return `json_schema_extra` of a field whose slider covers less than the bounds of the field."""
    return {"slider": SliderRange(low, high, log)}


def field_help(model: type[BaseModel], field: str) -> str:
    """Return the help text of a field on one line, with a summary of each registered name that it accepts."""
    info = model.model_fields[field]
    text = re.sub(r"\s+", " ", info.description or "")
    summaries = [one for named in _registry_names(info) for one in named.registry.summaries()]
    return f"{text} {'; '.join(summaries)}." if summaries else text


def field_choices(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """Return the words that a field accepts; empty for fields of other types."""
    info = model.model_fields[field]
    for named in _registry_names(info):
        return named.names
    words = [word for one in _union_members(info) if get_origin(one) is Literal for word in get_args(one)]
    return tuple(words)


def field_slider_range(model: type[BaseModel], field: str) -> SliderRange | None:
    """Return the slider range of a number or of the numbers in a tuple; None without two bounds."""
    return _slider_range(model.model_fields[field])


class Heading(str):
    """Annotation of a field: heading under which help texts and panels list it."""

    __slots__ = ()


def field_heading(model: type[BaseModel], field: str) -> str:
    """Return the heading under which a field is listed; empty for a main field."""
    return next((one for one in model.model_fields[field].metadata if isinstance(one, Heading)), "")


def fields_under(heading: str, model: type[BaseModel]) -> list[str]:
    """Return the fields listed under a heading; an empty heading selects the main fields."""
    return [name for name in model.model_fields if field_heading(model, name) == heading]


def constructor_signature(model: type[BaseModel]) -> Signature:
    """Return the signature of a model's constructor; a single required field may be positional."""
    return Signature(sorted(_parameters(model, _required(model)), key=lambda one: one.kind))


def _parameters(model: type[BaseModel], required: list[str]) -> Iterator[Parameter]:
    for name, info in model.model_fields.items():
        kind = Parameter.POSITIONAL_OR_KEYWORD if required == [name] else Parameter.KEYWORD_ONLY
        default = Parameter.empty if info.is_required() else info.get_default(call_default_factory=True)
        annotation = _without_checks(info.annotation)
        if words := field_keywords(model, name):
            annotation = annotation | Literal[words]
        yield Parameter(name, kind, default=default, annotation=annotation)


def _without_checks(kind: Any) -> Any:
    """Return a type without the metadata that checks its values."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _without_checks(parts[0])
    if origin in (None, Literal):
        return kind
    plain_parts = tuple(map(_without_checks, parts))
    return reduce(or_, plain_parts) if origin in (Union, UnionType) else origin[plain_parts]


def model_docstring(model: type[BaseModel]) -> str:
    """Return the docstring of a model in numpydoc form, with a section of its fields for each heading."""
    sections: dict[str, list[str]] = {"Parameters": []}
    for parameter in constructor_signature(model).parameters.values():
        lines = sections.setdefault(field_heading(model, parameter.name) or "Parameters", [])
        default = "" if parameter.default is Parameter.empty else f", default {parameter.default!r}"
        lines.append(f"{parameter.name} : {formatannotation(parameter.annotation)}{default}")
        bounds = "" if "Literal" in lines[-1] else accepted_values(model, parameter.name)
        text = field_help(model, parameter.name) + (f" [{bounds}]" if bounds else "")
        wrapped = textwrap.wrap(text, _DOCSTRING_WIDTH - 4, break_on_hyphens=False)
        lines += [f"    {line}" for line in wrapped]
    listed = ["\n".join(["", title, "-" * len(title), *lines]) for title, lines in sections.items() if lines]
    text, *examples = re.split(r"\n(?=\nExamples\n-)", cleandoc(vars(model)["__doc__"] or ""))
    return "\n".join([text, *listed, *examples])


def accepted_values(model: type[BaseModel], field: str) -> str:
    """Return the accepted words and the bounds of a field as text; empty for fields without either."""
    low, high = field_bounds(model.model_fields[field])
    words = [*field_keywords(model, field), *field_choices(model, field)]
    if low is not None and high is not None and high < _DISPLAYED_BOUND:
        words.append(f"{low:g} to {high:g}")
    return ", ".join(words)


def format_default(value: Any) -> str:
    """Return a default value as a user would type it; empty for None, booleans and required fields."""
    if isinstance(value, tuple):
        return ("x" if all(isinstance(one, int) for one in value) else ",").join(map(format_default, value))
    if value is None or isinstance(value, bool) or value is PydanticUndefined:
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def _registry_names(info: FieldInfo) -> list[RegisteredName]:
    return [one for one in info.metadata if isinstance(one, RegisteredName)]


def _union_members(info: FieldInfo) -> tuple[Any, ...]:
    """Return the member types of a field's annotation."""
    kind = info.annotation
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _slider_range(info: FieldInfo) -> SliderRange | None:
    extra = info.json_schema_extra
    if isinstance(extra, dict) and "slider" in extra:
        return SliderRange(*extra["slider"])  # type: ignore[misc]
    for kind in _union_members(info):
        if get_origin(kind) is tuple:
            return _slider_range(FieldInfo.from_annotation(get_args(kind)[0]))
    low, high = field_bounds(info)
    return None if low is None or high is None else SliderRange(low, high)


def _required(model: type[BaseModel]) -> list[str]:
    """Return the fields without a default."""
    return [name for name, info in model.model_fields.items() if info.is_required()]


def _positional_field(model: type[BaseModel], value: tuple[Any, ...]) -> str:
    """Return the name of the field that a positional argument sets."""
    required = _required(model)
    if len(required) != 1 or len(value) != 1:
        names = ", ".join(f"{name}=..." for name in list(model.model_fields)[:3])
        actual = f"got {format_value(value[0])} without one"
        refuse(model.__name__, f"values by name, such as {names}", actual, "Name it")
    return required[0]
