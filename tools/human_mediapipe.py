"""Make mediapipe-468.csv: all points of MediaPipe's face mesh on the quads of the parametric human.

    python tools/human_mediapipe.py canonical_face_model.obj

The file is in mediapipe/modules/face_geometry/data of MediaPipe's repository. The points of the set
"mediapipe" are kept. A thin-plate spline through them places the other points of the model, which are then
moved to the nearest position on the skin.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from human_landmark_candidates import Surface
from human_landmark_sets import mediapipe
from human_landmarks import HEADER, MODEL, OUT, SOURCE, row
from scipy.interpolate import RBFInterpolator

from dermis.base.command_line import run_script

POINT_COUNT = 468
_SMOOTHING = 1e-6


def main(model_path: Path, /) -> None:
    """Compute the landmarks and write the table.

    Parameters
    ----------
    model_path:
        MediaPipe's canonical_face_model.obj.
    """
    lines = model_path.read_text("utf-8").splitlines()
    model = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], np.float64)[:POINT_COUNT]
    surface = Surface()
    known = {int(name): anchor for name, anchor in mediapipe(surface).items() if int(name) < POINT_COUNT}
    at_mm = surface.at_mm[[candidate for candidate, _ in known.values()]]
    spline = RBFInterpolator(model[list(known)], at_mm, smoothing=_SMOOTHING, kernel="thin_plate_spline")
    wanted = spline(model)
    rows = [
        row(surface, str(point), known.get(point) or (surface.nearest(wanted[point]), 0.0))
        for point in range(POINT_COUNT)
    ]
    path = OUT / "mediapipe-468.csv"
    what = "all 468 points of MediaPipe's face mesh by their numbers there"
    source = SOURCE.format(model=MODEL).replace("human_landmarks", "human_mediapipe")
    path.write_text(HEADER.format(what=what, source=source) + "".join(rows), encoding="utf-8")
    off = [np.linalg.norm(surface.at_mm[surface.nearest(one)] - one) for one in wanted]
    sys.stdout.write(f"{path}  {len(rows)} points, moved {np.mean(off):.2f} (at most {np.max(off):.2f}) mm\n")


if __name__ == "__main__":
    run_script(main)
