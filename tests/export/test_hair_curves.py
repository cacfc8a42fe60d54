"""Hair as curves in exports: shapes, widths and absorption, read by Mitsuba, pbrt's grammar and usd-core."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from pbrt_grammar import read
from rigged_head import write_rigged_head
from small_head import write_head
from tolerances import WRITTEN_CURVES_MM

from dermis.apps.export.hair_curves import CurveGroup, curve_groups
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import load_subject
from dermis.apps.export.targets.mitsuba.hairs import hair_file, hair_files, hair_shape
from dermis.apps.export.targets.mitsuba.xml import XmlBackend, object_element, scene_document
from dermis.apps.export.targets.pbrt.hairs import hair_directives
from dermis.apps.truths.mitsuba_scene import mitsuba_variant
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.strand_groups import sufficient_knots
from dermis.scene.heads import load_head


@pytest.fixture(scope="module")
def head() -> Head:
    return Human(hair=HairLook(style="bob", density=0.2)).head(subdivide=0, hairs=0.05)


@pytest.fixture(scope="module")
def groups(head: Head) -> list[CurveGroup]:
    return list(curve_groups(head))


def curve_points(control_points: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return the points (n, k, c) at the knots of cubic B-splines with control points (n, k + 2, c)."""
    before, here, after = control_points[:, :-2], control_points[:, 1:-1], control_points[:, 2:]
    return np.asarray((before + 4.0 * here + after) / 6.0)


def test_all_hairs_of_a_head_are_in_groups_about_its_centre(head: Head, groups: list[CurveGroup]) -> None:
    assert head.strands is not None and head.hair is not None
    fine = [one for one in groups if one.name.startswith("brows")]
    assert sum(len(one.knots_mm) for one in fine) == len(head.strands)
    scalp = np.concatenate([one.knots_mm[:, 0] for one in groups if one.name.startswith("hair")])
    expected = np.asarray(head.hair.centre_mm) - head.centre_mm
    assert len(scalp) > 100
    assert np.linalg.norm(scalp.mean(axis=0) - expected) < 25.0


def test_mitsuba_reads_the_curves(groups: list[CurveGroup], tmp_path: Path) -> None:
    mi = pytest.importorskip("mitsuba")
    backend = XmlBackend()
    for name, content in hair_files(groups).items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(content)
    low = np.full(3, np.inf)
    for one in groups:
        text = (tmp_path / hair_file(one.name)).read_text()
        rows = np.array([[float(x) for x in line.split()] for line in text.splitlines() if line])
        count, knots = one.radius_mm.shape
        rows = rows[: count * (knots + 2)]  # a minute curve follows
        found = curve_points(rows.reshape(count, knots + 2, 4))
        np.testing.assert_allclose(found[..., :3], one.knots_mm, atol=WRITTEN_CURVES_MM)
        low = np.minimum(low, (rows[:, :3] - rows[:, 3:]).min(axis=0))
    with mitsuba_variant(mi, "scalar_rgb"):
        document = scene_document([object_element(hair_shape(one), "", backend) for one in groups])
        (tmp_path / "scene.xml").write_bytes(document)
        shapes = mi.load_file(str(tmp_path / "scene.xml")).shapes()
    assert len(shapes) == len(groups)
    seen = np.min([np.array(shape.bbox().min) for shape in shapes], axis=0)  # of control points and widths
    np.testing.assert_allclose(seen, low, atol=1e-4)


def test_mitsuba_gets_the_absorption_of_each_group(groups: list[CurveGroup]) -> None:
    node = object_element(hair_shape(groups[-1]), "", XmlBackend())
    colour = node.find("bsdf/rgb")
    assert colour is not None and colour.get("name") == "sigma_a"
    found = [float(x) for x in str(colour.get("value")).split()]
    np.testing.assert_allclose(found, groups[-1].optical_depth, rtol=1e-6)


def test_pbrt_reads_the_curves(groups: list[CurveGroup]) -> None:
    group = groups[-1]
    found = read("\n".join(hair_directives(group)), worlds=0)
    (material,) = [one.parameters for one in found if one.word == "Material"]
    np.testing.assert_allclose([float(x) for x in material["sigma_a"]], group.optical_depth, rtol=1e-5)
    curves = [one.parameters for one in found if one.word == "Shape"]
    points = np.array([[float(x) for x in one["P"]] for one in curves]).reshape(len(curves), -1, 3)
    np.testing.assert_allclose(curve_points(points), group.knots_mm, atol=WRITTEN_CURVES_MM)
    widths = np.array([[float(one[name][0]) for name in ("width0", "width1")] for one in curves])
    np.testing.assert_allclose(widths, 2.0 * group.radius_mm[:, [0, -1]], rtol=1e-5)


@pytest.mark.parametrize(("target", "module"), [("pbrt", "pbrt.target"), ("mitsuba", "mitsuba.target")])
def test_scenes_include_the_hair_of_the_head(
    target: str, module: str, groups: list[CurveGroup], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The head is a small one that borrows the hair of a person."""
    chosen = [groups[0], groups[-1]]
    monkeypatch.setattr(f"dermis.apps.export.targets.{module}.curve_groups", lambda head: chosen)
    subject = load_subject(write_rigged_head(tmp_path / "face.glb"))
    if target == "pbrt":
        export_skin(subject, target, tmp_path / "head.pbrt")
        directives = read((tmp_path / "head.pbrt").read_text())
        names = [one.names[0] for one in directives if one.word == "Include"]
        counts = [
            sum(one.word == "Shape" for one in read((tmp_path / name).read_text(), worlds=0))
            for name in names
        ]
        assert counts == [len(one.knots_mm) for one in chosen]
    else:
        export_skin(subject, target, tmp_path / "scene")
        shapes = ET.parse(tmp_path / "scene" / "scene.xml").getroot().findall("shape[@type='bsplinecurve']")
        names = [str(one.find("string[@name='filename']").get("value")) for one in shapes]  # type: ignore[union-attr]
        assert names == [hair_file(one.name) for one in chosen]
        assert all((tmp_path / "scene" / name).is_file() for name in names)


def test_usd_has_linear_curves_of_the_hair(tmp_path: Path) -> None:
    usd_hair = pytest.importorskip("dermis.apps.export.targets.usd.hair", exc_type=ImportError)
    from pxr import Usd, UsdGeom

    head = Human(hair=HairLook(style="bob", density=0.2)).head(subdivide=0, hairs=0.05)
    assert head.strands is not None
    stage = Usd.Stage.CreateNew(str(tmp_path / "hair.usda"))
    usd_hair.HairCurves("brows", head.strands, DeformableMesh(head)).define(stage, "/brows")
    stage.Save()
    opened = Usd.Stage.Open(str(tmp_path / "hair.usda"))
    curves = UsdGeom.BasisCurves(opened.GetPrimAtPath("/brows"))
    assert len(curves.GetCurveVertexCountsAttr().Get()) == len(head.strands)
    found = 1e3 * np.array(curves.GetPointsAttr().Get()).reshape(len(head.strands), -1, 3)
    kept = sufficient_knots(head.strands, 0.3, 40)
    expected = head.strands.knot_positions_mm(head.mesh, head.mesh.points_mm)[:, kept]
    np.testing.assert_allclose(found, expected, atol=WRITTEN_CURVES_MM)


def test_a_head_without_hair_has_no_curves(tmp_path: Path) -> None:
    assert not list(curve_groups(load_head(write_head(tmp_path / "small.obj"))))
