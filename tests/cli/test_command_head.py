"""`dermis head`: its file, and refusals."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dermis
from dermis import Human
from dermis.base.errors import DermisWarning
from dermis.human.hair.look import HairLook
from dermis.human.skin.look import SkinLook
from dermis.images.codecs import encode_png
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.head import Head
from dermis.scene.heads import load_head

Run = Callable[..., Any]


def same_shape(head: Head, person: Human) -> bool:
    """Return whether two heads have the same extent of control points."""
    ends = [(one.min(axis=0), one.max(axis=0)) for one in (head.positions_mm, person.positions_mm)]
    return bool(np.abs(np.subtract(*ends)).max() < 1e-3)


def test_writes_a_person_that_renders(run: Run, render: Run, folder: Path) -> None:
    words = ("--seed", "3", "--age", "70", "--target", "nose/nose-hump-incr=0.5", "--subdivide", "0")
    ended = run("head", *words, "-o", "own.glb", "--json")
    assert (ended.code, ended.stderr) == (0, "")
    report = json.loads(ended.stdout)
    drawn = Human.sampled(3)
    assert report["head"] == "own.glb" and report["bytes"] == (folder / "own.glb").stat().st_size
    assert report["person"]["age"] == 70 and report["person"]["sex"] == drawn.sex
    assert report["person"]["targets"] == {**drawn.targets, "nose/nose-hump-incr": 0.5}
    told = report["person"]
    looks = {"skin": SkinLook(**told["skin"]), "eyes": EyeLook(**told["eyes"])}
    person = Human(**told | looks | {"hair": HairLook(**told["hair"])})
    assert person.look == drawn.look
    assert same_shape(load_head(folder / "own.glb", eyes="plain"), person) and not same_shape(
        load_head(folder / "own.glb", eyes="plain"), drawn
    )
    assert render("own.glb", "--pose", "jawOpen=0.6", "--bone", "head=0,20,0", "-o", "own.png").code == 0


def test_the_default_is_the_average_person(run: Run, folder: Path) -> None:
    ended = run("head")
    assert ended.code == 0 and "head.glb  56,032 triangles" in ended.stdout and "CC0" in ended.stdout
    head = load_head(folder / "head.glb")
    assert head.targets == Human().head(subdivide=0).targets
    heights, wanted = (np.sort(one.mesh.positions[:, 1]) for one in (head, Human().head()))
    assert np.abs(heights - wanted).max() < 0.1  # in a file nothing keeps lids off the eyes


def test_fields_targets_and_expressions_add_up(run: Run, folder: Path) -> None:
    chosen = ("--asian", "1", "--african", "0", "--caucasian", "0", "--sex", "1", "--weight", "0.5")
    words = (
        "--target",
        "nose/nose-hump-incr=0.5,head/head-oval=0.2",
        "--target",
        "chin/chin-jaw-drop-incr=0.1",
    )
    resting = ("--expression", "jawOpen=0.3", "--expression", "mouthSmileLeft=1")
    ended = run("head", *chosen, *words, *resting, "--layout", "hm08", "--subdivide", "0", "--json")
    assert ended.code == 0, ended.stderr
    person = json.loads(ended.stdout)["person"]
    assert (person["asian"], person["sex"], person["weight"], person["age"]) == (1, 1, 0.5, 30)
    assert len(person["targets"]) == 3
    with pytest.warns(DermisWarning, match="hair is left out"):
        head = load_head(folder / "head.glb")
    rest = dict(zip(head.targets, head.control_rig.targets.rest, strict=True))  # type: ignore[arg-type]
    assert rest["jawOpen"] == pytest.approx(0.3) and rest["mouthSmileLeft"] == 1
    assert sum(map(bool, rest.values())) == 2


def test_maps_of_files_replace_painted_maps(run: Run, folder: Path) -> None:
    side = 32
    flat = np.tile(np.array([128, 128, 255], np.uint8), (side, side, 1))
    (folder / "flat.png").write_bytes(encode_png(flat))
    (folder / "rough.png").write_bytes(encode_png(np.full((side, side, 1), 64, np.uint8)))
    words = ("--normal", "flat.png", "--roughness", "rough.png", "--subdivide", "0")
    assert run("head", *words).code == 0
    maps = load_head(folder / "head.glb").maps
    own = Human().head(subdivide=0).maps
    assert maps.normal is not None and np.abs(maps.normal).max() < 0.02
    assert maps.roughness is not None and np.allclose(maps.roughness, 64 / 255)
    assert maps.mean_colour is not None and own.mean_colour is not None
    assert np.allclose(maps.mean_colour, own.mean_colour, atol=0.05)


def test_targets_are_listed(run: Run, folder: Path) -> None:
    before = sorted(folder.iterdir())
    assert tuple(run("head", "--list-targets").stdout.split()) == dermis.human_targets()
    assert tuple(json.loads(run("head", "--list-targets", "--json").stdout)) == dermis.human_targets()
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("words", "error_subject"),
    [
        (("--age", "9"), "age"),
        (("--sex", "nan"), "sex"),
        (("--asian", "0", "--african", "0", "--caucasian", "0"), "ancestry"),
        (("--target", "wings=1"), "'wings'"),
        (("--target", "nose-hump-incr=1"), "Did you mean nose/nose-hump-incr"),
        (("--target", "nose/nose-hump-incr"), "--target"),
        (("--target", "nose/nose-hump-incr=9"), "from -2 to 2"),
        (("--expression", "jawOpn=1"), "Nearest: jawOpen"),
        (("--expression", "jawOpen"), "--expression"),
        (("--seed", "-1"), "seed"),
        (("--seed", "1.5"), "1.5"),
        (("--subdivide", "4"), "subdivide"),
        (("--layout", "few"), "--layout"),
        (("--colour", "none.png"), "none.png"),
        (("-o", "own.obj"), "own.obj"),
        (("-o", "nowhere/own.glb"), "nowhere"),
    ],
)
def test_invalid_options_are_refused(
    run: Run, folder: Path, words: tuple[str, ...], error_subject: str
) -> None:
    before = sorted(folder.iterdir())
    ended = run("head", *words)
    assert (ended.code, ended.stdout) == (2, "")
    assert (
        ended.stderr.startswith("dermis: ")
        and error_subject in ended.stderr
        and "Traceback" not in ended.stderr
    )
    assert sorted(folder.iterdir()) == before
