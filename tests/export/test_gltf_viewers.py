"""Exported people in three.js, Babylon.js and model-viewer: the face has the colour of the rendered picture.

Each test runs if a variable names npm's folder node_modules with the viewer: DERMIS_THREE, DERMIS_BABYLON,
DERMIS_MODEL_VIEWER.
"""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path

import colour
import numpy as np
import pytest
from chromium_input import CHROMIUM
from gltf_viewers import VIEWER_VARIABLES, viewer_picture

from dermis import Camera, Environment, Human, Renderer, Scene, Settings, load_head
from dermis.apps.export.run import export_skin
from dermis.apps.export.targets.pages.engine_page import page_camera_json
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.person_file import write_person_json
from dermis.scene.lights import DirectionalLight
from dermis.scene.people import skin_of

PERSON = replace(Human.sampled(7), hair=HairLook("cropped"))
SIDE = 256
DIRECTION = (-0.35, -0.35, -0.87)
CAMERA = Camera(position=(180.0, 30.0, 1100.0), frame_mm=310.0)
LARGEST_DELTA_E = 6.0

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("person")
    write_person_json(made / "person.json", PERSON)
    export_skin(made / "person.json", "gltf", made / "person.glb", side=512)
    return made


def mean_lab(picture: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return CIE L*a*b* of the mean linear colour of some pixels of an sRGB picture."""
    mean = colour.cctf_decoding(picture)[mask].mean(axis=0)
    return np.asarray(colour.XYZ_to_Lab(colour.RGB_to_XYZ(mean, "sRGB")))


@pytest.mark.parametrize("viewer", ["three", "babylon", "model-viewer"])
def test_the_face_has_the_colour_of_the_rendered_picture(viewer: str, folder: Path) -> None:
    node_modules = os.environ.get(VIEWER_VARIABLES[viewer])
    if node_modules is None:
        pytest.skip(f"{VIEWER_VARIABLES[viewer]} does not name the folder node_modules with the viewer")
    head = load_head(folder / "person.json")
    lit = {"lights": [DirectionalLight(direction=DIRECTION, irradiance=(math.pi,) * 3)], "environment": None}
    if viewer == "model-viewer":
        lit = {"lights": [], "environment": Environment("uniform")}
    scene = Scene(head, camera=CAMERA, skin=skin_of(PERSON), **lit)
    settings = Settings(size=SIDE, background=(0.0, 0.0, 0.0))
    (seen,) = Renderer("cpu").observe([scene], settings, outputs=("label",))
    face = np.isin(seen.outputs["label"], [class_number("skin"), class_number("nose")])
    assert face.mean() > 0.1
    light = {"direction": DIRECTION, "irradiance": math.pi}
    drawn = viewer_picture(
        viewer,
        folder / "person.glb",
        Path(node_modules),
        page_camera_json(scene, head.centre_mm),
        light,
        side=SIDE,
    )
    ours = seen.picture[..., :3] / 255.0
    found = colour.delta_E(mean_lab(ours, face), mean_lab(drawn, face), method="CIE 1976")
    print(f"{viewer}: Delta E {found:.2f}")
    assert found < LARGEST_DELTA_E
