"""What a page may send: rendercanvas' events, each with the fields that it has and values that can be."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from dermis.base.errors import DermisError
from dermis.base.reading import parse_json

_MOST_LETTERS = 4096
_LARGEST_SIDE = 4096  # of a picture [pixel]
_FARTHEST = 1e5  # that a pointer may be from the picture's corner, logical

Seconds = Annotated[float, Field(ge=0.0, le=1e12)]
Place = Annotated[float, Field(ge=-_FARTHEST, le=_FARTHEST)]
Side = Annotated[int, Field(ge=0, le=_LARGEST_SIDE)]
Button = Annotated[int, Field(ge=0, le=16)]
Word = Annotated[str, Field(max_length=32)]


class _Message(BaseModel):
    """Fields that are not listed are dropped, and numbers are finite."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)

    timestamp: Seconds


class Touch(BaseModel):
    """A finger."""

    model_config = ConfigDict(strict=True, extra="ignore", allow_inf_nan=False)

    x: Place
    y: Place
    pressure: Annotated[float, Field(ge=0.0, le=1e3)] = 0.0


class _Held(_Message):
    modifiers: Annotated[list[Word], Field(max_length=8)] = []


class Pointer(_Held):
    """Of a mouse, a pen or fingers."""

    type: Literal[
        "pointer_down", "pointer_move", "pointer_up", "pointer_enter", "pointer_leave", "double_click"
    ]
    x: Place
    y: Place
    button: Button = 0
    buttons: Annotated[list[Button], Field(max_length=16)] = []
    ntouches: Annotated[int, Field(ge=0, le=16)] = 0
    touches: Annotated[dict[Word, Touch], Field(max_length=16)] = {}


class Wheel(_Held):
    """By how much it turned, in the browser's pixels."""

    type: Literal["wheel"]
    x: Place
    y: Place
    dx: Place
    dy: Place
    buttons: Annotated[list[Button], Field(max_length=16)] = []


class Key(_Held):
    """By its name in browsers."""

    type: Literal["key_down", "key_up"]
    key: Word


class Letters(_Message):
    """Text that is typed."""

    type: Literal["char"]
    data: str | None = None
    is_composing: bool = False
    input_type: Word | None = None


class Resize(_Message):
    """Of the page: sides in logical and in physical pixels, and their ratio."""

    type: Literal["resize"]
    width: Place
    height: Place
    pwidth: Side
    pheight: Side
    ratio: Annotated[float, Field(ge=0.1, le=20.0)]


class Seen(_Message):
    """Whether the page can be seen."""

    type: Literal["show", "hide"]


class Shown(_Message):
    """The number of a frame that the page has shown."""

    type: Literal["_framefeedback"]
    index: Annotated[int, Field(ge=0, le=1 << 53)]
    localtime: Seconds = 0.0


_MESSAGES: TypeAdapter[Any] = TypeAdapter(
    Annotated[Pointer | Wheel | Key | Letters | Resize | Seen | Shown, Field(discriminator="type")]
)


def checked(text: Any) -> str | None:
    """The message with nothing but what its kind has; None for one that no page sends.

    text : of any kind, from anyone
    """
    if not isinstance(text, str) or len(text) > _MOST_LETTERS:
        return None
    try:
        message = _MESSAGES.validate_python(parse_json(text, "message", "an event"))
        said: str = message.model_dump_json()
    except (DermisError, ValueError):  # pydantic's, or of half a letter, which no text can hold
        return None
    return said
