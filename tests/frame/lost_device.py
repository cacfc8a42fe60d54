"""Lose the device at each stage of a frame, in a separate process, as the library may end it.

python lost_device.py ADAPTER FOLDER prints a line per stage: "same" if the picture is identical, else the
error. FOLDER is for files.
"""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from moving_head import write_moving_head
from setups import settings_of

from dermis.cli import main
from dermis.frame import allocation
from dermis.frame import renderer as renderer_module
from dermis.frame.features.outputs import readback
from dermis.frame.features.surface.painting import paint
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import surface_points
from dermis.gpu import CommandList, Device
from dermis.human.person import Human
from dermis.images.io import read_image
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene import Scene

MANY = 5  # scenes, more than are in flight
SMALL = ("--size", "32x32", "--atlas", "64", "--samples", "1", "--shadow-size", "64")
DRAWN = settings_of(size=(48, 48), atlas=128, exposure="auto")
Stage = Callable[[Renderer], Any]


def scene(mix: float = 0.5) -> Scene:
    return Scene(Head("ball", uv_sphere(90.0, 24, 12), Maps()), skin={"mix": mix})


@contextmanager
def losing(target: Any, name: str, calls: int = 1) -> Iterator[None]:
    """Lose the device when a function is called for the given time, before it runs."""
    usual, left = getattr(target, name), [calls]

    def call(*given: Any, **named: Any) -> Any:
        left[0] -= 1
        if left[0] == 0:
            opened[-1].handle.destroy()
        return usual(*given, **named)

    with patch.object(target, name, call):
        yield
    assert left[0] <= 0, f"{name} was not called"


opened: list[Device] = []
_open_device = renderer_module.open_device


def open_noted(adapter: str) -> Device:
    opened.append(_open_device(adapter))
    return opened[-1]


def loading(renderer: Renderer) -> Any:
    renderer.clear_cache()
    with losing(allocation, "upload_maps"):
        return renderer.draw(scene(), DRAWN).linear()


def recording(renderer: Renderer) -> Any:
    with losing(CommandList, "run", 3):
        return renderer.draw(scene(), DRAWN, run_all_passes=True).linear()


def between_passes(renderer: Renderer) -> Any:
    with losing(CommandList, "_end_pass", 2):
        return renderer.draw(scene(), DRAWN, run_all_passes=True).linear()


def submitting(renderer: Renderer) -> Any:
    with losing(CommandList, "_flush"):
        return renderer.draw(scene(), DRAWN, run_all_passes=True, timed=False).linear()


def waiting(renderer: Renderer) -> Any:
    with losing(Device, "wait"):
        return renderer.draw(scene(), DRAWN, run_all_passes=True).linear()


def reading(renderer: Renderer) -> Any:
    """Read by each method, one after the other."""
    rendered = renderer.draw(scene(), DRAWN)
    ways = (lambda: rendered.exposure, rendered.clipped_fraction, rendered.srgb8)
    known = [read() for read in ways]
    for way, before in zip(ways, known, strict=True):
        opened[-1].handle.destroy()
        assert np.array_equal(way(), before)
    return rendered.linear()


def begun_to_read(renderer: Renderer) -> Any:
    """Lose the device while the copy is mapped or about to be."""
    rendered = renderer.draw(scene(), DRAWN)
    known = rendered.srgb8()
    with losing(readback.Readback, "image"):
        assert np.array_equal(rendered.srgb8(), known)
    return rendered.linear()


def painting(renderer: Renderer) -> Any:
    """Render a person, whose skin the device paints."""
    person, small = Scene(Human().head()), settings_of(size=(32, 32), atlas=256)
    with losing(paint, "paint_textures"):
        found = renderer.draw(person, small).linear()
    renderer.clear_cache()
    assert np.array_equal(renderer.draw(person, small).linear(), found)
    return renderer.draw(scene(), DRAWN).linear()


