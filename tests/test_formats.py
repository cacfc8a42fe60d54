"""Every example on the page about files is valid, and every key of a light is described there."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import dermis
from dermis.apps.batch.rigs.calibration import load_calibrations
from dermis.human.person_file import read_person
from dermis.human.regions.average import average_head
from dermis.human.regions.labels import average_landmarks, load_landmarks, warp_to_average
from dermis.human.regions.region_table import load_region_table
from dermis.optics.lamps import lamp_power, read_sensitivities
from dermis.optics.profiles import find_gaussians
from dermis.optics.tissue import load_tissue
from dermis.scene.lights import LIGHTS

PAGE = (Path(__file__).parents[1] / "docs" / "formats.md").read_text("utf-8")
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with all files of the page, under the names in their first lines."""
    for kind, text in FENCE.findall(PAGE):
        name = "person.json" if kind == "json" else text.splitlines()[0].removeprefix("# ")
        (tmp_path / name).write_text(text, encoding="utf-8")
    assert len(list(tmp_path.iterdir())) == len(FENCE.findall(PAGE)) == 9
    return tmp_path


def test_scene_example_loads(folder: Path) -> None:
    scene, settings = dermis.load_scene(folder / "scene.toml")
    assert scene.lights == dermis.load_lights("window") and settings.atlas == 256
    assert scene.camera.frame_mm == 320 and scene.skin.profile == "medium"
    assert isinstance(scene.pose, dermis.Pose) and scene.pose.weights["mouthSmileLeft"] == 0.6


def test_lights_example_has_each_type(folder: Path) -> None:
    lights = dermis.load_lights(folder / "lights.toml")
    assert {light.kind for light in lights} == set(LIGHTS)


def test_every_key_of_a_light_is_explained() -> None:
    section = PAGE.partition("## Lights")[2].partition("```")[0]
    rows = [row.split("|") for row in section.splitlines() if row.startswith("| `")]
    told = {key for row in rows for key in re.findall(r"`(\w+)`", row[1])}
    for kind in LIGHTS.values():
        assert set(kind.model_fields) <= told


def test_region_table_and_landmarks_example_loads(folder: Path) -> None:
    table = load_region_table(folder / "regions.toml")
    assert table.landmarks == folder / "landmarks.csv"
    places, head = load_landmarks(folder / "landmarks.csv"), average_head()
    points = np.array(list(places.values())) + head.centre_mm
    found = warp_to_average(head, places, points)
    expected = [average_landmarks()[name] for name in places]
    np.testing.assert_allclose(found, expected, atol=0.2)
    section = " ".join(PAGE.partition("## Landmarks")[2].split())
    assert all(name.removeprefix("left ").removeprefix("right ") in section for name in average_landmarks())


def test_tissue_and_profile_examples_load(folder: Path) -> None:
    medium = load_tissue(str(folder / "tissue.toml")).medium
    assert medium.name == "thin over thick" and len(medium.layers) == 2 and medium.is_semi_infinite
    table = find_gaussians(folder / "profile.csv")
    published = find_gaussians("gpu-gems-3")
    assert table is not None and published is not None
    np.testing.assert_allclose(table.weight, published.weight)


def test_lamp_and_sensitivities_examples_load(folder: Path) -> None:
    lamp = folder / "lamp.csv"
    assert lamp_power(lamp, np.array([450.0, 560.0])) @ [10.0, -9.0] == pytest.approx(0.0)  # 0.9 to 1
    grid, response = read_sensitivities(folder / "sensitivities.csv", lamp)
    assert (grid[0], grid[-1]) == (400.0, 700.0)
    assert grid[response.argmax(axis=1)].tolist() == [600.0, 530.0, 460.0]


def test_other_names_of_keys_of_calibrations_are_read(tmp_path: Path) -> None:
    section = PAGE.partition("## Calibrations of cameras")[2].partition("## ")[0]
    rows = [[re.findall(r"`(\w+)`", cell) for cell in row.split("|")] for row in section.splitlines()]
    others = {row[1][0]: row[3] for row in rows if len(row) == 5 and row[1]}
    assert others.keys() == {"K", "size", "dist", "R", "t", "name"}
    camera = {"K": [[90, 0, 31], [0, 90, 31], [0, 0, 1]], "size": [64, 60], "dist": [0.1]}
    camera |= {"R": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], "t": [1, 2, 900], "name": "a"}
    second, file = camera | {"name": "b"}, tmp_path / "rig.json"
    for key, names in others.items():
        for name in names:
            renamed = {name if one == key else one: value for one, value in camera.items()}
            file.write_text(json.dumps({"cameras": [renamed, second]}))
            one, two = load_calibrations(file)
            assert one.name == "a" and one.lens == two.lens and one.size == two.size, name
            assert (one.K == two.K).all() and (one.R == two.R).all() and (one.t == two.t).all(), name


def test_person_example_loads(folder: Path) -> None:
    assert read_person(folder / "person.json").age == 62
    assert json.loads((folder / "person.json").read_text())["person"]["sex"] == 1
