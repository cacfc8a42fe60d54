"""Settings files of all kinds, hostile ones too: refused with a sentence that names them, or read."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from small_head import write_head

import dermis
from dermis.base.errors import DermisError
from dermis.formats.motion.live_link import load_live_link
from dermis.formats.motion.mediapipe import load_mediapipe
from dermis.human.person_file import read_person
from dermis.human.regions.labels import load_landmarks
from dermis.human.regions.region_table import load_region_table
from dermis.mesh.head import Head
from dermis.scene.files import load_camera

PAGE = (Path(__file__).parents[1] / "docs" / "formats.md").read_text("utf-8")
LIVE_LINK = "Timecode,BlendShapeCount,JawOpen\n00:00:01:00.000,1,0.5\n"
MEDIAPIPE = '{"time": 0, "blendshapes": {"jawOpen": 0.5}}\n'


class Kind(NamedTuple):
    """Reader of a kind of file, a valid file, and the names of its numbers."""

    load: Callable[[Any, Head], object]
    text: str
    number: str


def _example(name: str) -> str:
    found = re.search(rf"^# {name}\n.*?^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert found
    return found[0].removesuffix("```")


KINDS = {
    "scene.toml": Kind(
        lambda path, _: dermis.load_scene(path), '[head]\nname = "human"\nunit_mm = 10\n', "10"
    ),
    "lights.toml": Kind(lambda path, _: dermis.load_lights(path), _example("lights.toml"), "-750"),
    "camera.toml": Kind(load_camera, "[camera]\nposition = [0, 0, 900]\n", "900"),
    "regions.toml": Kind(lambda path, _: load_region_table(path), _example("regions.toml"), "0.29"),
    "landmarks.csv": Kind(lambda path, _: load_landmarks(path), _example("landmarks.csv"), "-4.5"),
    "tissue.toml": Kind(lambda path, _: dermis.load_tissue(path), _example("tissue.toml"), "1.4"),
    "profile.csv": Kind(lambda path, _: dermis.load_profile(path), _example("profile.csv"), "7.41"),
    "own.toml": Kind(
        lambda path, _: dermis.load_profile(path), "variances_mm2 = [1]\nweights = [[0.5, 1, 1]]\n", "0.5"
    ),
    "person.json": Kind(lambda path, _: read_person(path), '{"person": {"age": 62}}', "62"),
    "take.csv": Kind(load_live_link, LIVE_LINK, "0.5"),
    "take.jsonl": Kind(load_mediapipe, MEDIAPIPE, "0.5"),
}
NAMED = ["regions", "profile", "lights", "camera"]
TEXTS = {
    "no UTF-8": b"\xff\xfe\x00",
    "another encoding": "a = 1".encode("utf-16"),
    "NUL": b"\0" * 10_000,
    "nested lists": b"a = " + b"[" * 100_000,
    "nested tables": b"a = " + b"{a = " * 50_000,
    "nested JSON": b'{"a":' * 100_000,
    "one line": b"a" * 1_000_000,
    "one cell": b'"' + b"a" * 1_000_000,
    "columns": b"Timecode" + b",a" * 400_000,
    "a deep key": b".".join([b"a"] * 50_000) + b" = 1",
    "a deep table": b"[" + b".".join([b'"a"'] * 50_000) + b"]",
    "deep keys": (b".".join([b"a"] * 31) + b" = 1\n") * 10_000,
    "empty": b"",
}
PLACES = ["device", "pipe", "folder", "name with NUL", "long name", "too large", "nothing"]


@pytest.fixture(scope="module")
def head() -> Head:
    return dermis.Human().head()


def _placed(folder: Path, name: str, place: str) -> Path:
    """Return a file name at which nothing can be read."""
    path = folder / name
    if place == "device":
        path.symlink_to("/dev/zero")
    elif place == "pipe":
        os.mkfifo(path)
    elif place == "folder":
        path.mkdir()
    elif place == "too large":
        with path.open("wb") as file:
            file.truncate(1 << 40)
    elif place == "name with NUL":
        path = folder / f"a\0{name}"
    elif place == "long name":
        path = folder / f"{'a' * 5000}{name}"
    return path


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", KINDS)
def test_a_name_without_a_file_to_read_is_refused(tmp_path: Path, head: Head, name: str, place: str) -> None:
    path = _placed(tmp_path, name, place)
    with pytest.raises(DermisError, match=r"expected .*, but .*\."):
        KINDS[name].load(path, head)


@pytest.mark.parametrize("place", [place for place in PLACES if place != "name with NUL"])
@pytest.mark.parametrize("part", NAMED)
def test_scene_that_names_a_missing_settings_file_is_refused(tmp_path: Path, part: str, place: str) -> None:
    write_head(tmp_path / "head.obj")
    named = _placed(tmp_path, "other.toml", place).name
    tables = {
        "regions": f'[head]\nname = "head.obj"\nregions = "{named}"\n',
        "profile": f'[head]\nname = "head.obj"\n[skin]\nprofile = "{named}"\n',
    }
    scene = tmp_path / "scene.toml"
    scene.write_text(tables.get(part, f'{part} = "{named}"\n[head]\nname = "head.obj"\n'))
    with pytest.raises(DermisError, match=r"expected .*, but .*\."):
        made, _ = dermis.load_scene(scene)
        dermis.load_profile(made.skin.profile)  # which a renderer reads


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
@pytest.mark.parametrize("name", KINDS)
def test_invalid_text_is_refused(tmp_path: Path, head: Head, name: str, text: bytes) -> None:
    (tmp_path / name).write_bytes(text)
    with pytest.raises(DermisError, match=rf"{re.escape(name)}.*expected ") as caught:
        KINDS[name].load(tmp_path / name, head)
    assert len(str(caught.value)) < 1500


@pytest.mark.parametrize("number", ["9" * 400, "9" * 5000, "1e999", "nan", "[1]", "1e308"])
@pytest.mark.parametrize("name", KINDS)
def test_invalid_number_is_refused(tmp_path: Path, head: Head, name: str, number: str) -> None:
    kind, path = KINDS[name], tmp_path / name
    path.write_text(kind.text.replace(kind.number, number, 1))
    with pytest.raises(DermisError, match=rf"{re.escape(name)}.*expected "):
        kind.load(path, head)
