"""The command `dermis view`: a head in an interactive window or web page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dermis.base.console import print_lines, print_note, spinner
from dermis.base.errors import refuse
from dermis.cli.options import AdapterOption, FlagOption, IntegerOption
from dermis.cli.scene_options import DEFAULT_RIG, DEFAULT_SCENE_OPTIONS, SceneOptions, assemble_scene

if TYPE_CHECKING:
    from dermis.apps.viewer.player import MotionFile
    from dermis.apps.viewer.state import ViewerState

_DEFAULT_HOST, _DEFAULT_PORT, _DEFAULT_WINDOW_SIZE = "127.0.0.1", 8765, (1280, 800)
_ATLAS_SIDE_ON_CPU = 1024  # a still frame with the default atlas takes several seconds on a CPU


def view(
    head: str = "human",
    /,
    *,
    browser: bool = False,
    port: IntegerOption = None,
    host: str | None = None,
    token: FlagOption = False,
    motion: str | None = None,
    motion_fps: float | None = None,
    scene: SceneOptions = DEFAULT_SCENE_OPTIONS,
    adapter: AdapterOption = "auto",
) -> int:
    """Show a head in an interactive window or web page.

    Drag to rotate, right-drag to pan, scroll to zoom, double-click to set the centre of rotation, and
    Shift-drag to move the light. Keys 1 to 7 select camera presets, Space plays and pauses a motion, Tab
    hides the panel, Ctrl+Z and Ctrl+Y undo and redo, and ? shows all keys. The panel can save the scene as a
    TOML file for `dermis render`. All other options are those of `dermis render`, but --size is the size of
    the window [default: 1280x800].

    Examples:

        dermis view lee_perry_smith --env royal_esplanade

        dermis view scene.toml --browser --port 8080

        dermis view person.glb --motion take.csv

    Parameters
    ----------
    head:
        human (the head of the package), a sample, a mesh file or a scene (.toml).
    browser:
        Serve a web page instead of opening a window, for machines without a screen. Until the first picture
        is ready, the page shows the progress.
    port:
        Port of the web page; 0 for any free port. [default: 8765]
    host:
        Address to listen on; if other machines can reach it, visitors need the token in the printed URL.
        [default: 127.0.0.1]
    token:
        Require the token on this machine too, for machines that several users share or that are behind a
        proxy.
    motion:
        Motion to play: a clip of a glTF file (file.glb or file.glb#clip), a .csv of Live Link Face, a .json
        of MediaPipe, or a sequence of meshes (a folder, or face_%05d.obj).
    motion_fps:
        Frame rate of a mesh sequence, or of a motion file that has no times or only timecodes [1/s].
    """
    if not browser:
        for option, value in {"port": port, "host": host, "token": token or None}.items():
            if value is not None:
                refuse(f"--{option}", "the option --browser", "it is missing", "Add --browser")
    if port is not None and not 0 <= port < 1 << 16:
        refuse("--port", "a number from 0 to 65535", f"got {port}", "Choose another")
    if motion_fps is not None and motion is None:
        refuse("--motion-fps", "the option --motion", "it is missing", "Add --motion FILE")
    from dermis.apps.viewer.windows import serve, show_window

    def load_state_and_motion() -> tuple[ViewerState, MotionFile | None]:
        state = _initial_state(head, scene, adapter)
        return state, _load_motion(motion, motion_fps, state)

    window = scene.settings.get("size", _DEFAULT_WINDOW_SIZE)
    if browser:
        address = host or _DEFAULT_HOST, _DEFAULT_PORT if port is None else port
        serve(load_state_and_motion, adapter, window, *address, _print_url, require_token=token)
    else:
        with spinner("loading"):
            state, motion_clip = load_state_and_motion()
        show_window(state, adapter, window, motion=motion_clip)
    return 0


def _initial_state(head_or_scene: str, options: SceneOptions, adapter: str) -> ViewerState:
    """Return the initial state of the viewer for a head or scene file and the command line options."""
    from dermis.apps.viewer.state import initial_state
    from dermis.gpu.adapters import select_adapters
    from dermis.scene.files import head_table, with_absolute_paths

    is_scene = Path(head_or_scene).suffix.lower() == ".toml"
    scene, settings = assemble_scene(head_or_scene, options)
    if "atlas" not in options.settings and not is_scene and select_adapters(adapter)[0][0].kind == "CPU":
        settings = settings.model_copy(update={"atlas": _ATLAS_SIDE_ON_CPU})
    table = (
        head_table(Path(head_or_scene))
        if is_scene
        else with_absolute_paths({"name": head_or_scene} | options.head, Path())
    )
    preset = "" if is_scene else "none" if "name" in options.environment else DEFAULT_RIG
    return initial_state(scene, settings, table, preset if options.lights is None else options.lights)


def _load_motion(motion_path: str | None, fps: float | None, viewer_state: ViewerState) -> MotionFile | None:
    """Load the motion file for the head, before the window opens; return None if no file is named."""
    if motion_path is None:
        return None
    from dermis.apps.viewer.player import MotionFile

    motion = MotionFile(motion_path, fps)
    if text := motion.load_clip(viewer_state.scene.head).note:
        print_note(text)
    return motion


def _print_url(url: str, is_reachable_by_others: bool) -> None:
    if is_reachable_by_others:
        print_note("warning: other machines can reach this page; whoever knows its URL controls the viewer")
        print_note("warning: the connection is not encrypted: use a trusted network or a tunnel")
    print_lines(f"{url}  (Ctrl+C to stop)")
