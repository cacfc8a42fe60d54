"""Blender export: formulas against published and simulated values, and the written script."""

from __future__ import annotations

import ast
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from small_head import write_head

from dermis import Human
from dermis.apps.export.fitting import fit_burley_width, profile_error
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.blender.files import blender_script_text, describe_scene
from dermis.apps.export.targets.blender.target import (
    TARGET,
    burley_cdf,
    burley_shape_factor,
    hulst_albedo,
    legacy_albedo,
    random_walk_cdf,
    skin_mfp_per_radius,
)
from dermis.apps.truths.half_space import diffuse_albedo, directional_albedo
from dermis.base.errors import DermisError
from dermis.formats.gltf.document import read_document
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.media import published_media
from dermis.scene import Camera, Scene
from dermis.scene.lights import PointLight

RADIUS = "Subsurface Radius"
HOSTILE = "x'; import os; os.system('true') #\n\"\"\"'''"


@pytest.fixture(scope="module")
def skin1() -> Subject:
    return load_subject("skin1")


def test_random_walk_albedo_matches_the_half_space() -> None:
    for alpha in (0.2, 0.41, 0.7, 0.9, 0.98):
        total = float(random_walk_cdf(np.array([1e6]), alpha, "straight")[0])
        assert total == pytest.approx(float(directional_albedo(1.0, alpha)), abs=2e-3)
    below = float(random_walk_cdf(np.array([1e6]), 0.1, "straight")[0])
    assert below == pytest.approx(0.5 * float(random_walk_cdf(np.array([1e6]), 0.2, "straight")[0]))


@pytest.mark.parametrize(("formula", "tolerance"), [(hulst_albedo, 0.003), (legacy_albedo, 0.03)])
def test_random_walk_albedo_reproduces_the_colour(formula: Any, tolerance: float) -> None:
    for colour in (0.1, 0.3, 0.5, 0.8):
        assert diffuse_albedo(float(formula(colour))) == pytest.approx(colour, abs=tolerance)


def test_published_diffuse_mean_free_paths_equal_the_skin_walk_radius() -> None:
    """[Jensen2001] tabulates the diffuse path of skin1; its coefficients give the mean free path."""
    (layer,) = published_media()["skin1"].layers
    path = np.array([3.67, 1.37, 0.68]) * skin_mfp_per_radius(np.array([0.44, 0.22, 0.13]), 1.3)
    assert path == pytest.approx(layer.mean_free_path_mm, rel=0.06)


def test_burley_is_cut_at_16_lengths_and_stretched_in_eevee() -> None:
    assert burley_cdf([0.0, 16.0, 40.0]) == pytest.approx([0.0, 1.0, 1.0])
    assert burley_cdf([1.0])[0] == pytest.approx(
        (1 - 0.25 / np.e - 0.75 * np.exp(-1 / 3)) / 0.99638, rel=1e-4
    )
    assert burley_shape_factor([0.8, 0.8, 0.24]) == pytest.approx([1.04, 1.04, 2.475])


def test_radii_depend_on_the_subsurface_method(skin1: Subject) -> None:
    d = fit_burley_width(skin1.curve)

    def radius(variant: str, version: str) -> np.ndarray[Any, Any]:
        return np.array(get_numbers(TARGET.with_variant(variant).parameters(skin1, version), RADIUS))

    assert radius("burley", "5.2") == pytest.approx(4 * np.pi * d, rel=0.03)
    assert radius("eevee", "5.2") / radius("burley", "5.2") == pytest.approx(
        burley_shape_factor(skin1.albedo), rel=1e-3
    )
    assert radius("random-walk", "5.1") / radius("random-walk", "5.2") == pytest.approx(4 * np.pi, rel=0.02)
    assert (radius("random-walk", "4.5") == radius("random-walk", "5.1")).all()
    assert (radius("random-walk-skin", "4.5") == radius("random-walk-skin", "5.2")).all()


@pytest.mark.parametrize("variant", TARGET.variants)
def test_fitted_parameters_beat_typed_values(skin1: Subject, variant: str) -> None:
    target = TARGET.with_variant(variant)
    errors = [
        profile_error(skin1.curve, target.predicted_profile(rows(skin1, "5.2"), skin1, "5.2"))
        for rows in (target.parameters, target.naive_parameters)
    ]
    assert errors[0].edge.max() < 0.016 < errors[1].edge.max()
    assert errors[0].cdf.max() < 0.04 < errors[1].cdf.max()


def test_unknown_versions_and_methods_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"a supported version of Blender: 4\.5, 5\.0, 5\.1, 5\.2"):
        export_skin("skin1", "blender", tmp_path / "a", version="2.79")
    with pytest.raises(DermisError, match="random-walk-skin, random-walk, burley, eevee"):
        export_skin("skin1", "blender", tmp_path / "a", variant="gaussian")
    assert not list(tmp_path.iterdir())


def export_in(text: str) -> dict[str, Any]:
    (export,) = (node for node in ast.parse(text).body if isinstance(node, ast.AnnAssign))
    assert export.value is not None
    found: dict[str, Any] = ast.literal_eval(export.value)
    return found


def test_ball_script_contains_no_local_paths(tmp_path: Path) -> None:
    report = export_skin("skin1", "blender", tmp_path / "skin", version="5.2", variant="random-walk")
    assert {file.name for file in (tmp_path / "skin").iterdir()} == {"skin.py", "README.md", "export.json"}
    text = (tmp_path / "skin" / "skin.py").read_text("utf-8")
    compile(text, "skin.py", "exec")
    assert str(Path.home()) not in text and str(tmp_path) not in text and "import dermis" not in text
    export = export_in(text)
    assert export["inputs"][RADIUS] == list(get_numbers(report.parameters, RADIUS))
    assert (export["method"], export["versions"], export["head"]) == ("RANDOM_WALK", [[5, 2], None], None)


