"""Command line options generated from pydantic models, shared option types, and parsers of option values."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict, TypeVar, get_args

from cyclopts import CoercionError, Group, Parameter, Token

from dermis.base.errors import DermisError, refuse
from dermis.base.quantities import checked_number

if TYPE_CHECKING:
    from dermis.scene.frozen_model import FrozenModel

M = TypeVar("M", bound="FrozenModel")


def _to_int(_: type, tokens: Sequence[Token]) -> int:
    return int(tokens[0].value)


def _to_choice(
    model: type[FrozenModel], field_name: str, choice_type: object, tokens: Sequence[Token]
) -> str:
    """Check that the value of an option is one of the allowed choices, and return the value unchanged.

    This function is a converter for cyclopts.

    model, field_name : settings model, and the field of this model that the option sets
    choice_type : type of the option; unused, but passed by cyclopts
    tokens : list with one element, the value of the option on the command line

    Raises CoercionError if the value is not one of the field's choices.
    """
    from dermis.scene.frozen_model import field_choices

    if (word := tokens[0].value) in (choices := field_choices(model, field_name)):
        return word
    expected_type: Any = Literal[choices]
    raise CoercionError(token=tokens[0], target_type=expected_type)


def _to_int_or_word(keywords: Collection[str], _: type, tokens: Sequence[Token]) -> int | str:
    return tokens[0].value if tokens[0].value in keywords else int(tokens[0].value)


def _to_size(_: type, tokens: Sequence[Token]) -> tuple[int, int]:
    return parse_size(tokens[0].value, str(tokens[0].keyword))


def _to_colour(_: type, tokens: Sequence[Token]) -> tuple[float, float, float]:
    return parse_colour(tokens[0].value, str(tokens[0].keyword))


JsonOption = Annotated[bool, Parameter(name="--json", negative="", show_default=False)]
AdapterOption = Annotated[
    str,
    Parameter(
        help="Graphics adapter: auto (the best), cpu (software), part of a name, or a number such as #1 "
        "(see `dermis doctor`)."
    ),
]
_OUTPUT_OPTION_NAMES = Parameter(name=("--output", "-o"))
OptionalOutputPath = Annotated[Path | None, _OUTPUT_OPTION_NAMES]
OutputPath = Annotated[Path, _OUTPUT_OPTION_NAMES]
FlagOption = Annotated[bool, Parameter(negative="", show_default=False)]
_LENGTH_RANGE_MM = 1e-6, 1e4
Options = dict[str, Any]
"""Values of options by the name of the model field."""
NO_OPTIONS: Options = {}
"""Default of a parameter of type `Options`."""
IntegerOption = Annotated[int | None, Parameter(converter=_to_int)]
"""Integer option; unlike cyclopts' own conversion it refuses 64.5 instead of rounding it."""


def model_options(
    model: type[FrozenModel],
    *,
    only_fields: Collection[str] = (),
    excluded_fields: Collection[str] = (),
    option_names: Mapping[str, str] | None = None,
    shown_defaults: Mapping[str, object] | None = None,
) -> Any:
    """Return a parameter type for cyclopts that has one option per field of a settings model.

    An option has the type, choices, bounds and help of the field; fields that hold other models have no
    option. The value of the parameter is a dictionary from field names to values, with entries only for
    the options given on the command line.

    only_fields : names of the fields to include; all fields by default
    excluded_fields : names of the fields to exclude
    option_names : dictionary from fields to option names, for fields whose option has a different name
    shown_defaults : dictionary from fields to defaults that the help shows instead of the model's defaults
    """
    from dermis.scene.frozen_model import field_heading

    options: dict[str, object] = {}
    for field in only_fields or model.model_fields:
        kind, keywords = _option_type(model, field)
        if kind is not None and field not in excluded_fields:
            name, help_text = (
                option_name(field, option_names),
                _option_help(model, field, shown_defaults or {}),
            )
            if heading := field_heading(model, field):
                keywords = keywords | {"group": Group(heading, sort_key=1)}  # after cyclopts' own groups
            options[field] = Annotated[kind, Parameter(name=name, help=help_text, **keywords)]
    typed_dict: Any = TypedDict  # mypy requires literal names
    return Annotated[typed_dict(model.__name__, options, total=False), Parameter(name="*")]


def drop_none(**options: object) -> Options:
    """Return the keyword arguments that are not None, as a dictionary."""
    return {name: value for name, value in options.items() if value is not None}


def option_name(field: str, option_names: Mapping[str, str] | None = None) -> str:
    """Return the command line option for a field, such as --rho-s for rho_s.

    option_names : dictionary from fields to option names, for fields whose option has a different name
    """
    return "--" + (option_names or {}).get(field, field).replace("_", "-")


def is_option(model: type[FrozenModel], field: str) -> bool:
    """Return whether a field gets an option: true if it holds words, numbers or tuples, false if a model."""
    return _option_type(model, field)[0] is not None


