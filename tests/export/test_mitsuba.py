"""Export to Mitsuba: contents of the XML, and renderings by Mitsuba against predictions."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from dermis.apps.export.fitting import profile_error
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.mitsuba.meshes import subdivide_triangles
from dermis.apps.export.targets.mitsuba.target import TARGET, SkinColours, fit_medium
from dermis.apps.export.targets.mitsuba.xml import Bitmap, Transform, XmlBackend, object_element
from dermis.apps.truths.mitsuba_scene import mitsuba_variant
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.media import published_media

EDGE_NOISE = 0.05
"""Of an edge response by 12,000 paths; its standard error is a third of this."""


@pytest.fixture(scope="module")
def mi() -> Any:
    return pytest.importorskip("mitsuba")


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of an exported ball of skin2."""
    folder = tmp_path_factory.mktemp("mitsuba") / "ball"
    export_skin(load_subject("skin2"), "mitsuba", folder)
    return folder


def test_homogeneous_skin_keeps_its_medium() -> None:
    subject = load_subject("skin1")
    rows = TARGET.with_variant("smooth").parameters(subject, "3")
    layer = published_media()["skin1"].layers[0]
    np.testing.assert_allclose(get_numbers(rows, "sigma_t"), layer.sigma_t_prime, rtol=0.02)
    np.testing.assert_allclose(get_numbers(rows, "albedo"), layer.alpha_prime, rtol=0.005)


@pytest.mark.parametrize("boundary", TARGET.variants)
def test_fitted_media_are_closer_than_typed_ones(boundary: str) -> None:
    subject, target = load_subject("skin1"), TARGET.with_variant(boundary)
    fit, naive = target.parameters(subject, "3"), target.naive_parameters(subject, "3")
    near, far = (
        profile_error(subject.curve, target.predicted_profile(rows, subject, "3")) for rows in (fit, naive)
    )
    assert near.edge.max() < 0.015
    assert np.abs(near.energy).max() < 1e-3
    assert far.edge.min() > 0.1


def test_medium_compensates_for_dimmed_skin() -> None:
    curve = load_subject("skin1").curve
    mean = np.array([0.3, 0.2, 0.1])
    plain, dimmed = SkinColours(mean, mean, 1.0), SkinColours(mean, 1.3 * mean, 1.3)
    for boundary in TARGET.variants:
        before, after = (fit_medium(curve, one, boundary) for one in (plain, dimmed))  # type: ignore[arg-type]
        assert np.all(np.array(after.albedo) > np.array(before.albedo))
        np.testing.assert_allclose(dimmed.transmittance(boundary), 1 / 1.3, rtol=1e-12)  # type: ignore[arg-type]


def test_names_are_escaped_and_pictures_numbered() -> None:
    backend = XmlBackend()
    made = object_element({"type": "ply", "filename": '"/><x a="&'}, "", backend)
    assert ET.fromstring(ET.tostring(made))[0].attrib["value"] == '"/><x a="&'
    slide = {"type": "bitmap", "bitmap": Bitmap(np.zeros((1, 1, 3), np.float32)), "raw": True}
    assert object_element(slide, "", backend)[0].attrib == {
        "name": "filename",
        "value": "textures/light_0.exr",
    }
    assert len(backend.bitmaps) == 1


def test_transforms_match_mitsuba(mi: Any) -> None:
    given = [1.0, 2.0, 3.0], [-4.0, 0.5, 1.0], [0.0, 1.0, 0.2]
    own = Transform().look_at(*given).scale([2.0, 3.0, 1.0]).matrix
    with mitsuba_variant(mi, "scalar_rgb"):
        theirs = np.array(mi.ScalarTransform4f().look_at(*given).scale([2.0, 3.0, 1.0]).matrix)
        assert XmlBackend.math.RayEpsilon == pytest.approx(mi.math.RayEpsilon, rel=1e-6)
    np.testing.assert_allclose(own, theirs, atol=1e-5)


