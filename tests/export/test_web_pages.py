"""Pages with a JavaScript library: policy, escaping, parameters, and rendering in a browser."""

from __future__ import annotations

import base64
import gzip
import io
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium_input import CHROMIUM
from numpy.typing import NDArray
from PIL import Image

from dermis import Human
from dermis.apps.export.fitting import cumulative_burley_profile, fit_burley_width
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.babylon.target import spiral_profile
from dermis.apps.export.targets.pages.engine_page import page_camera_json
from dermis.apps.export.targets.pages.html import csp_hash, escape_script
from dermis.base.errors import DermisError
from dermis.formats.gltf.document import read_document
from dermis.mesh.maps import Maps

FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
HOSTILE = '"; import os</script><script>alert(1)</script>$head'
LIBRARY_VARIABLES = {"babylon": "DERMIS_BABYLON", "three": "DERMIS_THREE"}


@pytest.fixture(scope="module")
def skin() -> Subject:
    return load_subject("skin1")


@pytest.fixture(params=["babylon", "three"])
def target(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def page_text(subject: Subject, target: str, folder: Path) -> str:
    export_skin(subject, target, folder / "page.html")
    return (folder / "page.html").read_text("utf-8")


def test_scripts_match_the_content_security_policy(skin: Subject, target: str, tmp_path: Path) -> None:
    text = page_text(skin, target, tmp_path)
    policy = re.search(r'Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    allowed = policy[1].replace("&#x27;", "'")
    inside = re.findall(r'<script type="(?:module|importmap)">(.*?)</script>', text, re.DOTALL)
    assert inside and all(csp_hash(one) in allowed for one in inside)
    assert "unsafe" not in allowed and allowed.startswith("default-src 'none'")
    target_ = TARGETS[target].with_variant(None)
    urls = [one.url for one in target_.library_files[target_.versions[-1]]]  # type: ignore[attr-defined]
    assert all(url in allowed for url in urls)
    assert text.count("sha384-") == len(urls) == len(set(re.findall(r"sha384-[\w+/]{64}", text)))
    assert set(re.findall(r"https?://[^/\"' ]+", text)) == {"https://cdn.jsdelivr.net"}


def test_user_text_is_escaped(target: str, tmp_path: Path) -> None:
    plain = load_subject("skin1")
    named = Subject(HOSTILE, plain.curve, plain.albedo, plain.model, plain.tissue)
    text = page_text(named, target, tmp_path)
    assert "<script>alert" not in text and "alert(1)" in text
    assert (
        text.count("</script>")
        == text.count("<script")
        == page_text(plain, target, tmp_path).count("<script")
    )


def test_the_page_holds_the_head_in_metres_and_the_parameters(
    skin: Subject, target: str, tmp_path: Path
) -> None:
    text = page_text(skin, target, tmp_path)
    head = re.search(r'id="head">([^<]*)<', text)
    settings_text = re.search(r'id="settings">([^<]*)<', text)
    assert head is not None and settings_text is not None
    assert gzip.decompress(base64.b64decode(head[1])).startswith(b"glTF")
    settings = json.loads(settings_text[1])
    report = evaluate_export(skin, TARGETS[target].with_variant(None), TARGETS[target].versions[-1])
    assert settings["skin"] == json.loads(
        json.dumps({r.name.rpartition(".")[2]: r.value for r in report.parameters})
    )
    assert 0.3 < np.linalg.norm(settings["camera"]["position"]) < 3.0
    assert all(abs(np.linalg.norm(light["direction"]) - 1.0) < 1e-9 for light in settings["lights"])


@pytest.mark.parametrize("name", ["skin1", "skin2", "dj3"])
def test_babylon_parameters_compensate_its_two_errors(name: str) -> None:
    subject, babylon = load_subject(name), TARGETS["babylon"].with_variant(None)
    rows = babylon.parameters(subject, babylon.versions[-1])
    colour, (metres,) = (get_numbers(rows, row.name) for row in rows[:2])
    d = fit_burley_width(subject.curve)
    np.testing.assert_allclose(2.0 / (metres * np.array(colour)), d)  # each channel's own width
    np.testing.assert_allclose(2.0 * max(colour) / metres, d.max())  # and the widest is drawn from
    report = evaluate_export(subject, babylon, babylon.versions[-1])
    # the lobes' own error, and half a step of the fortieth that samples make
    own = np.abs(cumulative_burley_profile(d, subject.curve.energy).fraction - subject.curve.fraction).max(
        axis=0
    )
    assert (report.error.edge <= 0.5 * own + 0.025).all()
    assert (report.naive_error.edge > 2.0 * report.error.edge).all()


def test_white_profile_is_a_lobe_and_grey_one_is_wider() -> None:
    x = np.linspace(-6.0, 6.0, 49)
    white = spiral_profile([1.0, 1.0, 1.0], 2.0, np.ones(3))
    assert (
        np.abs(
            white.edge_response(x) - cumulative_burley_profile(np.ones(3), np.ones(3)).edge_response(x)
        ).max()
        < 0.01
    )
    grey = spiral_profile([0.5, 0.5, 0.5], 2.0, np.ones(3))
    assert (grey.radius_at_fraction(0.5) > white.radius_at_fraction(0.5)).all()


def test_three_has_no_diffusion_and_notes_it(skin: Subject) -> None:
    report = evaluate_export(skin, TARGETS["three"].with_variant(None), "0.187.0")
    assert (report.error.edge > 0.45).all() and "no subsurface scattering" in report.limitations


def test_other_library_versions_are_refused_before_writing(target: str, tmp_path: Path) -> None:
    target_ = TARGETS[target].with_variant(None)
    first = target_.library_files[target_.versions[-1]][0]  # type: ignore[attr-defined]
    file = tmp_path / first.package / first.path
    file.parent.mkdir(parents=True)
    file.write_text("alert(1)")
    with pytest.raises(DermisError, match="npm install"):
        export_skin("skin1", target, tmp_path / "page.html", library=tmp_path)
    assert not (tmp_path / "page.html").exists()


def test_other_targets_have_no_library(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="library"):
        export_skin("skin1", "unity", tmp_path / "x.asset", library=tmp_path)


def test_an_embedded_script_does_not_end_early() -> None:
    assert "</script" not in escape_script('x = "</script><!--"').lower()


def screenshot(page: Path) -> NDArray[np.float64]:
    """Return a screenshot of the page in Chromium, without network."""
    from playwright.sync_api import sync_playwright

    errors: list[str] = []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        one = browser.new_page(viewport={"width": 240, "height": 240}, offline=True)
        one.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        one.goto(page.as_uri())
        one.wait_for_selector("html[data-state]", state="attached", timeout=120_000)
        picture = np.asarray(Image.open(io.BytesIO(one.screenshot())).convert("RGB"), np.float64) / 255.0
        assert one.evaluate("document.documentElement.dataset.state") == "drawn"
        browser.close()
    assert errors == []
    return picture


@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_a_browser_draws_the_ball_without_network(skin: Subject, target: str, tmp_path: Path) -> None:
    library = os.environ.get(LIBRARY_VARIABLES[target])
    if library is None:
        pytest.skip(f"{LIBRARY_VARIABLES[target]} does not name the folder node_modules with the library")
    export_skin(skin, target, tmp_path / "page.html", library=library)
    picture = screenshot(tmp_path / "page.html")
    ball = picture[80:160, 100:140]
    assert (ball.mean(axis=(0, 1)) > 0.1).all() and ball[..., 0].mean() > 1.2 * ball[..., 2].mean()
    assert picture[200:, 200:].max() < 0.02


def test_camera_is_that_of_the_scene() -> None:
    """Cameras are placed relative to the centre of the head, which is not the origin of the file."""
    human = load_subject("human")
    assert human.scene is not None
    exported = page_camera_json(human.scene, human.scene.head.centre_mm)
    centre = 1e-3 * np.array(human.scene.head.centre_mm)
    assert np.linalg.norm(centre) > 0.03
    np.testing.assert_allclose(
        np.array(exported["target"]) - centre, 1e-3 * np.array(human.scene.camera.target)
    )
    babylon = TARGETS["babylon"].with_variant(None)
    rows = babylon.parameters(human, babylon.versions[-1])
    assert babylon._page_settings_json(human, rows, babylon.versions[-1])["camera"] == exported  # type: ignore[attr-defined]


def test_pages_hold_the_head_at_rest_without_its_rig(target: str, tmp_path: Path) -> None:
    person = load_subject("human:7", subdivide=0)
    assert person.scene is not None
    head = replace(Human.sampled(7).head(subdivide=0, hairs=0.05), maps=Maps(colour=np.full((8, 8, 3), 0.3)))
    text = page_text(replace(person, scene=person.scene.replace(head=head)), target, tmp_path)
    packed = re.search(r'id="head">([^<]*)<', text)
    assert packed is not None
    (tmp_path / "head.glb").write_bytes(gzip.decompress(base64.b64decode(packed[1])))
    document = read_document(tmp_path / "head.glb")
    meshes = {mesh["name"]: mesh["primitives"][0] for mesh in document.tree["meshes"]}
    assert {"head", "eye_left", "hair", "brows"} <= set(meshes) and "skins" not in document.tree
    assert not any("targets" in primitive for primitive in meshes.values())
    points = 1e3 * document.read_floats(meshes["head"]["attributes"]["POSITION"])
    skin = head.mesh.positions[np.unique(head.mesh.triangles[head.mesh.material == 0])]
    np.testing.assert_allclose(points, skin, atol=1e-3)
