"""Preview of a data set: table of parameters and contact sheet."""

from __future__ import annotations

import os
import tomllib
from typing import Any

import numpy as np
import pytest

from dermis.apps.batch.preview import dry_run, parameter_rows, parameter_table_lines
from dermis.apps.batch.spec import parse_spec

ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")
SPEC = """
count = 3
images_per_person = 3
size = [400, 200]
[render]
atlas = 128
shadow_size = 64
samples = 1
strands = false
[camera]
yaw_deg = {choice = [-40, 40]}
distance_mm = {uniform = [500, 900]}
[gaze]
at = {choice = ["camera", "angles"]}
"""


def test_rows_tell_what_is_drawn_and_what_comes_of_it() -> None:
    rows = {row["parameter"]: row for row in parameter_rows(parse_spec(tomllib.loads(SPEC) | {"count": 400}))}
    assert set(rows) == {"camera.yaw_deg", "camera.distance_mm", "gaze.at"}
    distance, gaze = rows["camera.distance_mm"], rows["gaze.at"]
    assert distance["drawn"] == "{uniform = [500.0, 900.0]}" and distance["images"] == 400
    assert 500 < distance["min"] < 510 and 890 < distance["max"] < 900
    assert distance["mean"] == pytest.approx(700, abs=20) and len(distance["first"]) == 16
    assert sum(gaze["counts"].values()) == 400 and set(gaze["counts"]) == {"camera", "angles"}
    lines = parameter_table_lines(list(rows.values()))
    assert len(lines) == 4 and lines[0].split() == [
        "parameter",
        "distribution",
        "images",
        "min",
        "mean",
        "max",
    ]
    assert f"camera {gaze['counts']['camera']}" in lines[
        -1
    ] or f"camera {gaze['counts']['camera']}" in "".join(lines)


def test_the_contact_sheet_shows_the_first_images_small() -> None:
    rows, sheet, estimate = dry_run(parse_spec(tomllib.loads(SPEC)), ADAPTER)
    assert (estimate["images"], estimate["measured"]) == (3, 3)
    assert 1e4 < estimate["bytes"] < 1e6 and 0 < estimate["hours"] < 1
    assert rows and sheet.dtype == np.uint8 and sheet.shape == (96, 3 * 192 + 2 * 4, 3)
    pictures: list[Any] = [sheet[:, k * 196 : k * 196 + 192] for k in range(3)]
    for picture in pictures:
        middle = picture[30:70, 76:116].astype(float)  # a face, neither black nor blown out
        assert 30 < middle.mean() < 220 and middle[..., 0].mean() > 1.05 * middle[..., 2].mean()
    assert (pictures[0] != pictures[1]).any()