def _option_type(model: type[FrozenModel], field: str) -> tuple[Any, Options]:
    """Return the type of a field's option and the keyword arguments of its `cyclopts.Parameter`.

    The type is None for fields that cannot be options.
    """
    from dermis.scene.field_errors import field_keywords
    from dermis.scene.frozen_model import field_choices

    if choices := field_choices(model, field):
        return Literal[choices] | str, {"converter": partial(_to_choice, model, field), "metavar": "CHOICE"}
    if keywords := field_keywords(model, field):
        number = model.model_fields[field].annotation in (float, int)
        display = {"metavar": "|".join((*keywords, "NUMBER" if number else "COLOUR")), "show_choices": False}
        if model.model_fields[field].annotation is int:
            return int | Literal[keywords], display | {"converter": partial(_to_int_or_word, keywords)}
        return (float | Literal[keywords] if number else str), display
    kind = model.model_fields[field].annotation
    kind = next((one for one in get_args(kind) if get_args(kind)[-1] is NoneType), kind)
    parts = tuple(get_args(part)[0] if get_args(part) else part for part in get_args(kind))
    known: dict[object, tuple[object, Options]] = {
        int: (int, {"converter": _to_int}),
        (int, int): (
            tuple[int, int],
            {"n_tokens": 1, "negative": "", "converter": _to_size, "metavar": "WIDTHxHEIGHT"},
        ),
        (float, float, float): (
            tuple[float, float, float],
            {"n_tokens": 1, "negative": "", "converter": _to_colour, "metavar": "R,G,B"},
        ),
        (str, ...): (list[str], {"negative": ""}),
    }
    return (kind, {}) if kind in (bool, float, str) else known.get(parts or kind, (None, {}))


def _option_help(model: type[FrozenModel], field: str, shown_defaults: Mapping[str, object]) -> str:
    """Return the help text of a field's option, with its range and default."""
    from dermis.scene.field_errors import field_keywords
    from dermis.scene.frozen_model import accepted_values, field_choices, field_help, format_default

    text = field_help(model, field)
    has_choices = field_choices(model, field) or field_keywords(model, field)  # added by cyclopts
    if (values := accepted_values(model, field)) and not has_choices:
        text += f" [range: {values}]"
    default = format_default(shown_defaults.get(field, model.model_fields[field].get_default()))
    return f"{text} [default: {default}]" if default else text


def check_fields(
    model: type[M], field_values: Mapping[str, object], option_names: Mapping[str, str] | None = None
) -> M:
    """Return a model instance with given field values; error messages name options instead of fields.

    option_names : dictionary from fields to option names, for fields whose option has a different name

    Raises DermisError for invalid values.
    """
    from dermis.scene.field_errors import InvalidFieldsError

    try:
        return model(**field_values)
    except InvalidFieldsError as error:
        path, finding = next(iter(error.messages.items()))
        field = path.partition(".")[0] or next(name for name in model.model_fields if name in field_values)
        raise DermisError(f"{option_name(field, option_names)}: {finding}. Correct it.") from None


def refuse_options(
    fields: Iterable[str], option_names: Mapping[str, str] | None, context: str, advice: str
) -> None:
    """Raise DermisError if any option is given where it would have no effect.

    fields : names of the fields that the given options set
    option_names : dictionary from fields to option names, for fields whose option has a different name
    context : description of the context for the message, such as "with a dask cluster"
    advice : advice to the user, for the message
    """
    for field in fields:
        refuse(option_name(field, option_names), f"no such option {context}", "it is given", advice)


def parse_size(option_value: str, option: str = "--size") -> tuple[int, int]:
    """Return the width and height [pixel] of an option value such as "1024x1024"."""
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", option_value)
    if not match:
        refuse(
            option, "WIDTHxHEIGHT, such as 1024x1024", f"got {option_value!r}", "Write two integers with an x"
        )
    return int(match[1]), int(match[2])


def parse_colour(option_value: str, option: str) -> tuple[float, float, float]:
    """Return the linear Rec. 709 colour of an option value "red,green,blue"."""
    try:
        red, green, blue = (float(part) for part in option_value.split(","))
    except ValueError:
        refuse(option, "red,green,blue, such as 0,0,0", f"got {option_value!r}", "Write three numbers")
    return red, green, blue


def parse_lengths(option: str, option_value: str) -> tuple[float, ...]:
    """Return the lengths [mm] of an option value such as "0.5,1,2"."""
    try:
        lengths = tuple(float(part) for part in option_value.split(","))
    except ValueError:
        refuse(option, "lengths in mm, such as 0.5,1,2", f"got {option_value!r}", "Write numbers with commas")
    return tuple(checked_number(option, length, *_LENGTH_RANGE_MM, "mm") for length in lengths)