def test_subdivided_triangles_cover_the_original() -> None:
    found = subdivide_triangles(np.array([4, 7]), 3)
    assert len(found.corners) == 2 * 9
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0)
    corners = found.weights[found.corners][:, :, 1:]
    across, down = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    np.testing.assert_allclose(np.linalg.det(np.stack([across, down], axis=1)), 1 / 9)
    assert set(found.triangle.tolist()) == {4, 7}


def test_scene_lists_its_files(ball: Path) -> None:
    for name in ("scene.xml", *(f"boundary_{each}.xml" for each in TARGET.variants)):
        for node in ET.parse(ball / name).iter("string"):
            if node.attrib["name"] == "filename":
                assert (ball / node.attrib["value"]).is_file()
    scene = ET.parse(ball / "scene.xml").getroot()
    defaults = {node.attrib["name"]: node.attrib["value"] for node in scene.iter("default")}
    assert defaults["boundary"] == "matched"
    assert "/tmp" not in (ball / "scene.xml").read_text("utf-8")


@pytest.mark.parametrize("boundary", TARGET.variants)
def test_mitsuba_renders_the_scene(mi: Any, ball: Path, boundary: str) -> None:
    with mitsuba_variant(mi, "scalar_rgb"):
        given = {"boundary": boundary, "width": "24", "height": "24", "samples": "8"}
        picture = np.array(mi.render(mi.load_file(str(ball / "scene.xml"), **given)))
    assert picture.shape == (24, 24, 3)
    assert np.isfinite(picture).all()
    if boundary == "matched":  # points and spots light it
        lit = picture[picture.max(axis=-1) > 0.1]
        assert len(lit) > 4
        assert lit[:, 0].mean() > lit[:, 2].mean()


def test_mitsuba_renders_the_predicted_edge_response(mi: Any) -> None:
    from dermis.apps.validation.engines import mitsuba as bench

    subject = load_subject("skin2")
    with mitsuba_variant(mi, "scalar_rgb"):
        fitted_error = _fitted_error(mi, bench, subject, "smooth", 0)
        naive_error = _naive_error(mi, bench, subject)
    assert fitted_error < EDGE_NOISE < naive_error


def test_python_steps_of_the_readme_load_the_scene(mi: Any, ball: Path) -> None:
    """The code of the README runs in a new interpreter, in which Mitsuba has no variant yet."""
    steps = [line for line in (ball / "README.md").read_text("utf-8").splitlines() if line[1:3] == ". "]
    code = [
        one for one in re.findall("`([^`]*)`", " ".join(steps)) if "mi." in one or one.startswith("import")
    ]
    assert len(code) == 3
    stub = "mi.render = lambda scene: print(len(scene.shapes()))"  # only loads the scene
    run = [sys.executable, "-c", "\n".join([code[0], code[1], stub, code[2]])]
    done = subprocess.run(run, cwd=ball, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and int(done.stdout) > 0, done.stderr


def _fitted_error(mi: Any, bench: Any, subject: Subject, boundary: str, channel: int) -> float:
    target = TARGET.with_variant(boundary)
    return _edge_error(mi, bench, subject, target.parameters(subject, "3"), boundary, channel)


def _naive_error(mi: Any, bench: Any, subject: Subject) -> float:
    return _edge_error(
        mi, bench, subject, TARGET.with_variant("smooth").naive_parameters(subject, "3"), "smooth", 0
    )


def _edge_error(mi: Any, bench: Any, subject: Subject, rows: Any, boundary: str, channel: int) -> float:
    """Return the largest error of a measured edge response."""
    sigma, albedo = (get_numbers(rows, name)[channel] for name in ("sigma_t", "albedo"))
    medium = bench.IsotropicMedium((sigma,) * 3, (albedo,) * 3)
    d = float(bench.fit_burley_width(subject.curve)[channel])
    measured, _, _ = bench.measured_edge_response(mi, medium, boundary, d, 768)
    curve: CumulativeProfile = subject.curve
    return float(np.abs(measured - bench.pixel_edge_response(curve, channel, d)).max())
