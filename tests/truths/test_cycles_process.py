"""Failures of Blender's Python, imitated by scripts: each has its own message."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from lit_balls import LIGHTS, ball_scene

from dermis.apps.truths import cycles
from dermis.apps.truths.cycles import cycles_render, read_passes
from dermis.apps.truths.path_traced import PathTraced
from dermis.base.errors import DermisError
from dermis.images.io import write_image
from dermis.optics.media import published_media
from dermis.scene.settings import Settings

SKIN1 = published_media()["skin1"].with_eta(1.0)


@pytest.fixture
def python(tmp_path: Path) -> Path:
    return tmp_path / "python"


def render(python: Path, script: str) -> PathTraced:
    """Render with a shell script in place of Blender's Python; `$3` is its working folder."""
    python.write_text(f"#!/bin/sh\n{script}\n")
    python.chmod(0o755)
    return cycles_render(ball_scene(LIGHTS["point"]), SKIN1, 4, Settings(size=(4, 4)), python=python)


def test_script_gets_the_scene_and_is_isolated(python: Path) -> None:
    with pytest.raises(DermisError, match="its files are unusable"):
        render(python, f'echo "$1 $2" > {python}.args; cp "$3"/scene.json {python}.json')
    assert Path(f"{python}.args").read_text().startswith("-I ")
    passes = json.loads(Path(f"{python}.json").read_text())["passes"]
    assert passes == [{"samples": 1, "seed": seed} for seed in range(4)]


@pytest.mark.parametrize("module", ["bpy", "numpy"])
def test_python_without_its_modules_is_named(python: Path, module: str) -> None:
    with pytest.raises(DermisError, match=rf"No module named '{module}'\. Set DERMIS_BLENDER_PYTHON"):
        render(python, f"echo \"ModuleNotFoundError: No module named '{module}'\" >&2; exit 1")


def test_file_that_is_no_program_is_named(python: Path) -> None:
    python.write_text("plain text")
    with pytest.raises(DermisError, match=r"cannot be run \(Permission denied\)\. Set DERMIS_BLENDER_PYTHON"):
        cycles_render(ball_scene(LIGHTS["point"]), SKIN1, 4, python=python)
    python.chmod(0o755)
    with pytest.raises(DermisError, match=r"cannot be run \(Exec format error\)"):
        cycles_render(ball_scene(LIGHTS["point"]), SKIN1, 4, python=python)


def test_failure_reports_its_last_output(python: Path) -> None:
    with pytest.raises(DermisError, match=r"it failed \(RuntimeError: no such socket\)\. Try bpy 5\.0"):
        render(python, 'echo "Traceback" >&2; echo "RuntimeError: no such socket" >&2; exit 1')
    with pytest.raises(DermisError, match=r"it failed \(no output\)"):
        render(python, "exit 3")
    with pytest.raises(DermisError, match=r"it failed \(\ufffd\ufffd\)"):
        render(python, r"printf '\377\376' >&2; exit 1")


def test_crash_reports_the_signal(python: Path) -> None:
    with pytest.raises(DermisError, match=r"signal 11 ended it \(Writing: blender\.crash\.txt\)"):
        render(python, "echo 'Writing: blender.crash.txt'; kill -11 $$")


def test_endless_run_is_stopped(python: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cycles, "_MAX_STARTUP_S", 0.2)
    with pytest.raises(DermisError, match=r"it was ended after 0 s\. Take fewer samples or a smaller image"):
        render(python, "exec sleep 60")


def test_invalid_output_is_refused(python: Path) -> None:
    for script, message in (
        ("true", "No such file"),
        ('echo "}{" > "$3"/done.json', "Expecting value"),
        ('echo "{}" > "$3"/done.json; echo picture > "$3"/pass_0.exr', "pass_0.exr"),
        ("echo '[]' > \"$3\"/done.json", "pass_0.exr"),
    ):
        with pytest.raises(DermisError, match=f"its files are unusable .*{message}"):
            render(python, script)


def left(folder: Path, picture: np.ndarray, done: object) -> None:
    write_image(folder / "pass_0.exr", picture)
    (folder / "done.json").write_text(json.dumps(done))


def test_passes_match_the_request(tmp_path: Path) -> None:
    good = np.full((2, 3, 4), 0.5, np.float32)
    left(tmp_path, good, {"version": "5.0.1", "times": [[2.0, 3.0]]})
    (one,) = read_passes(tmp_path, [8], (3, 2))
    assert (one.samples, one.seconds, one.core_seconds, one.version) == (8, 2.0, 3.0, "5.0.1")
    assert one.image.shape == (2, 3, 3) and (one.coverage == 0.5).all()
    for picture, done in (
        (good[:, :2], {"version": "5.0.1", "times": [[2.0, 3.0]]}),
        (np.where(good[..., :1] > 0, np.nan, good), {"version": "5.0.1", "times": [[2.0, 3.0]]}),
        (good, {"version": "5.0.1", "times": []}),
        (good, {"version": "5.0.1", "times": [2.0]}),
        (good, {"times": [[2.0, 3.0]]}),
        (good, [1, 2]),
    ):
        left(tmp_path, picture.astype(np.float32), done)
        with pytest.raises(DermisError, match="its files are unusable"):
            read_passes(tmp_path, [8], (3, 2))
