"""Make src/dermis/human/landmarks/*.csv: positions of landmarks on the quads of the parametric human."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from human_landmark_candidates import Surface
from human_landmark_sets import face_synthetics, ibug, mediapipe, silhouette

from dermis.base.command_line import run_script

OUT = Path(__file__).parent.parent / "src" / "dermis" / "human" / "landmarks"
SOURCE = "tools/human_landmarks.py, by geometry and by eye on the average human{model}"
MODEL = ", and by proportions of MediaPipe's canonical face model (Apache-2.0)"
HEADER = """\
# quantity: {what}; left is the person's own
# unit: number of the human's quad, how far along its first side and across it (0 to 1), how far from there
#   on the way to the back of the eyeball (0 to 1)
# source: {source}
# licence: CC0
landmark,quad,along,across,sunk
"""
SETS: dict[str, tuple[Callable[[Surface], list[tuple[str, tuple[int, float]]]], str]] = {
    "ibug-68": (
        lambda surface: list(ibug(surface).items()),
        "the 68 landmarks of iBUG's 300-W in their order, on the surface and at rest in it",
    ),
    "ibug-68-silhouette": (
        silhouette,
        "those of ibug-68, with candidates for the visible contour in rows of the same name",
    ),
    "face-synthetics-70": (
        lambda surface: list(face_synthetics(surface).items()),
        "the 70 landmarks of FaceSynthetics in their order: those of iBUG, then the right and the left pupil",
    ),
    "mediapipe": (
        lambda surface: list(mediapipe(surface).items()),
        "points of MediaPipe's face mesh by their numbers there: outlines and the midline",
    ),
}


def main() -> None:
    """Compute the landmarks and write the tables."""
    surface = Surface()
    for name, (made, what) in SETS.items():
        rows = [row(surface, landmark, anchor) for landmark, anchor in made(surface)]
        path = OUT / f"{name}.csv"
        header = HEADER.format(what=what, source=SOURCE.format(model=MODEL))
        path.write_text(header + "".join(rows), encoding="utf-8")
        sys.stdout.write(f"{path}  {len(rows)} points\n")


def row(surface: Surface, landmark: str, anchor: tuple[int, float]) -> str:
    """Return a row of the table.

    anchor : index of a candidate and its depth below the surface
    """
    candidate, sunk = anchor
    along, across = surface.position[candidate]
    return f"{landmark},{surface.quad[candidate]},{along:g},{across:g},{sunk:.3g}\n"


if __name__ == "__main__":
    run_script(main)
