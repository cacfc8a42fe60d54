"""--eyes, --eye-groups and --eye on heads from files, and notes where there are no eyes."""

from __future__ import annotations

from pathlib import Path

import pytest
from eyed_head import EYE_MM, ball, write_head

from dermis.images.io import read_image
from dermis.scene.files import load_scene
from dermis.scene.saving import scene_text

SMALL = ("--unit-mm", 1, "--size", "48x48", "--atlas", 128, "--samples", 1)


@pytest.fixture
def camera(tmp_path: Path) -> Path:
    """Return the path of a camera close to the left eye."""
    path, (x, y, z) = tmp_path / "camera.toml", EYE_MM
    y += 5.0  # the head's centre is 120 mm below its crown
    path.write_text(f"[camera]\nposition = [{x}, {y}, 600]\ntarget = [{x}, {y}, {z}]\nframe_mm = 30\n")
    return path


@pytest.mark.usefixtures("opened")
def test_a_files_eye_has_a_pupil_unless_it_is_plain(run, tmp_path: Path, camera: Path) -> None:
    head, middles = write_head(tmp_path / "a.gltf"), []
    for options in ((), ("--eyes", "plain"), ("--eye", "eumelanin=0,pupil_mm=1")):
        image = tmp_path / f"{len(middles)}.png"
        outcome = run("render", head, *SMALL, "--camera", camera, "-o", image, *options)
        assert outcome.code == 0 and "eyes:" not in outcome.stderr
        middles.append(read_image(image).astype(float))
    fitted, plain, blue = middles
    assert fitted[22:26, 22:26].mean() < 0.3 * plain[22:26, 22:26].mean()
    iris = blue[22:26, 30:32, :3].mean(axis=(0, 1)) / fitted[22:26, 30:32, :3].mean(axis=(0, 1))
    assert iris[2] > 1.1 * iris[0]


@pytest.mark.usefixtures("opened")
def test_eyes_that_cannot_be_fitted_are_noted(run, tmp_path: Path, folder: Path) -> None:
    odd = write_head(tmp_path / "odd.gltf", ball(25.0), ball(25.0))
    outcome = run("render", odd, *SMALL, "-o", tmp_path / "a.png")
    assert (
        outcome.code == 0 and "note: eyes: 'eye_L', 'eye_R' stay plain: the largest piece" in outcome.stderr
    )
    unnamed = write_head(tmp_path / "white.gltf", names=("white", "white"))
    outcome = run("render", unnamed, *SMALL, "-o", tmp_path / "a.png")
    assert outcome.code == 0 and "note: eyes" not in outcome.stderr
    outcome = run("render", unnamed, *SMALL, "-o", tmp_path / "a.png", "--eyes", "fitted")
    assert outcome.code == 0 and "eyes: no group has a name of an eye" in outcome.stderr
    outcome = run("render", unnamed, *SMALL, "-o", tmp_path / "a.png", "--look-at", "camera")
    assert outcome.code == 2 and "--eye-groups" in outcome.stderr


def test_impossible_looks_are_refused(run, tmp_path: Path) -> None:
    head = write_head(tmp_path / "a.gltf")
    for words, told in (
        ("pupil_mm=9", "--eye pupil-mm: expected a number"),
        ("colour=1", "--eye colour: expected one of"),
    ):
        outcome = run("render", head, "--unit-mm", 1, "--eye", words, "-o", tmp_path / "a.png")
        assert outcome.code == 2 and told in outcome.stderr
    outcome = run("render", "human", "--eyes", "plain", "-o", tmp_path / "a.png")
    assert outcome.code == 2 and "eyes: expected a mesh file to which it applies" in outcome.stderr


def test_scene_files_set_the_look_of_the_eyes(tmp_path: Path) -> None:
    write_head(tmp_path / "a.gltf")
    table = '[head]\nname = "a.gltf"\nunit_mm = 1.0\neye_groups = ["eye_L"]\n'
    (tmp_path / "a.toml").write_text(f"{table}[head.eye]\neumelanin = 0.25\nseed = 7\n")
    scene, settings = load_scene(tmp_path / "a.toml")
    assert scene.head.eyes is not None
    assert (scene.head.eyes.look.eumelanin, scene.head.eyes.look.seed) == (0.25, 7)
    head = {"name": str(tmp_path / "a.gltf"), "unit_mm": 1.0, "eye": {"eumelanin": 0.25, "seed": 7}}
    (tmp_path / "b.toml").write_text(scene_text(scene, settings, head))
    again, _ = load_scene(tmp_path / "b.toml")
    assert again.head.eyes is not None and again.head.eyes.look == scene.head.eyes.look


def test_comparisons_accept_eye_options(run) -> None:
    outcome = run("compare", "specular", "--eyes", "plain")
    assert outcome.code == 2 and "--eyes: expected no such option here" in outcome.stderr
