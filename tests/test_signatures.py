"""Constructors show their fields in `inspect.signature`, in `help()`, and in editors."""

from __future__ import annotations

import dataclasses
import inspect
import pydoc
from typing import Annotated, Any, Literal

import pytest
from pydantic import Field

import dermis
from dermis.base.registry import RegisteredName, Registry
from dermis.scene.field_errors import AcceptedWords
from dermis.scene.frozen_model import FrozenModel
from dermis.scene.skin import Pigments, TissueLayer

MOST_LINES = 220
"""Lines of `help()` of any public class; `Skin` alone had 521."""
PUBLIC = [thing for name in dermis.__all__ if isinstance(thing := getattr(dermis, name), type)]
CLASSES = [*(one for one in PUBLIC if not issubclass(one, Exception)), Pigments, TissueLayer]
MODELS = [one for one in CLASSES if issubclass(one, FrozenModel)]
KIND = inspect.formatannotation(Literal["raw", "cooked"] | None)
GAIN = inspect.formatannotation(float | Literal["auto"])
COLOURS = Registry("colour", {"red": "", "blue": ""})


class Sample(FrozenModel):
    """A model with a field of each kind.

    More about it.
    """

    name: str = Field(kw_only=False)
    """What it is called."""
    share: Annotated[float, Field(ge=0, le=1)] = 0.25
    """How much of it."""
    place: tuple[Annotated[float, Field(ge=-1)], ...] = ()
    """Where it is, with a text so long that it does not fit on one line of a help text of the usual width."""
    kind: Literal["raw", "cooked"] | None = None
    """How it was made."""
    gain: Annotated[float, Field(gt=0), AcceptedWords("auto")] = 1.0
    """Factor."""
    colour: Annotated[str, RegisteredName(COLOURS)] = "red"
    """Which it has."""


def helped(kind: type) -> str:
    return pydoc.plain(pydoc.render_doc(kind))


def default_of(model: type[FrozenModel], name: str) -> Any:
    info = model.model_fields[name]
    return inspect.Parameter.empty if info.is_required() else info.get_default(call_default_factory=True)


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_every_value_is_in_the_signature_and_in_the_help(kind: type) -> None:
    parameters, text = inspect.signature(kind).parameters, helped(kind)
    first, _, described = text.partition("\n |  \n")
    assert len(text.splitlines()) <= MOST_LINES
    if dataclasses.is_dataclass(kind):
        assert [field.name for field in dataclasses.fields(kind)] == list(parameters)
    for name, parameter in parameters.items():
        assert parameter.annotation not in (inspect.Parameter.empty, Any, "Any"), name
        assert parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD), name
        assert f"{name}: " in first and name in described, name


@pytest.mark.parametrize("kind", MODELS, ids=lambda kind: kind.__name__)
def test_signatures_of_models_show_defaults_only(kind: type[FrozenModel]) -> None:
    parameters, text = inspect.signature(kind).parameters, helped(kind)
    assert {name: one.default for name, one in parameters.items()} == {
        name: default_of(kind, name) for name in kind.model_fields
    }
    assert "FieldInfo" not in text and "model_" not in text and "__" not in text.replace("__init__", "")
    for name in kind.model_fields:
        heading = text.index(f" |  {name} : ")
        assert text[heading:].splitlines()[1].startswith(" |      "), f"{name} has no help"


def test_a_model_lists_its_fields() -> None:
    assert str(inspect.signature(Sample)) == (
        "(name: str, *, share: float = 0.25, place: tuple[float, ...] = (), "
        f"kind: {KIND} = None, gain: {GAIN} = 1.0, colour: str = 'red')"
    )
    assert inspect.getdoc(Sample) == DOCUMENTED
    assert dir(Sample) == ["replace"]


def test_signature_is_unchanged_after_use() -> None:
    class Used(Sample):
        """Model that equals the sample until it is used."""

    before = inspect.signature(Used)
    assert Used("a").name == "a"
    assert inspect.signature(Used) == before


DOCUMENTED = f"""\
A model with a field of each kind.

More about it.

Parameters
----------
name : str
    What it is called.
share : float, default 0.25
    How much of it. [0 to 1]
place : tuple[float, ...], default ()
    Where it is, with a text so long that it does not fit on one line of a help text of the
    usual width.
kind : {KIND}, default None
    How it was made.
gain : {GAIN}, default 1.0
    Factor.
colour : str, default 'red'
    Which it has. [red, blue]"""
