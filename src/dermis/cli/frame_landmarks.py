"""Landmarks of a frame on the command line: which sets are asked, and the file that they go into."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from dermis.human.landmarks.sets import SETS

_HELP = (
    "Landmarks to write beside the image, as face.landmarks.json, with camera, head pose and gaze: "
    f"{', '.join(SETS)}, or a .csv of name,vertex; several with commas between."
)
Landmarks = Annotated[str | None, Parameter(name="--landmarks", help=_HELP, metavar="SET,...")]


class FrameLandmarks:
    """Landmarks that were asked for on the command line.

    Raises DermisError for unknown sets and for a file that cannot be written.
    """

    def __init__(self, typed: str | None, image: Path) -> None:
        self.names: tuple[str, ...] = ()
        self.path = image.with_name(f"{image.stem}.landmarks.json")
        if typed is not None:
            from dermis.base.atomic_write import check_output
            from dermis.frame.features.outputs.landmarks import checked_landmarks

            self.names = checked_landmarks([name.strip() for name in typed.split(",")])
            check_output(self.path, (self.path.suffix,))

    def check(self, head: Any) -> None:
        """Raises DermisError for a head that has no landmarks of these names."""
        if self.names:
            from dermis.human.landmarks.points import landmark_points

            for name in self.names:
                landmark_points(head, name)

    def write(self, renderer: Any, scene: Any, settings: Any) -> None:
        """Write them, if any are asked."""
        if not self.names:
            return
        from dermis.base.atomic_write import replacing

        seen = next(renderer.observe([scene], settings, landmarks=self.names))
        text = json.dumps(_told(seen), indent=1) + "\n"
        with replacing(self.path) as part:
            part.write_text(text, "utf-8")


def _told(seen: Any) -> dict[str, Any]:
    camera = seen.camera
    return {
        "camera": {"K": camera.K.tolist(), "R": camera.R.tolist(), "t_mm": camera.t.tolist()},
        "head_pose": seen.head_pose.tolist(),
        "gaze": None if seen.gaze is None else seen.gaze.tolist(),
        "landmarks": {name: _rows(one) for name, one in seen.landmarks.items()},
    }


def _rows(one: Any) -> list[dict[str, Any]]:
    each = zip(one.names, one.pixels.tolist(), one.positions_mm.tolist(), one.visible.tolist(), strict=True)
    return [
        {"name": name, "pixel": pixel, "position_mm": place, "visible": visible}
        for name, pixel, place, visible in each
    ]
