"""`dermis view` as far as possible without a window."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import child_process
import pytest
from rigged_head import write_rigged_head, write_take
from small_head import without_colour_note

from dermis.apps.viewer.state import ViewerState
from dermis.scene import Scene

Run = Callable[..., Any]


@pytest.mark.parametrize(
    ("words", "error_subject"),
    [
        (("--port", "80"), "--port"),
        (("--host", "0.0.0.0"), "--host"),
        (("--token",), "--token"),
        (("--browser", "--port", "70000"), "--port"),
        (("--size", "wide"), "--size"),
        (("--atlas", "3"), "--atlas"),
        (("--samples", "0"), "--samples"),
        (("--lights", "none"), "--lights"),
        (("--camera", "nowhere"), "nowhere"),
        (("--motion", "nowhere.csv"), "nowhere.csv"),
        (("--motion-fps", "25"), "--motion-fps"),
    ],
)
def test_impossible_options_are_refused(
    run: Run, folder: Path, words: tuple[str, ...], error_subject: str
) -> None:
    ended = run("view", "head.obj", *words, "--adapter", "cpu")
    assert (ended.code, ended.stdout) == (2, "")
    assert ended.stderr.startswith(f"dermis: {error_subject}")


@pytest.mark.parametrize(
    ("words", "package"), [((), "glfw"), (("--browser",), "uvicorn"), ((), "imgui_bundle")]
)
def test_without_the_extra_the_message_names_it(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], package: str
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    ended = run("view", "head.obj", *words, "--adapter", "cpu")
    assert ended.code == 2
    assert package.replace("_", "-") in ended.stderr and '[viewer]".\n' in ended.stderr


def test_exposing_the_page_gives_a_warning(capfd: pytest.CaptureFixture[str]) -> None:
    from dermis.cli.view import _print_url

    _print_url("http://gpu.example:8765/secret/", True)
    told = capfd.readouterr()
    assert "/secret/" in told.out and "not encrypted" in told.err and "other machines" in told.err
    _print_url("http://127.0.0.1:8765/", False)
    assert "warning" not in capfd.readouterr().err


def test_the_package_imports_without_the_extra() -> None:
    missing = ("imgui_bundle", "rendercanvas", "glfw", "uvicorn", "websockets")
    code = f"import sys; sys.modules.update(dict.fromkeys({missing})); import dermis.apps.viewer.windows"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_without_a_display_the_message_suggests_the_browser(folder: Path) -> None:
    """In a separate process, because glfw ends the process that requests a window after its warning."""
    pytest.importorskip("glfw", reason="the extra `viewer` is not installed")
    environment = {name: value for name, value in os.environ.items() if name != "WAYLAND_DISPLAY"}
    command = [sys.executable, "-m", "dermis", "view", "head.obj", "--adapter", "cpu"]
    ended = subprocess.run(
        command, env=environment | {"DISPLAY": ":4294"}, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert without_colour_note(ended.stderr).startswith("dermis: window: ") and "--browser" in ended.stderr


@pytest.mark.skipif(os.name != "posix", reason="Ctrl+C is sent as a signal")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, 143)])
def test_a_single_signal_ends_the_server(folder: Path, number: int, code: int) -> None:
    pytest.importorskip("uvicorn", reason="the extra `viewer` is not installed")
    words = ["view", "head.obj", "--browser", "--port", "0", "--adapter", "cpu"]
    command = [sys.executable, "-m", "dermis", *words]
    (folder / "temporary").mkdir()
    environment = os.environ | {"TMPDIR": str(folder / "temporary")}
    pipe = subprocess.PIPE
    with child_process.start(command, stdout=pipe, stderr=pipe, text=True, env=environment) as served:
        try:
            assert served.stdout is not None
            urllib.request.urlopen(served.stdout.readline().split()[0], timeout=120).close()
            assert list((folder / "temporary").iterdir())
            served.send_signal(number)
            assert served.wait(timeout=120) == code
            assert not list((folder / "temporary").iterdir())
        finally:
            served.kill()


def test_options_determine_the_viewer_state(run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []
    monkeypatch.setattr("dermis.apps.viewer.windows.show_window", lambda *given, **_: seen.append(given))
    words = ("--lights", "window", "--camera", "ear", "--samples", "2", "--size", "300x200")
    assert run("view", "head.obj", *words, "--adapter", "cpu").code == 0
    state, adapter, size = seen[0]
    assert (adapter, size, state.light_preset) == ("cpu", (300, 200), "window")
    assert (state.settings.atlas, state.settings.samples) == (1024, 2)  # less on a software adapter
    assert state.head == {"name": str(folder / "head.obj")}
    assert state.scene.camera.frame_mm == 120.0


def test_a_scene_keeps_its_pose_when_a_motion_is_given(
    run: Run, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, seen = write_rigged_head(folder / "rigged.glb"), list[Any]()
    (folder / "posed.toml").write_text(
        f"[head]\nname = {str(file)!r}\n[pose.weights]\njawOpen = 0.5\n[pose.bones]\nneck = [0, 20, 0]\n"
    )
    monkeypatch.setattr(
        "dermis.apps.viewer.windows.show_window", lambda *given, **more: seen.append((given, more))
    )
    take = write_take(folder / "take.csv", 0.0, 0.5, 1.0)
    words = ("--motion", take.name, "--motion-fps", "10", "--adapter", "cpu")
    ended = run("view", "posed.toml", *words)
    assert ended.code == 0
    (state, _, _), more = seen[0]
    assert dict(state.scene.pose.weights) == {"jawOpen": 0.5}
    assert more["motion"].load_clip(state.scene.head).duration_s == pytest.approx(0.2)


def test_a_motion_without_a_name_of_the_heads_is_refused(run: Run, folder: Path) -> None:
    take = write_take(folder / "take.csv", 0.0, 0.5, 1.0)
    ended = run("view", "head.obj", "--motion", take.name, "--adapter", "cpu")
    assert ended.code == 2 and "JawOpen" in ended.stderr


def test_a_notebook_displays_the_same_viewer(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a notebook: a canvas replaces that of rendercanvas."""
    pytest.importorskip("imgui_bundle", reason="the extra `viewer` is not installed")
    from rendercanvas.offscreen import OffscreenRenderCanvas

    from dermis.apps.viewer.windows import view
    from dermis.scene.heads import load_head

    class Canvas(OffscreenRenderCanvas):  # type: ignore[misc]
        def _repr_mimebundle_(self, **options: Any) -> dict[str, str]:
            return {"text/plain": "shown"}

    for name in ("anywidget", "rendercanvas.anywidget"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setattr("dermis.apps.viewer.windows._notebook_canvas_class", lambda backend: Canvas)
    state = ViewerState(Scene(load_head(folder / "head.obj"))).with_settings(atlas=64, samples=1)
    widget = view(state, "cpu", (64, 48))
    assert widget._repr_mimebundle_() == {"text/plain": "shown"}
    assert widget.draw().shape == (48, 64, 4)
