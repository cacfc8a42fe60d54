"""Export to pbrt: meaning of the parameters, and scenes against pbrt's grammar."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loaded_mesh import load_mesh
from pbrt_grammar import Directive, read
from rigged_head import write_rigged_head

from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.targets.pbrt.target import TARGET
from dermis.base.errors import DermisWarning
from dermis.optics.tissue import load_tissue
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight, PointLight, RectangleLight, SphereLight, StripeLight
from dermis.scene.model import Scene

DIFFUSION = 0.01  # of an edge: photon beam diffusion against photons, homogeneous skin
PATHS = 0.04  # relative: the table is that near to photons


def one_of(found: list[Directive], word: str, name: str) -> Directive:
    return next(one for one in found if one.word == word and one.names[-1] == name)


@pytest.mark.parametrize("name", ["skin1", "skin2"])
def test_homogeneous_skin_nearly_keeps_its_medium(name: str) -> None:
    subject = load_subject(name)
    report = evaluate_export(subject, TARGET, "4")
    assert report.error.edge.max() < DIFFUSION < report.naive_error.edge.max()
    paths = next(row.value for row in report.parameters if row.name == "mfp")
    layer = load_tissue(name).medium.layers[0]
    np.testing.assert_allclose(paths, 1.0 / layer.sigma_t_prime, rtol=PATHS)


def test_skin_is_exported_on_a_ball(tmp_path: Path) -> None:
    report = export_skin("skin1", "pbrt", tmp_path / "ball.pbrt")
    found = read((tmp_path / "ball.pbrt").read_text())
    material = one_of(found, "Material", "subsurface").parameters
    assert (
        material["remaproughness"] == ["false"] and material["scale"] == ["1"] and material["eta"] == ["1.4"]
    )
    assert [float(one) for one in material["mfp"]] == pytest.approx(
        next(row.value for row in report.parameters if row.name == "mfp"), rel=1e-5
    )
    (shape,) = [one.parameters["filename"][0] for one in found if one.word == "Shape"]
    ball = load_mesh(tmp_path / shape, unit_mm=1.0)
    look = next(one.numbers for one in found if one.word == "LookAt")
    np.testing.assert_allclose(ball.positions.mean(axis=0), look[3:6], atol=1.0)
    assert ball.size_mm.max() == pytest.approx(100.0, rel=0.01)


def test_head_is_exported_with_lights_and_camera(tmp_path: Path) -> None:
    subject = load_subject(write_rigged_head(tmp_path / "face.glb"))
    assert subject.scene is not None
    lights = [
        PointLight(position=(0.0, 300.0, 900.0)),
        RectangleLight(position=(500.0, 0.0, 900.0)),
        SphereLight(position=(-500.0, 0.0, 900.0)),
        DirectionalLight(direction=(0.0, -1.0, 0.0), angle_degrees=0.5),
        StripeLight(direction=(0.0, 0.0, -1.0)),
    ]
    scene = Scene(subject.scene.head, lights=lights, environment=Environment(name="uniform"))
    lit = Subject(subject.name, subject.curve, subject.albedo, subject.model, subject.tissue, scene)
    with pytest.warns(DermisWarning, match="stripe"), pytest.warns(DermisWarning, match="light 4 are sharp"):
        export_skin(lit, "pbrt", tmp_path / "face.pbrt")
    found = read((tmp_path / "face.pbrt").read_text())
    point = one_of(found, "LightSource", "point").parameters
    assert float(point["I"][0]) == pytest.approx(3.14 * (300.0**2 + 900.0**2), rel=1e-5)
    assert one_of(found, "LightSource", "distant").parameters["to"] == ["0", "-1", "0"]
    assert [one.names[-1] for one in found if one.word == "LightSource"] == ["point", "distant", "infinite"]
    corners = np.array(one_of(found, "Shape", "bilinearmesh").parameters["P"], float).reshape(4, 3)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    assert normal @ (0.0 - corners.mean(axis=0)) > 0.0


def test_scene_contains_no_user_names(tmp_path: Path) -> None:
    name = 'a" Include "b'
    export_skin("skin1", "pbrt", tmp_path / f"{name}.pbrt")
    found = read((tmp_path / f"{name}.pbrt").read_text())
    files = [one.parameters["filename"][0] for one in found if "filename" in one.parameters]
    assert all(file.startswith("a_Include_b_") for file in files)
