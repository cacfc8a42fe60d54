"""Base class of scene settings: immutable pydantic models with validated, documented fields."""

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
    BoundsReason,
    InvalidFieldsError,
    field_bounds,
    field_keywords,
    messages_by_field,
    numeric_fields,
    to_python_numbers,
)

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

MAX_COORDINATE_MM = 1e6
_MAX_DISPLAYED_BOUND = 1e5  # larger bounds are not shown to users, as they only keep numbers finite
_PUBLIC_MEMBER_TYPES = FunctionType, classmethod, property
_DOCSTRING_WIDTH = 92


def _checked_direction(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    if sum(abs(c) for c in vector) < 1e-6:
        raise ValueError("a direction other than (0, 0, 0)")
    return vector


Coordinate = Annotated[
    float,
    Field(ge=-MAX_COORDINATE_MM, le=MAX_COORDINATE_MM),
    BoundsReason("mm: beyond a kilometre single precision is too coarse for skin"),
]
Vector = tuple[Coordinate, Coordinate, Coordinate]
_DirectionComponent = Annotated[
    float, Field(ge=-MAX_COORDINATE_MM, le=MAX_COORDINATE_MM), BoundsReason("only their ratios count")
]
Direction = Annotated[
    tuple[_DirectionComponent, _DirectionComponent, _DirectionComponent], AfterValidator(_checked_direction)
]
Intensity = Annotated[
    float, Field(ge=0, le=1e6), BoundsReason("light is not negative, and the sun on skin is about 3")
]
Colour = tuple[Intensity, Intensity, Intensity]


@dataclass_transform(kw_only_default=True, field_specifiers=(Field, PrivateAttr))
class _DocumentedMeta(ModelMetaclass):
    # Metaclass of all models: signature and docstring list the fields, and `dir` omits the names of pydantic.
    # Type checkers read the fields themselves.
    if not TYPE_CHECKING:

        @property
        def __signature__(self) -> Signature:
            return constructor_signature(self)

        @__signature__.setter
        def __signature__(self, signature: Any) -> None:
            """Ignore the signature that pydantic sets; `constructor_signature` replaces it."""

        @property
        def __doc__(self) -> str:
            return model_docstring(self)

        def __dir__(self) -> list[str]:
            bases = self.__mro__[: self.__mro__.index(BaseModel)]
            members = {name: member for base in reversed(bases) for name, member in vars(base).items()}
            public = ((name, member) for name, member in members.items() if name[0] != "_")
            return [name for name, member in public if isinstance(member, _PUBLIC_MEMBER_TYPES)]


class FrozenModel(BaseModel, metaclass=_DocumentedMeta):
    """Base class of immutable settings with validated fields, such as `Camera` and `Skin`.

    The string literal below a field is its help text in Python, on the command line, in the viewer and in the
    documentation.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True, defer_build=True)
    synonyms: ClassVar[Mapping[str, str]] = {}
    """Names that other programs use, and the fields that they correspond to."""

    def __init__(self, *value: Any, **data: Any) -> None:
        """Set fields passed as keywords; a single required field may be passed as a positional argument."""
        model = type(self)
        if value:
            data[_positional_field(model, value)] = value[0]
        for name, text in numeric_fields(model).items():
            if name in data:
                data[name] = to_python_numbers(data[name], text)
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise InvalidFieldsError(model.__name__, messages_by_field(error.errors(), model)) from None

    def __setattr__(self, name: str, value: Any) -> None:
        """Raise DermisError with advice to use `replace`, as settings are immutable."""
        owner, advice = type(self).__name__, f"Write replace({name}={format_value(value)}) for a changed copy"
        refuse(owner, "no assignment, as settings are immutable", f"got one to {name}", advice)

    def replace(self, **values: Any) -> Self:
        """Return a validated copy in which the fields passed as keywords have new values."""
        return type(self)(**{name: getattr(self, name) for name in self.model_fields_set} | values)

    def __eq__(self, other: object) -> bool:
        """Return whether another object has the same class and equal fields.

        This comparison is ten times as fast as pydantic's.
        """
        return type(self) is type(other) and vars(self) == vars(other)


class SliderRange(NamedTuple):
    """Range of the viewer's slider for a numeric field.

    low, high : values at the ends of the slider
    logarithmic : whether equal slider steps multiply the value by equal factors
    """

    low: float
    high: float
    logarithmic: bool = False


def slider(low: float, high: float, *, logarithmic: bool = False) -> dict[str, Any]:
    """Return the argument `json_schema_extra` for a field whose slider range is narrower than its bounds.

    low, high : values at the ends of the slider
    logarithmic : whether equal slider steps multiply the value by equal factors
    """
    return {"slider": SliderRange(low, high, logarithmic)}


def field_help(model: type[BaseModel], field: str) -> str:
    """Return the help text of a field as one line, followed by summaries of the names that it accepts.

    Only names from a registry, such as the names of techniques, have summaries.
    """
    info = model.model_fields[field]
    text = re.sub(r"\s+", " ", info.description or "")
    summaries = [one for named in _registry_names(info) for one in named.registry.summaries()]
    return f"{text} {'; '.join(summaries)}." if summaries else text


def field_choices(model: type[BaseModel], field: str) -> tuple[str, ...]:
    """Return the words that a text field accepts; empty if it accepts any text or is not a text field."""
    info = model.model_fields[field]
    for named in _registry_names(info):
        return named.names
    words = [word for one in _union_members(info) if get_origin(one) is Literal for word in get_args(one)]
    return tuple(words)


def field_slider_range(model: type[BaseModel], field: str) -> SliderRange | None:
    """Return the slider range of a numeric or tuple field; None if the field lacks a lower or upper bound."""
    return _slider_range(model.model_fields[field])


class HelpHeading(str):
    """Annotation of a field that groups it under a heading in help texts and in the viewer's panels."""

    __slots__ = ()


def field_heading(model: type[BaseModel], field: str) -> str:
    """Return the heading under which help texts list a field; "" for fields without a `HelpHeading`."""
    return next((one for one in model.model_fields[field].metadata if isinstance(one, HelpHeading)), "")


def fields_under(heading: str, model: type[BaseModel]) -> list[str]:
    """Return the names of the fields under a heading; "" selects the fields without a `HelpHeading`."""
    return [name for name in model.model_fields if field_heading(model, name) == heading]


def constructor_signature(model: type[BaseModel]) -> Signature:
    """Return the signature of a model's constructor, for `help()` and the generated docstring.

    Fields are keyword-only, except that a single required field may be positional.
    """
    return Signature(
        sorted(_constructor_parameters(model, _required_fields(model)), key=lambda one: one.kind)
    )


def _constructor_parameters(model: type[BaseModel], required_fields: list[str]) -> Iterator[Parameter]:
    for name, info in model.model_fields.items():
        kind = Parameter.POSITIONAL_OR_KEYWORD if required_fields == [name] else Parameter.KEYWORD_ONLY
        default = Parameter.empty if info.is_required() else info.get_default(call_default_factory=True)
        annotation = _without_metadata(info.annotation)
        if words := field_keywords(model, name):
            annotation = annotation | Literal[words]
        yield Parameter(name, kind, default=default, annotation=annotation)


def _without_metadata(annotation: Any) -> Any:
    """Return an annotation without `Annotated` metadata, such as float for a bounded float."""
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _without_metadata(parts[0])
    if origin in (None, Literal):
        return annotation
    plain_parts = tuple(map(_without_metadata, parts))
    return reduce(or_, plain_parts) if origin in (Union, UnionType) else origin[plain_parts]


def model_docstring(model: type[BaseModel]) -> str:
    """Return the docstring of a model in numpydoc format, with the model's fields grouped by heading."""
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
    """Return the accepted words and bounds of a field, such as "auto, 0 to 1"; "" if there are none."""
    low, high = field_bounds(model.model_fields[field])
    words = [*field_keywords(model, field), *field_choices(model, field)]
    if low is not None and high is not None and high < _MAX_DISPLAYED_BOUND:
        words.append(f"{low:g} to {high:g}")
    return ", ".join(words)


def format_default(default_value: Any) -> str:
    """Return a default value as a user types it on the command line.

    The result is "" for None, for booleans and for a field without a default.
    """
    if isinstance(default_value, tuple):
        return ("x" if all(isinstance(one, int) for one in default_value) else ",").join(
            map(format_default, default_value)
        )
    if default_value is None or isinstance(default_value, bool) or default_value is PydanticUndefined:
        return ""
    return f"{default_value:g}" if isinstance(default_value, float) else str(default_value)


def _registry_names(field_info: FieldInfo) -> list[RegisteredName]:
    return [one for one in field_info.metadata if isinstance(one, RegisteredName)]


def _union_members(field_info: FieldInfo) -> tuple[Any, ...]:
    """Return the types of a union annotation, or the single type of another annotation."""
    kind = field_info.annotation
    return get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)


def _slider_range(field_info: FieldInfo) -> SliderRange | None:
    extra = field_info.json_schema_extra
    if isinstance(extra, dict) and "slider" in extra:
        return SliderRange(*extra["slider"])  # type: ignore[misc]
    for kind in _union_members(field_info):
        if get_origin(kind) is tuple:
            return _slider_range(FieldInfo.from_annotation(get_args(kind)[0]))
    low, high = field_bounds(field_info)
    return None if low is None or high is None else SliderRange(low, high)


def _required_fields(model: type[BaseModel]) -> list[str]:
    """Return the names of the fields without a default."""
    return [name for name, info in model.model_fields.items() if info.is_required()]


def _positional_field(model: type[BaseModel], arguments: tuple[Any, ...]) -> str:
    """Return the name of the single required field, which a positional argument sets.

    Raises DermisError if the model has several required fields or none, or gets several arguments.
    """
    required = _required_fields(model)
    if len(required) != 1 or len(arguments) != 1:
        names = ", ".join(f"{name}=..." for name in list(model.model_fields)[:3])
        actual = f"got {format_value(arguments[0])} without one"
        refuse(model.__name__, f"values by name, such as {names}", actual, "Name it")
    return required[0]
