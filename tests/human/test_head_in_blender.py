"""Blender moves the file of a person as the package does; runs if DERMIS_BLENDER_PYTHON is set."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis import Human, Pose, load_head
from dermis.apps.truths.cycles import PYTHON_VARIABLE
from dermis.frame.features.surface.painting.painted_head import paint_head
from dermis.gpu import open_device
from dermis.human.person_file import write_person_glb
from dermis.images.io import read_image
from dermis.mesh.head import Head

SCRIPT = Path(__file__).with_name("opened_in_blender.py")
PERSON = Human.sampled(7)
MOVES = {
    "rest": Pose(),
    "moved": Pose({"mouthSmileLeft": 1.0}),
    "turned": Pose(bones={"head": (0, 25, 0)}),
}
"""As the script makes them."""
SAME_MM = 0.02  # as for this package's own reading

pytestmark = pytest.mark.skipif(not os.environ.get(PYTHON_VARIABLE), reason=f"{PYTHON_VARIABLE} is not set")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder with the file and Blender's results."""
    made = tmp_path_factory.mktemp("blender")
    device = open_device(os.environ.get("DERMIS_TEST_ADAPTER", "cpu"))
    painted, eyes = paint_head(device, PERSON.head(), 512)
    write_person_glb(made / "person.glb", PERSON, painted, roughness=0.3, eyes=eyes)
    command = [os.environ[PYTHON_VARIABLE], str(SCRIPT), str(made / "person.glb"), str(made)]
    apart = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, env=apart)
    assert run.returncode == 0, run.stderr[-2000:]
    return made


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "told.json").read_text())
    return found


@pytest.fixture(scope="module")
def head(folder: Path) -> Head:
    return load_head(folder / "person.glb", eyes="plain")


def test_names_are_those_of_the_head(told: dict[str, Any], head: Head) -> None:
    assert told["keys"] == ["Basis", *head.targets]
    assert set(told["bones"]) == set(head.bones)
    hairs = ["brows and lashes", "hair"]
    assert told["materials"] == [*(one.name for one in head.mesh.materials), *hairs]
    assert len(told["uv"]) == 1


@pytest.mark.parametrize("move", MOVES)
def test_vertices_move_as_a_pose_says(folder: Path, head: Head, move: str) -> None:
    """Compare vertices; in Blender Z is up and -Y is the front."""
    pose_arrays = MOVES[move].to_arrays(head.control_rig)
    meant = head.control_rig.posed_points_mm(pose_arrays)[head.mesh.point]
    with np.load(folder / "places.npz") as found:
        x, y, z = 1e3 * found[move][: len(meant)].T  # hairs come last
    assert np.abs(np.column_stack([x, z, -y]) - meant).max() < SAME_MM


def test_the_picture_shows_skin(folder: Path) -> None:
    picture = read_image(folder / "picture.png")
    forehead = picture[24:29, 32:39]
    assert picture.shape == (64, 64, 4) and (picture[:4, :4, 3] == 0).all()
    assert (forehead[..., 3] > 250).all()
    red, green, blue = (float(forehead[..., k].mean()) for k in range(3))
    assert red > green + 10 and green > blue + 5 and red > 90


def test_an_eye_shows_a_pupil_an_iris_and_the_white(folder: Path) -> None:
    """Check a brown eye in a view along its axis."""
    picture = read_image(folder / "eye.png")[..., :3].astype(float)
    pupil, iris, white = (
        picture[30:36, those].mean(axis=(0, 1)) for those in (slice(29, 35), slice(39, 42), slice(46, 51))
    )
    assert pupil.mean() < 0.75 * iris.mean() and iris.mean() < 0.5 * white.mean(), (pupil, iris, white)
    assert iris[0] > 1.1 * iris[2]
