"""A viewing session: everything of the viewer except its window, shared by input and panel."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

from dermis.apps.viewer.controls import Controls, Split
from dermis.apps.viewer.player import MotionFile, Player
from dermis.apps.viewer.state import PARTS, PICTURE, History, ViewerState, load_state, save_state
from dermis.apps.viewer.studio import Studio
from dermis.base.errors import DermisError, refuse
from dermis.formats.samples import SAMPLES, cached
from dermis.mesh.head import Head
from dermis.scene.files import head_and_skin
from dermis.scene.head_table import AUTO, HeadTable
from dermis.scene.heads import HUMAN, load_head
from dermis.scene.skin import Skin

HEAD_FILES = (".glb", ".obj", ".ply", ".json", ".toml")
"""Suffixes of files that a page may send: meshes, people, scenes."""

_MOST_RECENT = 8
Opened = Head | ViewerState


class Heads:
    """Heads that the viewer can show, opened in a thread while the picture goes on.

    recent : paths of files opened, the last one first
    wake : called from another thread when a head was opened for the next frame
    """

    def __init__(self) -> None:
        self.recent: list[str] = []
        self.wake: Callable[[], None] = lambda: None
        self._names: dict[str, str] = {}  # of files that pages have sent, by path
        self._thread = ThreadPoolExecutor(1, "head")
        self._coming: Future[Opened] | None = None
        self._name = ""

    @property
    def note(self) -> str:
        """Message about the head that is being opened, empty for none."""
        return f"opening {self.called(self._name)} ..." if self._coming else ""

    def called(self, name: str) -> str:
        """Return a head's name as people read it: a file's without its folder."""
        return Path(self.sent_as(name)).name

    def sent_as(self, name: str) -> str:
        """Return the name that the page that sent a file gave it; the name itself for others."""
        return self._names.get(name, name)

    def open(self, name: str, called: str = "") -> None:
        """Begin to open a head or a scene; one that was begun before is dropped.

        called : by the page that sent it, where its path says nothing
        """
        if self._coming:
            self._coming.cancel()
        self._name = str(Path(name).resolve()) if Path(name).is_file() else name
        if called:
            self._names[self._name] = called
        self._coming = self._thread.submit(_read, self._name)
        self._coming.add_done_callback(lambda _: self.wake())

    def take(self, state: ViewerState) -> ViewerState | None:
        """Return the state with the opened head, once; None while there is none.

        Raises DermisError for what cannot be opened.
        """
        if self._coming is None or not self._coming.done():
            return None
        coming, self._coming = self._coming, None
        try:
            opened = coming.result()
        except DermisError as error:
            raise DermisError(str(error).replace(self._name, self.called(self._name))) from error
        if Path(self._name).is_file():
            self.recent = [self._name, *(one for one in self.recent if one != self._name)][:_MOST_RECENT]
        return opened if isinstance(opened, ViewerState) else _with_head(state, opened, self._name)


def _read(name: str) -> Opened:
    return load_state(Path(name)) if Path(name).suffix.lower() == ".toml" else load_head(name)


def _with_head(state: ViewerState, head: Head, name: str) -> ViewerState:
    """Return the state with another head in the same light, posed as before where it has the same names."""
    old = state.scene.head
    alike = old.targets == head.targets and old.bones == head.bones
    pose = state.scene.pose if alike else None
    kept = pose if pose is None or pose.positions_mm is None else None
    return replace(state, scene=replace(state.scene, head=head, pose=kept), head={"name": name})


@lru_cache(maxsize=1)
def built_in() -> tuple[str, ...]:
    """Return names of the heads that need neither a file nor a download."""
    samples = (name for name, sample in SAMPLES.items() if sample.kind == "head" and cached(name))
    return (HUMAN, *samples)


_LONGEST_REASON = 160
_log = logging.getLogger(__name__)


class Session:
    """The undo history, the controls and the player that change it, and the studio that draws its state.

    motion : what the player plays, None for nothing
    clock : time [s]

    split : the before/after comparison
    status, message : text over the picture: the adapter's state, and the result of the last action
    scene_file, picture_file : what the panel's buttons write
    picture_size, view_size : of a screenshot, (0, 0) for that of the view; and of the view [pixel]
    heads, head_file : what opens other heads, and the file that it is to open
    ask_for_file : asks a page for a file; None where files have paths
    offer : takes name and bytes of a file that a page offers as a download; None where files are written
    motion_file, search : what is opened, and which expressions the panel shows
    positions : of the panel's controls in the window, by label
    """

    def __init__(
        self,
        state: ViewerState,
        studio: Studio,
        motion: MotionFile | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.history = History(state)
        self.player = Player(self.history, motion, clock)
        self.controls = Controls(self.history, lambda: self.shown)
        self.studio = studio
        self.split = Split()
        self.status = self.message = ""
        self.scene_file, self.picture_file = "scene.toml", "dermis.png"
        self.picture_size = self.view_size = 0, 0
        self.heads, self.head_file = Heads(), ""
        self.ask_for_file: Callable[[], None] | None = None
        self.offer: Callable[[str, bytes], None] | None = None
        self.motion_file, self.search = motion.path if motion else "", ""
        self.positions: dict[str, tuple[float, float]] = {}
        self._faults: set[str] = set()

    @property
    def state(self) -> ViewerState:
        """The current state."""
        return self.history.state

    @property
    def shown(self) -> ViewerState:
        """The current state, moved while a motion plays: what is seen, saved and frozen."""
        return self.player.shown

    def change(self, state: ViewerState, gesture: str = "") -> None:
        """Go to a new state; changes with the same gesture are undone together."""
        self.history.change(state, gesture)
        self.message = ""

    def tell_fault(self, what: str, error: Exception) -> None:
        """Report an unexpected error once: over the picture, and with its traceback in the log."""
        said = f"{what} ({type(error).__name__}: {_shortened(str(error))})"
        if said not in self._faults:
            self._faults.add(said)
            self.message = said
            _log.error(said, exc_info=error)

    def save(self, path: Path) -> None:
        """Write the scene file, or offer it as a download.

        Raises DermisError when that is not possible.
        """
        shown = self.shown
        if "name" in shown.head:  # a file that a page has sent is to lie beside the scene
            shown = replace(shown, head={**shown.head, "name": self.heads.sent_as(str(shown.head["name"]))})
        self._write(path, lambda target: save_state(target, shown))
        self.message = f"saved {path}"

    def load(self, path: Path) -> None:
        """Open a scene file.

        Raises DermisError for a file that is not a scene.
        """
        state = load_state(path, self.state)
        self.player.stop()
        self.change(state)
        self.message = f"loaded {path}"

    def take_head(self) -> None:
        """Show the head that was opened meanwhile, if there is one, or the reason why it cannot be opened."""
        try:
            state = self.heads.take(self.state)
        except DermisError as error:
            self.message = str(error)
            return
        except Exception as error:
            self.tell_fault("That cannot be opened", error)
            return
        if state is not None:
            self.player.stop()
            self.change(state)

    def open_motion(self, path: str) -> None:
        """Play the motion of a file.

        Raises DermisError for one that cannot be read and for one of which the head has no name.
        """
        self.player.open(MotionFile(path))
        self.message = f"opened {path}"

    def screenshot(self, path: Path, size: tuple[int, int]) -> None:
        """Write the picture at any size, or offer it as a download: .png with the tone curve or .exr, linear.

        Raises DermisError when that is not possible.
        """
        kind, view = path.suffix.lower(), self.shown.view
        if kind not in (".png", ".exr"):
            refuse(f"picture {path}", "a name that ends in .png or .exr", f"{path.name!r} came", "Change it")
        if kind == ".exr" and view not in (PICTURE, *PARTS):
            refuse(f"view {view} as .exr", "a view of linear light", "its numbers are colours", "Take .png")
        self._write(path, lambda target: self.studio.screenshot(target, self.shown, size))
        self.message = f"wrote {path}, {size[0]} x {size[1]}"

    def _write(self, path: Path, write: Callable[[Path], None]) -> None:
        if self.offer is None:
            write(path)
            return
        with TemporaryDirectory(prefix="dermis-") as folder:
            target = Path(folder) / path.name
            write(target)
            self.offer(path.name, target.read_bytes())


def _shortened(text: str) -> str:
    line = " ".join(text.split())
    return line if len(line) <= _LONGEST_REASON else f"{line[:_LONGEST_REASON]} ..."


def apply_regions(state: ViewerState, name: str, known: Iterable[ViewerState] = ()) -> ViewerState:
    """Return the state with the maps of a table of face regions, or without them.

    name : of the table, "auto" or "none"
    known : states whose heads are reused when they already have these maps

    Raises DermisError for heads whose regions are not known and for heads made in memory.
    """
    if not state.head:
        refuse(
            "regions", "a head from a file or a sample", "it was made in memory", "Write it to a file first"
        )
    wanted = {key: value for key, value in state.table.items() if key != "regions"}
    if name != AUTO:
        wanted["regions"] = name
    for other in known:
        if dict(other.table) == wanted:
            return state.with_head(other.scene.head, wanted, other.scene.skin.rho_s)
    head, skin = head_and_skin(HeadTable(**wanted), Skin(), Path())
    return state.with_head(head, wanted, skin.rho_s)
