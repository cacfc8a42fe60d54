"""Options made of the scene's own models, options that commands share, and words as values."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypedDict, get_args

from cyclopts import CoercionError, Group, Parameter, Token

from dermis.base.errors import DermisError, refuse
from dermis.base.quantities import number

if TYPE_CHECKING:
    from dermis.scene.plain import Plain


def _to_int(_: type, tokens: Sequence[Token]) -> int:
    return int(tokens[0].value)


def _to_choice(model: type[Plain], field: str, kind: object, tokens: Sequence[Token]) -> str:
    """Return a word that the field takes; choices may have been registered after the command was imported."""
    from dermis.scene.plain import choices_of

    if (word := tokens[0].value) in (choices := choices_of(model, field)):
        return word
    wanted: Any = Literal[choices]
    raise CoercionError(token=tokens[0], target_type=wanted)


def _to_int_or_word(words: Collection[str], _: type, tokens: Sequence[Token]) -> int | str:
    return tokens[0].value if tokens[0].value in words else int(tokens[0].value)


def _to_size(_: type, tokens: Sequence[Token]) -> tuple[int, int]:
    return parse_size(tokens[0].value, str(tokens[0].keyword))


def _to_colour(_: type, tokens: Sequence[Token]) -> tuple[float, float, float]:
    return parse_colour(tokens[0].value, str(tokens[0].keyword))


Json = Annotated[
    bool, Parameter(name="--json", negative="", show_default=False, help="Print one JSON object.")
]
Adapter = Annotated[
    str,
    Parameter(
        help="auto (the best), cpu (software), a part of an adapter's name, or its number as #1 (see doctor)."
    ),
]
_OUTPUT_NAMES = Parameter(name=("--output", "-o"))
Output = Annotated[Path | None, _OUTPUT_NAMES]
OutputPath = Annotated[Path, _OUTPUT_NAMES]
Flag = Annotated[bool, Parameter(negative="", show_default=False)]
_LENGTH_RANGE_MM = 1e-6, 1e4
Options = dict[str, Any]
"""Fields of a model by name, as they were typed."""
NO_OPTIONS: Options = {}
"""Options of a model when none is given."""
# cyclopts itself would round 64.5.
Integer = Annotated[int | None, Parameter(converter=_to_int)]


def model_options(
    model: type[Plain],
    *,
    only: Collection[str] = (),
    without: Collection[str] = (),
    names: Mapping[str, str] | None = None,
    defaults: Mapping[str, object] | None = None,
) -> Any:
    """Return the type of a command's parameter that takes a dictionary of the fields that were given.

    Each field is an option, with the model's own type, choices, bounds and help, except fields that are
    models themselves.

    only, without : fields that are options (all by default), and fields that are not
    names : options by field, where their name differs
    defaults : what the help shows in place of the model's own
    """
    from dermis.scene.plain import heading_of

    options: dict[str, object] = {}
    for field in only or model.model_fields:
        kind, how = _option_type(model, field)
        if kind is not None and field not in without:
            name, text = option_name(field, names), _option_help(model, field, defaults or {})
            if heading := heading_of(model, field):
                how = how | {"group": Group(heading, sort_key=1)}  # after cyclopts' own groups
            options[field] = Annotated[kind, Parameter(name=name, help=text, **how)]
    made: Any = TypedDict  # mypy wants its names spelled out
    return Annotated[made(model.__name__, options, total=False), Parameter(name="*")]


def given(**options: object) -> Options:
    """Return the options that are not None."""
    return {name: value for name, value in options.items() if value is not None}


def option_name(field: str, names: Mapping[str, str] | None = None) -> str:
    """Return the option of a field: --rho-s for rho_s."""
    return "--" + (names or {}).get(field, field).replace("_", "-")


def is_option(model: type[Plain], field: str) -> bool:
    """Return whether a field can be an option: it holds words or numbers, not other models."""
    return _option_type(model, field)[0] is not None


def _option_type(model: type[Plain], field: str) -> tuple[Any, Options]:
    """Return the type of a field's option, None for no option, and keywords of its `Parameter`."""
    from dermis.scene.field_errors import words_of
    from dermis.scene.plain import choices_of

    if choices := choices_of(model, field):
        return Literal[choices] | str, {"converter": partial(_to_choice, model, field), "metavar": "CHOICE"}
    if words := words_of(model, field):
        number = model.model_fields[field].annotation in (float, int)
        shown = {"metavar": "|".join((*words, "NUMBER" if number else "COLOUR")), "show_choices": False}
        if model.model_fields[field].annotation is int:
            return int | Literal[words], shown | {"converter": partial(_to_int_or_word, words)}
        return (float | Literal[words] if number else str), shown
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


def _option_help(model: type[Plain], field: str, defaults: Mapping[str, object]) -> str:
    """Return a field's help with its bounds, unless they are trivial, and its default."""
    from dermis.scene.field_errors import words_of
    from dermis.scene.plain import choices_of, help_of, shown, values_of

    text = help_of(model, field)
    worded = choices_of(model, field) or words_of(model, field)  # which cyclopts adds itself
    if (values := values_of(model, field)) and not worded:
        text += f" [range: {values}]"
    default = shown(defaults.get(field, model.model_fields[field].get_default()))
    return f"{text} [default: {default}]" if default else text


def check(model: type[Plain], values: Mapping[str, object], names: Mapping[str, str] | None = None) -> None:
    """Refuse impossible values of a model's fields, under the names of their options.

    values : by field
    names : options by field, where their name differs
    """
    from dermis.scene.field_errors import ImpossibleError

    try:
        model(**values)
    except ImpossibleError as error:
        place, finding = next(iter(error.findings.items()))
        field = place.partition(".")[0] or next(name for name in model.model_fields if name in values)
        raise DermisError(f"{option_name(field, names)}: {finding}. Correct it.") from None


def refuse_options(fields: Iterable[str], names: Mapping[str, str] | None, place: str, remedy: str) -> None:
    """Refuse options that would have no effect."""
    for field in fields:
        refuse(option_name(field, names), f"no such option {place}", "it came", remedy)


def parse_size(text: str, option: str = "--size") -> tuple[int, int]:
    """Return width and height [pixel] of "1024x1024"."""
    match = re.fullmatch(r"(\d{1,9})x(\d{1,9})", text)
    if not match:
        came, remedy = f"{text!r} came", "Write two whole numbers with an x"
        refuse(option, "WIDTHxHEIGHT, such as 1024x1024", came, remedy)
    return int(match[1]), int(match[2])


def parse_colour(text: str, option: str) -> tuple[float, float, float]:
    """Return linear Rec. 709 of "red,green,blue"."""
    try:
        red, green, blue = (float(part) for part in text.split(","))
    except ValueError:
        refuse(option, "red,green,blue, such as 0,0,0", f"{text!r} came", "Write three numbers")
    return red, green, blue


def parse_lengths(option: str, text: str) -> tuple[float, ...]:
    """Return lengths [mm] of "0.5,1,2"."""
    try:
        lengths = tuple(float(part) for part in text.split(","))
    except ValueError:
        refuse(option, "lengths in mm, such as 0.5,1,2", f"{text!r} came", "Write numbers with commas")
    return tuple(number(option, length, *_LENGTH_RANGE_MM, "mm") for length in lengths)
