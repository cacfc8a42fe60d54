"""Viewing session: the state, controls, player and renderer that the viewer's window and panel share."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from dermis.apps.viewer.controls import Controls, SplitView
from dermis.apps.viewer.heartbeat import Heartbeat
from dermis.apps.viewer.player import MotionFile, MotionPlayer
from dermis.apps.viewer.state import (
    LIGHT_COMPONENT_VIEWS,
    PICTURE_VIEW_NAME,
    UndoHistory,
    ViewerState,
    load_state,
    save_state,
)
from dermis.apps.viewer.view_renderer import ViewRenderer
from dermis.base.errors import DermisError, refuse
from dermis.formats.samples import SAMPLES, is_available
from dermis.mesh.head import Head
from dermis.scene.files import load_head_and_skin
from dermis.scene.head_table import AUTO, HeadTable
from dermis.scene.heads import HUMAN, load_head
from dermis.scene.skin import Skin

HEAD_FILE_SUFFIXES = (".glb", ".vrm", ".usdz", ".obj", ".ply", ".stl", ".json", ".toml")
"""Suffixes of files that a page may upload: meshes, people and scenes."""

_MAX_RECENT_HEADS = 8
LoadedHeadOrScene = Head | ViewerState


class HeadLoader:
    """Loader of heads in a background thread, so that the picture stays interactive.

    recent : paths of opened files, the most recent first
    request_frame : function that requests a frame, called from another thread when a head has been loaded
    """

    def __init__(self) -> None:
        self.recent: list[str] = []
        self.request_frame: Callable[[], None] = lambda: None
        self._original_names: dict[str, str] = {}  # original names of uploaded files, by path
        self._executor = ThreadPoolExecutor(1, "head")
        self._future: Future[LoadedHeadOrScene] | None = None
        self._name = ""

    @property
    def loading_message(self) -> str:
        """Return a message that names the head being loaded; empty if no head is being loaded."""
        return f"opening {self.display_name(self._name)} ..." if self._future else ""

    def display_name(self, name_or_path: str) -> str:
        """Return the name of a head for display; for a file, the file name without its folder."""
        return Path(self.uploaded_name(name_or_path)).name

    def uploaded_name(self, name_or_path: str) -> str:
        """Return the original name of an uploaded file, given its path; return other names unchanged."""
        return self._original_names.get(name_or_path, name_or_path)

    def open(self, name_or_path: str, original_name: str = "") -> None:
        """Load a head or a scene in the background, and cancel earlier requests that have not started.

        name_or_path : name of a built-in head or sample, or path of a mesh or scene file
        original_name : original name of an uploaded file
        """
        if self._future:
            self._future.cancel()
        self._name = str(Path(name_or_path).resolve()) if Path(name_or_path).is_file() else name_or_path
        if original_name:
            self._original_names[self._name] = original_name
        self._future = self._executor.submit(_load_head_or_scene, self._name)
        self._future.add_done_callback(lambda _: self.request_frame())

    def take_loaded_state(self, state: ViewerState) -> ViewerState | None:
        """Return the state with a newly loaded head or scene; None if none was loaded since the last call.

        state : current state; a loaded head replaces the head of this state, a loaded scene the whole state

        Raises DermisError if the head cannot be loaded.
        """
        if self._future is None or not self._future.done():
            return None
        future, self._future = self._future, None
        try:
            loaded = future.result()
        except DermisError as error:
            raise DermisError(str(error).replace(self._name, self.display_name(self._name))) from error
        if Path(self._name).is_file():
            self.recent = [self._name, *(path for path in self.recent if path != self._name)][
                :_MAX_RECENT_HEADS
            ]
        return loaded if isinstance(loaded, ViewerState) else _with_head(state, loaded, self._name)


def _load_head_or_scene(name_or_path: str) -> LoadedHeadOrScene:
    return (
        load_state(Path(name_or_path))
        if Path(name_or_path).suffix.lower() == ".toml"
        else load_head(name_or_path)
    )


def _with_head(state: ViewerState, head: Head, head_name: str) -> ViewerState:
    """Return the state with another head.

    The pose is kept if both heads have the same morph targets and bones, unless it contains vertex positions.

    head_name : name or path from which the new head was loaded
    """
    old_head = state.scene.head
    same_names = old_head.targets == head.targets and old_head.bones == head.bones
    pose = state.scene.pose if same_names else None
    reused_pose = pose if pose is None or pose.positions_mm is None else None
    return replace(state, scene=replace(state.scene, head=head, pose=reused_pose), head={"name": head_name})


@lru_cache(maxsize=1)
def built_in_heads() -> tuple[str, ...]:
    """Return the names of heads that need neither a file nor a download."""
    samples = (name for name, sample in SAMPLES.items() if sample.kind == "head" and is_available(name))
    return (HUMAN, *samples)


_MAX_ERROR_CHARACTERS = 160
_LOGGER = logging.getLogger(__name__)


class Session:
    """Viewing session: undo history, controls, motion player and renderer.

    motion : motion to play; None if there is no motion
    clock : function that returns the time [s]

    split : before/after comparison
    status : message about the graphics adapter, shown over the picture
    message : message about the last action, shown over the picture
    scene_file : file name of the scene, typed in the panel
    picture_file : file name of screenshots, typed in the panel
    picture_size : size of screenshots; (0, 0) for the size of the view [pixel]
    view_size : size of the view [pixel]
    heads : loader of heads in the background
    head_file : file name of a head, typed in the panel
    request_file : function that asks a web page to upload a file; None if the user types a path in the panel
        instead
    offer_download : function that sends the name and bytes of a file to a web page; None if files are written
        to paths instead
    motion_file : file name of a motion, typed in the panel
    search : text typed in the panel; only morph targets and bones whose names contain it are listed
    positions : positions of the panel's controls in the window, by label
    """

    def __init__(
        self,
        state: ViewerState,
        view_renderer: ViewRenderer,
        motion: MotionFile | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.history = UndoHistory(state)
        self.player = MotionPlayer(self.history, motion, clock)
        self.heartbeat = Heartbeat(clock)
        self.controls = Controls(self.history, lambda: self.displayed_state)
        self.view_renderer = view_renderer
        self.split = SplitView()
        self.status = self.message = ""
        self.scene_file, self.picture_file = "scene.toml", "dermis.png"
        self.picture_size = self.view_size = 0, 0
        self.heads, self.head_file = HeadLoader(), ""
        self.request_file: Callable[[], None] | None = None
        self.offer_download: Callable[[str, bytes], None] | None = None
        self.motion_file, self.search = motion.path if motion else "", ""
        self.positions: dict[str, tuple[float, float]] = {}
        self._reported_errors: set[str] = set()

    @property
    def state(self) -> ViewerState:
        """Return the current state of the undo history."""
        return self.history.state

    @property
    def displayed_state(self) -> ViewerState:
        """Return the state on screen: the current state with the motion that plays and the pulse."""
        return self.heartbeat.displayed(self.player.displayed_state)

    @property
    def is_playing(self) -> bool:
        """Return whether the picture changes with time, by a motion or the pulse."""
        return self.player.is_playing or self.heartbeat.is_running(self.state)

    def change(self, state: ViewerState, gesture_name: str = "") -> None:
        """Set a new state as a step of the undo history.

        gesture_name : name of the gesture; consecutive changes by one gesture are undone together
        """
        self.history.change(state, gesture_name)
        self.message = ""

    def report_error(self, failure_text: str, error: Exception) -> None:
        """Report an unexpected error once, as text over the picture and with its traceback in the log.

        failure_text : what cannot be done, such as "The head cannot be opened"
        """
        message = f"{failure_text} ({type(error).__name__}: {_shorten_message(str(error))})"
        if message not in self._reported_errors:
            self._reported_errors.add(message)
            self.message = message
            _LOGGER.error(message, exc_info=error)

    def save(self, path: Path) -> None:
        """Write the displayed state to a scene file, or offer the file as a download.

        Raises DermisError if the state cannot be saved.
        """
        state = self.displayed_state
        if "name" in state.head:  # the scene refers to an uploaded file by its original name
            name = self.heads.uploaded_name(str(state.head["name"]))
            state = replace(state, head={**state.head, "name": name})
        self._write_or_offer_download(path, lambda target: save_state(target, state))
        self.message = f"saved {path}"

    def load(self, path: Path) -> None:
        """Replace the state with the state in a scene file.

        Raises DermisError if the file is not a scene.
        """
        state = load_state(path, self.state)
        self.player.stop()
        self.change(state)
        self.message = f"loaded {path}"

    def show_loaded_head(self) -> None:
        """Show the head that was loaded in the background, or the reason why it cannot be loaded."""
        try:
            state = self.heads.take_loaded_state(self.state)
        except DermisError as error:
            self.message = str(error)
            return
        except Exception as error:
            self.report_error("The head cannot be opened", error)
            return
        if state is not None:
            self.player.stop()
            self.change(state)

    def open_motion(self, motion_path: str) -> None:
        """Open a motion file and play it.

        Raises DermisError if the file cannot be read, or if the motion moves no morph target or bone of the
        head.
        """
        self.player.open(MotionFile(motion_path))
        self.message = f"opened {motion_path}"

    def screenshot(self, picture_path: Path, picture_size: tuple[int, int]) -> None:
        """Write the displayed view as .png (tone-mapped) or .exr (linear), or offer the file as a download.

        picture_size : width and height of the picture [pixel]

        Raises DermisError if the picture cannot be rendered or written.
        """
        suffix, view = picture_path.suffix.lower(), self.displayed_state.view
        if suffix not in (".png", ".exr"):
            refuse(
                f"picture {picture_path}",
                "a name that ends in .png or .exr",
                f"got {picture_path.name!r}",
                "Rename it",
            )
        if suffix == ".exr" and view not in (PICTURE_VIEW_NAME, *LIGHT_COMPONENT_VIEWS):
            refuse(f"view {view} as .exr", "a view of linear light", "it shows display colours", "Use .png")
        self._write_or_offer_download(
            picture_path,
            lambda target: self.view_renderer.screenshot(target, self.displayed_state, picture_size),
        )
        self.message = f"wrote {picture_path}, {picture_size[0]} x {picture_size[1]}"

    def _write_or_offer_download(self, path: Path, write_file: Callable[[Path], None]) -> None:
        if self.offer_download is None:
            write_file(path)
            return
        with TemporaryDirectory(prefix="dermis-") as folder:
            target = Path(folder) / path.name
            write_file(target)
            self.offer_download(path.name, target.read_bytes())


def _shorten_message(message: str) -> str:
    line = " ".join(message.split())
    return line if len(line) <= _MAX_ERROR_CHARACTERS else f"{line[:_MAX_ERROR_CHARACTERS]} ..."


def with_region_table(
    state: ViewerState, table_name: str, known_states: Iterable[ViewerState] = ()
) -> ViewerState:
    """Return the state with roughness and specular maps that a table of face regions defines.

    table_name : name or file of the table; "auto" for the package's table if the regions of the head are
        known; "none" for no such maps
    known_states : states whose heads are reused if they already have these maps

    Raises DermisError for heads without known regions and for heads created in memory.
    """
    if not state.head:
        expected = "a head from a file or a sample"
        refuse("regions", expected, "it was created in memory", "Write it to a file first")
    table = {key: value for key, value in state.head_table.items() if key != "regions"}
    if table_name != AUTO:
        table["regions"] = table_name
    for other in known_states:
        if dict(other.head_table) == table:
            return state.with_head(other.scene.head, table, other.scene.skin.rho_s)
    head, skin = load_head_and_skin(HeadTable(**table), Skin(), Path())
    return state.with_head(head, table, skin.rho_s)
