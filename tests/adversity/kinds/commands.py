"""Complete commands: options of all of them, and rendering of damaged files."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any, NoReturn
from unittest.mock import patch

from adversity.case import WRONG, FoundError, Input, Plan
from adversity.checks import check_picture
from adversity.damage import damaged
from adversity.kind import Kind
from adversity.kinds import clips, meshes, pictures, scenes
from adversity.options import options_of_commands
from moving_head import CAPTURE

from dermis.base.errors import DermisError

_SMALL = ("--size", "64x64", "--atlas", "64", "--samples", "1", "--shadow-size", "64", "--adapter", "cpu")
_MOVING = ("head.glb", *_SMALL, "--to", "0.1", "--output", "frames/%03d.exr")
_BEGINNINGS: dict[str, tuple[str, ...]] = {
    "render": ("head.obj", *_SMALL, "--output", "out.exr"),
    "animate": (*_MOVING, "--motion", "take.csv"),
    "view": ("head.obj", *_SMALL),
    "profile": ("profile.csv",),
    "head": ("--output", "person.json"),
    "lights": (),
    "compare": ("head.obj", "--techniques", "none", *_SMALL[:4], "--adapter", "cpu"),
    "gallery": ("--only", "01_portrait", "--size", "32", "--adapter", "cpu", "--output", "gallery"),
    "bench": ("--head", "head.obj", "--preset", "cpu", "--adapter", "cpu"),
    "doctor": ("--adapter", "cpu"),
    "cite": (),
}
_DRAWN = {"render": 6, "animate": 2}  # how much oftener than others
_LONG_WORK = (
    *(
        "dermis.apps.viewer.windows.serve",
        "dermis.apps.viewer.windows.show_window",
        "dermis.apps.validation.benchmarks.run.run_benchmark",
    ),
    *("dermis.apps.gallery.script.draw_pictures", "dermis.apps.validation.comparisons.compare.compare"),
)
_OUTPUTS = ["out.", "frames", "gallery", "person.json"]
_KEPT = ["frames/"]  # numbered pictures, each of which is whole
_PICTURES = (".png", ".exr")
_WANTED = 2  # the exit status of a refusal


class _BegunError(BaseException):
    """Exception raised when a command starts its long work."""


def _sound_options(rng: Random) -> Input:
    command = rng.choice([name for name in _BEGINNINGS for _ in range(_DRAWN.get(name, 1))])
    files = {**scenes.files_of_scenes(), "scene.toml": scenes.scene_files()[0], "take.csv": CAPTURE.encode()}
    plan = {
        "command": [command, *_BEGINNINGS[command]],
        "error_subjects": [],
        "outputs": _OUTPUTS,
        "kept": _KEPT,
    }
    return Input(files, plan)


def _with_options(sound: Input, rng: Random) -> Input:
    """Return the arguments with one to four options added or replaced."""
    command, *words = sound.plan["command"]
    for _ in range(rng.choice((1, 1, 2, 3, 4))):
        option = rng.choice(options_of_commands()[command])
        given = [k for k, word in enumerate(words) if word in option.names]
        if option.positional and words and not words[0].startswith("-"):
            del words[0]
        for k in given[::-1]:
            del words[k : k + 2]
        words = [*option.words(rng), *words] if option.positional else [*words, *option.words(rng)]
    named = [word for before, word in pairwise(words) if before in ("-o", "--output", "--plot")]
    return replace(sound, plan=sound.plan | {"command": [command, *words], "outputs": _OUTPUTS + named})


def _sound_drawn(rng: Random) -> Input:
    """Return a head of which one file will be damaged."""
    kinds = [one for part in (meshes, pictures, scenes, clips) for one in part.KINDS]
    found = rng.choice(kinds).sound(rng)
    while "words" not in found.plan or found.plan["file"] == "person.json":  # a human takes longer
        found = rng.choice(kinds).sound(rng)
    words, moves = found.plan["words"], "--motion" in found.plan["words"]
    command = ["animate", *words, *_MOVING[1:]] if moves else ["render", *words, *_BEGINNINGS["render"][1:]]
    files = {"head.obj": meshes.head_files()["head.obj"], **found.files}
    plan = {"command": command, "outputs": _OUTPUTS, "kept": _KEPT, "error_subjects": list(files)}
    return Input(files, plan, found.changed or tuple(found.files))


def _take(plan: Plan) -> None:
    """Run a command up to its long work, and check its pictures."""
    from dermis.cli import main

    with contextlib.ExitStack() as stack:
        for name in _LONG_WORK:
            stack.enter_context(patch(name, _begin))
        stack.enter_context(patch.object(sys, "argv", ["dermis", *plan["command"]]))
        try:
            main()
        except _BegunError:
            return
        except SystemExit as ended:
            _judge(ended.code)


def _begin(*_: Any, **__: Any) -> NoReturn:
    raise _BegunError


def _judge(code: Any) -> None:
    """Check exit status, output and written files."""
    sys.stderr.flush()
    printed = Path(".printed").read_text("utf-8", "replace")
    if code == _WANTED and "dermis: " in printed:  # doctor tells of a machine that cannot draw in its report
        raise DermisError(printed.rpartition("dermis: ")[2].rstrip("\n"))
    if code not in (0, None, _WANTED):
        raise FoundError(WRONG, f"the command ended with {code}")
    for path in sorted(Path().rglob("*")):
        if path.suffix in _PICTURES and any(str(path).startswith(one) for one in _OUTPUTS):
            check_picture(path)


KINDS = (
    Kind("options", _sound_options, _take, _with_options, share=12, cpu_s=40.0, opens_device=True),
    Kind("drawn", _sound_drawn, _take, damaged, share=6, cpu_s=40.0, opens_device=True),
)
