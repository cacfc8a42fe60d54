"""Choice of the layer (set of channels) of an OpenEXR file that is read as the picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dermis.base.errors import shorten
from dermis.images.header import UnsupportedError

_CHANNEL_LETTERS = {"red": "R", "green": "G", "blue": "B", "alpha": "A"}
_READABLE_CHANNEL_SETS = ("RGBA", "RGB", "Y")
_MAIN_LAYER_NAMES = (
    "beauty",
    "combined",
    "composite",
    "image",
    "rgba",
    "rgb",
    "color",
    "colour",
    "c",
    "main",
)
_MAX_LAYER_NAME_LENGTH = 60  # characters
_MAX_LISTED_LAYERS = 6


@dataclass(frozen=True)
class ExrLayer:
    """Layer of an OpenEXR file with the channels of a picture.

    part : index of the part that contains the layer
    name : name of the layer, preceded by the name of the part in files of several parts; empty if the
        channels are named only R, G, B
    channels : names of the red, green, blue and, if present, alpha channels; or the name of the grey channel
    """

    part: int
    name: str
    channels: tuple[str, ...]


def choose_layer(channels_of_parts: Sequence[tuple[str, Sequence[str]]]) -> tuple[ExrLayer, str | None]:
    """Choose the layer to read from an OpenEXR file; also return a note if several layers have colours.

    Layers with colours are preferred to grey layers. Among layers with colours, a layer without a name is
    preferred; the second choice is a layer whose name means the whole picture, such as "beauty".

    channels_of_parts : for each part of the file, its name and the names of its channels

    A file with a single channel of any name is read as grey.

    Raises UnsupportedError if the file has several channels and no layer of colours or grey.
    """
    found = [
        layer
        for index, part in enumerate(channels_of_parts)
        for layer in _picture_layers(index, *part, len(channels_of_parts) > 1)
    ]
    if found:
        chosen = min(found, key=_layer_preference)
        colours = [_display_name(layer.name) for layer in found if len(layer.channels) > 1]
        if len(colours) < 2:
            return chosen, None
        listed = ", ".join(colours[:_MAX_LISTED_LAYERS]) + ", ..." * (len(colours) > _MAX_LISTED_LAYERS)
        return chosen, f"of its layers, {listed}, only {_display_name(chosen.name)} is read"
    names = [name for _, channels in channels_of_parts for name in channels]
    if len(names) == 1:
        return ExrLayer(0, "", (names[0],)), None
    listed = ", ".join(map(_display_name, names[:20]))
    raise UnsupportedError(f"it has channels {listed}, and no layer with R, G and B or Y")


def _picture_layers(
    part_index: int, part_name: str, channels: Sequence[str], has_several_parts: bool
) -> Iterator[ExrLayer]:
    """Yield the layers of a part that can be read as a picture.

    The channels of such a layer are R, G, B and optionally A, or Y alone. The names of the channels may be in
    lower case or spelled out.

    part_index, part_name : index and name of the part
    channels : names of the channels of the part
    has_several_parts : whether the file has several parts; layer names then begin with the name of the part
    """
    groups: dict[str, dict[str, str]] = {}
    for channel in channels:
        layer, _, last = channel.rpartition(".")
        groups.setdefault(layer, {}).setdefault(_CHANNEL_LETTERS.get(last.lower(), last.upper()), channel)
    for layer, letters in groups.items():
        names = next((names for names in _READABLE_CHANNEL_SETS if set(names) <= letters.keys()), None)
        is_vector = names == "Y" and "X" in letters
        if names == "Y" and {"RY", "BY"} & letters.keys():
            raise UnsupportedError("its colours are stored as luminance and chroma (Y, RY, BY)")
        if names and not is_vector:
            title = ".".join(filter(None, (part_name if has_several_parts else "", layer)))
            yield ExrLayer(part_index, title, tuple(letters[name] for name in names))


def _layer_preference(layer: ExrLayer) -> tuple[bool, int]:
    """Return a sort key that puts preferred layers first, see `choose_layer`."""
    last = layer.name.rpartition(".")[2].lower()
    by_name = 0 if not layer.name else 1 if last in _MAIN_LAYER_NAMES else 2
    return len(layer.channels) == 1, by_name


def _display_name(layer_name: str) -> str:
    return (
        shorten("".join(one for one in layer_name if one.isprintable()), _MAX_LAYER_NAME_LENGTH)
        or "the one without a name"
    )
