"""`dermis view`: a head in an interactive window or web page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from dermis.base.console import note, print_lines, working_on
from dermis.base.errors import refuse
from dermis.cli.options import Adapter, Integer
from dermis.cli.scene_options import DEFAULTS, SceneOptions, assemble_scene

if TYPE_CHECKING:
    from dermis.apps.viewer.player import MotionFile
    from dermis.apps.viewer.state import ViewerState

_HOST, _PORT, _WINDOW = "127.0.0.1", 8765, (1280, 800)
_SOFTWARE_ATLAS = 1024  # a still frame of the usual one takes a processor several seconds


def view(
    head: str = "human",
    /,
    *,
    browser: bool = False,
    port: Integer = None,
    host: str | None = None,
    token: Annotated[bool, Parameter(negative="")] = False,
    motion: str | None = None,
    motion_fps: float | None = None,
    scene: SceneOptions = DEFAULTS,
    adapter: Adapter = "auto",
) -> int:
    """Turn a head, its skin and its light in a window or in a web page.

    Drag to turn, right drag to pan, wheel to zoom, double click to turn around a place, Shift-drag
    to move the light. Keys 1 to 5 are the camera presets, Space plays and pauses a motion, Tab hides
    the panel, ? shows all keys, Ctrl+Z and Ctrl+Y undo and redo. The panel saves the scene as a TOML file
    that `dermis render` takes. The options are those of `dermis render`; --size is the window's, 1280x800
    when left out.

    Examples
    --------
        dermis view lee_perry_smith --env royal_esplanade

        dermis view scene.toml --browser --port 8080

        dermis view person.glb --motion take.csv

    Parameters
    ----------
    head:
        human, the head of the package, a sample, a mesh file, or a scene in TOML.
    browser:
        Serve a web page instead of opening a window, for machines without a screen. It is there at once, and
        tells what is being prepared.
    port:
        Where the page is served; 0 for any that is free [8765].
    host:
        Address to listen at; others than this machine's own need the token of the printed URL [127.0.0.1].
    token:
        Ask for a token on this machine too: for one with other users, and behind a proxy.
    motion:
        Play a motion: a glTF file's clip (file.glb, or file.glb#clip), a CSV of Live Link Face, lines of JSON
        of MediaPipe, or meshes of one topology (a folder, face_%05d.obj).
    motion_fps:
        Frames a second of the motion, where its file does not tell.
    """
    if not browser:
        for option, value in {"port": port, "host": host, "token": token or None}.items():
            if value is not None:
                refuse(f"--{option}", "a web page with it", "there is none", "Add --browser")
    if port is not None and not 0 <= port < 1 << 16:
        refuse("--port", "a number from 0 to 65535", f"{port} came", "Choose another")
    if motion_fps is not None and motion is None:
        refuse("--motion-fps", "a motion with it", "there is none", "Add --motion")
    from dermis.apps.viewer.windows import serve, show_window

    def load() -> tuple[ViewerState, MotionFile | None]:
        state = _state(head, scene, adapter)
        return state, _motion(motion, motion_fps, state)

    window = scene.settings.get("size", _WINDOW)
    if browser:
        serve(load, adapter, window, host or _HOST, _PORT if port is None else port, _print_url, secret=token)
    else:
        with working_on("loading"):
            state, played = load()
        show_window(state, adapter, window, motion=played)
    return 0


def _state(name: str, given: SceneOptions, adapter: str) -> ViewerState:
    """The scene that the options describe."""
    from dermis.apps.viewer.state import opened
    from dermis.gpu.adapters import select_adapters
    from dermis.scene.files import head_table, with_whole_names

    is_scene = Path(name).suffix.lower() == ".toml"
    scene, settings = assemble_scene(name, given)
    if "atlas" not in given.settings and not is_scene and select_adapters(adapter)[0][0].kind == "CPU":
        settings = settings.model_copy(update={"atlas": _SOFTWARE_ATLAS})
    table = head_table(Path(name)) if is_scene else with_whole_names({"name": name} | given.head, Path())
    usual = "" if is_scene else "none" if "name" in given.around else "studio"
    return opened(scene, settings, table, usual if given.lights is None else given.lights)


def _motion(file: str | None, fps: float | None, state: ViewerState) -> MotionFile | None:
    """The motion for the head, read before a window opens."""
    if file is None:
        return None
    from dermis.apps.viewer.player import MotionFile

    motion = MotionFile(file, fps)
    if text := motion.clip(state.scene.head).note:
        note(text)
    return motion


def _print_url(url: str, exposed: bool) -> None:
    if exposed:
        note("warning: other machines can reach this page; who knows its address controls the viewer")
        note("warning: the connection is not encrypted: use it in a network that you trust, or a tunnel")
    print_lines(f"{url}  (Ctrl+C ends it)")