def test_head_file_is_written_next_to_the_script(tmp_path: Path) -> None:
    head = write_head(tmp_path / "a'\"; head.obj")
    export_skin(head, "blender", tmp_path / "made.py", variant="burley", profile="skin1")
    text = (tmp_path / "made.py").read_text("utf-8")
    export = export_in(text)
    assert (export["head"], export["skin_materials"], export["name"]) == (
        "made.glb",
        ["skin"],
        "a'\"; head.obj",
    )
    assert (tmp_path / "made.glb").read_bytes()[:4] == b"glTF"
    assert export["versions"] == [[4, 5], None] and str(tmp_path) not in text


def test_names_are_quoted_as_strings_in_the_script() -> None:
    usual, hostile = (
        blender_script_text({"name": name, "lights": [1.5, None]}) for name in ("head", HOSTILE)
    )
    assert export_in(hostile) == {"name": HOSTILE, "lights": [1.5, None]}
    trees = [ast.parse(text) for text in (usual, hostile)]
    for tree in trees:
        tree.body = [node for node in tree.body if not isinstance(node, ast.AnnAssign)]
    assert ast.dump(trees[0]) == ast.dump(trees[1])


def test_script_refuses_blender_versions_with_other_radius_meaning(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, parts in {
        "bpy": {"app": SimpleNamespace(version=(5, 2, 3))},
        "mathutils": {"Matrix": None},
    }.items():
        stub = ModuleType(name)
        vars(stub).update(parts)
        monkeypatch.setitem(sys.modules, name, stub)
    for versions, refused in (([[4, 5], [5, 2]], True), ([[5, 2], None], False), ([[6, 0], None], True)):
        found: dict[str, Any] = {"__name__": "script"}
        exec(compile(blender_script_text({"versions": versions}), "script", "exec"), found)
        if refused:
            with pytest.raises(SystemExit, match=r"but 5\.2 runs it\. Export it again with --version 5\.2"):
                found["check_version"]()
        else:
            found["check_version"]()


def test_scene_stands_upright_in_metres() -> None:
    head = Head("ball", uv_sphere(100.0, 16, 8), Maps())
    lamp = PointLight(position=(0, 300, 400), target=(0, 0, 0), irradiance=(2, 1, 1))
    scene = Scene(head, lights=[lamp], camera=Camera(position=(100, 0, 1000), target=(100, 0, 0)))
    export, panorama = describe_scene(scene, (0.0, 10.0, 0.0))
    light, camera = np.array(export["lights"][0]["to_world"]), np.array(export["camera"]["to_world"])
    assert light[:3, 3] == pytest.approx([0.0, -0.4, 0.31])
    assert camera[:3, 3] == pytest.approx([0.1, -1.0, 0.01])
    assert -camera[:3, 2] == pytest.approx([0.0, 1.0, 0.0]) and camera[:3, 1] == pytest.approx(
        [0.0, 0.0, 1.0]
    )
    # Blender's irradiance is P / 4 pi^2 d^2 times pi: a lamp's power is spread over a sphere
    assert export["lights"][0]["set"]["energy"] / (4 * np.pi * 0.5**2) == pytest.approx(2.0)
    assert panorama is None


def test_scalp_hair_is_written_as_curves_of_a_bone(tmp_path: Path) -> None:
    subject = load_subject("human:7", subdivide=0)
    assert subject.scene is not None
    head = replace(Human.sampled(7).head(subdivide=0, hairs=0.05), maps=Maps(colour=np.full((8, 8, 3), 0.3)))
    target = TARGET.with_variant(None)
    rows = target.parameters(subject, "5.2")
    files = target.write(replace(subject, scene=replace(subject.scene, head=head)), rows, tmp_path, "5.2")
    assert [file.name for file in files] == ["skin.py", "head.glb", "head.npz"]
    meshes = {mesh["name"] for mesh in read_document(files[1]).tree["meshes"]}
    assert {"head", "eye_left", "brows", "lashes"} <= meshes and "hair" not in meshes
    hair = export_in(files[0].read_text("utf-8"))["hair"]
    assert (hair["file"], hair["bone"], hair["ior"]) == ("head.npz", "head", 1.55)
    with np.load(files[2]) as stored:
        points, radius, absorption, colour = (stored[name] for name in stored.files)
    assert points.shape[:2] == radius.shape and absorption.shape == colour.shape == (len(points), 3)
    skin = 1e-3 * head.mesh.points_mm @ [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # y up to z up
    middles = skin[head.mesh.point[head.mesh.triangles]].mean(axis=1)
    near = np.concatenate([skin, middles])
    assert cKDTree(near).query(points[:, 0])[0].max() < 0.012  # roots are on the head
    assert 1e-5 < radius.max() < 2e-3 and (absorption > 0).all() and (colour < 1).all()
    darker = absorption[:, 2] >= absorption[:, 0]
    assert darker.mean() > 0.9 and (colour[darker, 2] <= colour[darker, 0]).all()  # melanin absorbs blue


def test_boolean_properties_of_lamps_stay_boolean() -> None:
    scene = Scene(Head("ball", uv_sphere(90.0, 8, 4), Maps()), lights=[PointLight(position=(0, 0, 500))])
    (lamp,) = describe_scene(scene, np.zeros(3))[0]["lights"]
    assert lamp["set"]["use_soft_falloff"] is False  # Blender refuses 0.0
