"""Render contact sheets of people: expressions, sampled people in several rigs, and close-ups."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.base.command_line import run_script
from dermis.base.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.human.expressions import expression
from dermis.images.io import write_png
from dermis.mesh.head import Head
from dermis.scene import Camera, Scene, Settings
from dermis.scene.camera import camera_preset
from dermis.scene.people import skin_of
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

EXPRESSIONS = (
    *("neutral", "smile", "joy", "laugh", "surprise", "anger"),
    *("sadness", "disgust", "fear", "contempt", "pain", "sleep"),
)
RIGS = "studio", "window", "rembrandt", "beauty"
CLOSE_UPS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float], float]] = {
    "cheek": ((38, -25, 15), (250, 0, 500), 48),
    "nose": ((0, -28, 40), (180, 0, 500), 50),
    "lips": ((0, -62, 28), (120, 0, 500), 60),
    "eye": ((31, 0, 12), (60, 0, 500), 38),
    "ear": ((72, -15, -75), (500, 0, 120), 90),
}
"""Target and direction to the camera in head coordinates [mm], and height of the frame [mm]."""
Row = list[tuple[Head, dermis.Human, dict[str, object]]]


def expression_rows(people: Sequence[dermis.Human]) -> Iterator[Row]:
    """Yield a row for each person, with a picture for each expression."""
    for person in people:
        head = person.head()
        camera = camera_preset("headshot", head)
        yield [(head, person, {"camera": camera, "pose": expression(name)}) for name in EXPRESSIONS]


def rig_rows(people: Sequence[dermis.Human]) -> Iterator[Row]:
    """Yield a row for each group of four people, with a picture of each person in each rig."""
    for first in range(0, len(people), 4):
        group = [(person.head(), person) for person in people[first : first + 4]]
        yield [
            (head, person, {"camera": camera_preset("three-quarter", head), "lights": rig})
            for head, person in group
            for rig in RIGS
        ]


def close_up_rows(people: Sequence[dermis.Human]) -> Iterator[Row]:
    """Yield a row for each person, with a picture for each close-up."""
    for person in people:
        head = person.head()
        yield [(head, person, {"camera": close_up(head, name), "lights": "window"}) for name in CLOSE_UPS]


def close_up(head: Head, name: str) -> Camera:
    """Return the camera of a close-up."""
    target, offset, frame_mm = CLOSE_UPS[name]
    at = np.array(target) - np.array(head.centre_mm)
    return Camera(position=tuple(at + offset), target=tuple(at), frame_mm=frame_mm)


SHEETS: dict[str, Callable[[Sequence[dermis.Human]], Iterator[Row]]] = {
    "expressions": expression_rows,
    "rigs": rig_rows,
    "close-ups": close_up_rows,
}


def main(
    sheet: str, output: Path, *, people: int = 3, first_seed: int = 0, side: int = 160, adapter: str = "auto"
) -> None:
    """Render a contact sheet of sampled people.

    Parameters
    ----------
    sheet:
        "expressions": twelve expressions, a row for each person; "rigs": four rigs, four people in a row;
        "close-ups": cheek, nose, lips, eye and ear, a row for each person.
    output:
        PNG file to write.
    people:
        Number of people.
    first_seed:
        Seed of the first person; each further person has the next seed.
    side:
        Side of each picture [pixel].
    adapter:
        Adapter that renders the pictures.
    """
    if sheet not in SHEETS:
        refuse("sheet", f"one of {', '.join(SHEETS)}", f"got {sheet}", "Correct it")
    if people < 1:
        refuse("people", "at least 1", f"got {people}", "Raise it")
    sampled = [dermis.Human.sampled(first_seed + index) for index in range(people)]
    settings = Settings(size=(side, side), atlas=1024, shadow_size=1024, **PHOTOGRAPHIC_SETTINGS)
    renderer, rows = Renderer(adapter), list[NDArray[np.uint8]]()
    for row in SHEETS[sheet](sampled):
        scenes = (Scene(head, skin=skin_of(person), **options) for head, person, options in row)  # type: ignore[arg-type]
        pictures = [renderer.draw(scene, settings).srgb8() for scene in scenes]
        rows.append(np.concatenate(pictures, axis=1))
    width = max(row.shape[1] for row in rows)
    padded = [np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows]
    write_png(output, np.concatenate(padded))


if __name__ == "__main__":
    run_script(main)