def many(renderer: Renderer) -> Any:
    """Lose the device with several frames in flight."""
    mixes, drawn = np.linspace(0.0, 1.0, MANY), DRAWN.model_dump()
    known = list(renderer.render_many(map(scene, mixes), **drawn))
    for target, name, calls in ((CommandList, "submit", 4), (readback.Readback, "image", 2)):
        with losing(target, name, calls):
            found = list(renderer.render_many(map(scene, mixes), **drawn))
        assert len(found) == MANY and all(map(np.array_equal, found, known))
    return renderer.draw(scene(), DRAWN).linear()


def beside_frames(renderer: Renderer) -> Any:
    """Use the renderer's device for other work, as comparisons do."""
    known = surface_points(renderer, scene(), DRAWN)
    with losing(CommandList, "submit"):
        found = surface_points(renderer, scene(), DRAWN)
    assert np.array_equal(found.triangle, known.triangle) and len(known.triangle)
    return renderer.draw(scene(), DRAWN).linear()


def observing(renderer: Renderer) -> Any:
    """Read outputs one by one, and with pictures in flight."""
    names, scenes = ("depth", "motion"), [scene(), scene(0.3), scene(0.6), scene(0.9)]
    rendered = renderer.draw(scenes[0], DRAWN, outputs=names)
    depth = rendered.output("depth")
    opened[-1].handle.destroy()
    assert depth.any() and np.array_equal(rendered.output("depth"), depth)
    known = list(renderer.observe(scenes, DRAWN, outputs=names))
    for target, name, calls in ((CommandList, "submit", 3), (readback.Readback, "image_and_outputs", 2)):
        with losing(target, name, calls):
            found = list(renderer.observe(scenes, DRAWN, outputs=names))
        assert len(found) == len(scenes)
        for one, same in zip(found, known, strict=True):
            assert np.array_equal(one.picture, same.picture)
            assert all(np.array_equal(one.outputs[name], same.outputs[name]) for name in names)
    return renderer.draw(scene(), DRAWN).linear()


STAGES: tuple[Stage, ...] = (
    loading,
    recording,
    between_passes,
    submitting,
    waiting,
    reading,
    begun_to_read,
    painting,
    many,
    observing,
    beside_frames,
)


def commands(folder: Path, adapter: str) -> Iterator[tuple[str, str]]:
    """Run the command line, which loses the device in the second frame of a movie, and then always."""
    os.chdir(folder)
    write_moving_head(Path("face.glb"))
    words = ["animate", "face.glb", *SMALL, "--adapter", adapter, "-o"]
    assert command(*words, "whole/%d.exr") == 0
    with losing(CommandList, "submit", 2):
        assert command(*words, "lost/%d.exr") == 0
    pictures = [(read_image(f"whole/{k}.exr"), read_image(f"lost/{k}.exr")) for k in range(4)]
    yield "animate", "same" if all(np.array_equal(*two) for two in pictures) else "other pictures"

    def open_lost(adapter: str) -> Device:
        device = open_noted(adapter)
        device.handle.destroy()
        return device

    with patch.object(renderer_module, "open_device", open_lost):
        for name, *rest in (("animate", "f/%d.exr"), ("render", "a.png")):
            yield f"{name} twice", str(command(name, "face.glb", *SMALL, "--adapter", adapter, "-o", *rest))


def command(*words: str) -> Any:
    with patch.object(sys, "argv", ["dermis", *words]):
        try:
            main()
        except SystemExit as ended:
            return ended.code


def outcomes(adapter: str, folder: Path) -> Iterator[tuple[str, str]]:
    renderer = Renderer(adapter)
    known = renderer.draw(scene(), DRAWN).linear()
    for stage in STAGES:
        try:
            yield stage.__name__, "same" if np.array_equal(stage(renderer), known) else "another picture"
        except Exception as error:
            yield stage.__name__, f"{type(error).__name__}: {error}"
    yield from commands(folder, adapter)


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    renderer_module.open_device = open_noted
    for stage, outcome in outcomes(sys.argv[1], Path(sys.argv[2])):
        sys.stdout.write(f"{stage}: {outcome}\n")
        sys.stdout.flush()
