"""`dermis lights`: its output is a file for `--lights`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from dermis.scene.files import load_lights
from dermis.scene.lights import LIGHTS, light_presets

Run = Callable[..., Any]


@pytest.mark.parametrize("name", [name for name in light_presets() if name != "none"])
def test_the_printed_toml_is_the_rig(run: Run, tmp_path: Path, name: str) -> None:
    ended = run("lights", name)
    (tmp_path / "mine.toml").write_text(ended.stdout)
    assert ended.code == 0 and load_lights(tmp_path / "mine.toml") == load_lights(name)
    told = json.loads(run("lights", name, "--json").stdout)
    assert tuple(LIGHTS[one["kind"]](**one) for one in told["lights"]) == load_lights(name)


def test_rigs_are_listed_without_a_name(run: Run) -> None:
    lines = run("lights").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [name for name in light_presets() if name != "none"]
    assert all(line.endswith(".") and len(line.split()) > 3 for line in lines)
    assert list(json.loads(run("lights", "--json").stdout)["rigs"]) == [line.split()[0] for line in lines]


def test_unknown_names_are_refused(run: Run) -> None:
    ended = run("lights", "moon")
    assert ended.code == 2 and "moon: expected a rig (" in ended.stderr
