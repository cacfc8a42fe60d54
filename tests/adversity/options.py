"""All options of all commands, as defined by the command line itself, and values for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from random import Random
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from adversity.hostile import NAMES, NUMBERS, number

_COSTLY = (
    "--size",
    "--atlas",
    "--samples",
    "--shadow-size",
    "--photons",
    "--subdivide",
    "--fit",
    "--spectral",
    "--motion-fps",
    "--fps",
)
"""More of these is a longer wait for what was asked: they get small numbers, and ones that cannot be."""
_IMPOSSIBLE = (
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "9" * 5000,
    "0x10",
    "1e",
    "x",
    "-0.0",
    "99999999999999999999",
    "",
)
_USUAL: Mapping[str, tuple[str, ...]] = {
    "--size": ("64x64", "1x1", "33x17", "0x0", "64x-1", "99999x99999", "64x64x64", "٣x٣"),
    "--atlas": ("64", "96", "128"),
    "--samples": ("1", "2", "4"),
    "--shadow-size": ("64", "128"),
    "--photons": ("10", "1000"),
    "--subdivide": ("0", "1"),
    "--fit": ("1", "3"),
    "--fps": ("30", "24000/1001", "1/0", "0/1"),
    "--motion-fps": ("30", "10"),
    "--lights": ("studio", "none", "lights.toml", "sky.hdr"),
    "--env": ("uniform", "sky.hdr", "head.obj"),
    "--camera": ("portrait", "ear", "camera.toml"),
    "--spectral": ("31", "2", "730,805", "{},500", "400,{}"),
    "--light-spectrum": ("A", "FL11", "skin.png", "take.csv"),
    "--camera-sensitivity": ("take.csv", "skin.png"),
    "--profile": ("gpu-gems-3", "profile.csv", "scene.toml"),
    "--colour": ("skin.png", "grey.png"),
    "--normal": ("normal.png", "skin.png"),
    "--height": ("height.png", "grey.png"),
    "--specular-map": ("grey.png", "height.png"),
    "--roughness-map": ("grey.png", "skin.png"),
    "--background": ("none", "environment", "0,0,0", "0.1,0.2,nan"),
    "--regions": ("auto", "none", "default", "scene.toml"),
    "--motion": ("take.csv", "head.glb", "head.obj"),
    "--pose": ("jawOpen=1", "jawOpen={}", "nobody=1", "jawOpen", "=1", "jawOpen=1,jawOpen=2"),
    "--expression": ("jawOpen=1", "jawOpen={}", "nobody=1"),
    "--bone": ("head=0,20,0", "head={},0,0", "head=1", "nobody=0,0,0"),
    "--eye": ("pupil_mm=2", "pupil_mm={}", "seed={}", "redness=1"),
    "--target": ("age=1", "{}=1"),
    "--look-at": ("camera", "0,0,1000", "{},0,0"),
    "--through": ("0.5,1", "{}", "0,1"),
    "--techniques": ("none", "none,none", "wet"),
    "--against": ("surface-integral", "heat", "nobody"),
    "--adapter": ("cpu", "nobody"),
    "--output": ("out.png", "out.exr", "out.mp4", "out.toml", "frames/%03d.png", "nobody/out.png", "out.jpg"),
}
_EXTREMES = ("0.5", "1", "2", "0.1", "0", "1e-6", "1000", "1e6", "1e30")  # that many quantities can be
_TEXTS = tuple(one.replace("\0", "").replace("\ud800", "\udc80") for one in NAMES)  # as a shell can pass


@dataclass(frozen=True)
class Option:
    """Option of a command.

    names : names as typed; one in capitals is a positional argument
    kind : type of the value
    """

    names: tuple[str, ...]
    kind: Any

    @property
    def positional(self) -> bool:
        """Return whether it is a positional argument."""
        return not self.names[0].startswith("-")

    def words(self, rng: Random) -> list[str]:
        """Return the option with a value, plausible as often as hostile."""
        name = rng.choice(self.names)
        if self.kind is bool:
            return [name]
        value = self._usual(rng) if rng.random() < 0.5 else self._hostile(rng)
        value = value.replace("{}", number(rng))
        return [value] if self.positional else [name, value]

    def _usual(self, rng: Random) -> str:
        known = _USUAL.get(self.names[0]) or tuple(map(str, _choices(self.kind)))
        return rng.choice(known or _EXTREMES)

    def _hostile(self, rng: Random) -> str:
        if self.names[0] in _COSTLY:
            return rng.choice(_IMPOSSIBLE)
        if rng.random() < 0.5:
            return rng.choice(_TEXTS)
        count = rng.choice((1, 1, 3))
        return ",".join(rng.choice(NUMBERS) for _ in range(count))


def _choices(kind: Any) -> tuple[Any, ...]:
    """Return the words that a type permits."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return tuple(word for one in get_args(kind) for word in _choices(one))
    return ()


@cache
def options_of_commands() -> Mapping[str, tuple[Option, ...]]:
    """Return the options by command."""
    from cyclopts import App

    from dermis.cli import COMMANDS

    app, found = App(name="dermis"), {}
    for command in COMMANDS:
        app.command(f"dermis.cli.{command}:{command}", name=command)
        arguments = app[command].assemble_argument_collection(parse_docstring=False)
        found[command] = tuple(
            Option(tuple(one.names), _bare(one.hint)) for one in arguments if one.names[0] != "*"
        )
    return found


def _bare(kind: Any) -> Any:
    """Return a type without None."""
    if get_origin(kind) in (Union, UnionType):
        some = [one for one in get_args(kind) if one is not type(None)]
        return some[0] if len(some) == 1 else Union[tuple(some)]  # noqa: UP007
    return kind
