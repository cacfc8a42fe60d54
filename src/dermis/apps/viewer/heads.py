"""Other heads: opened in a thread, so that the picture goes on meanwhile."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from dermis.apps.viewer.state import ViewerState, load_state
from dermis.base.errors import DermisError
from dermis.formats.samples import SAMPLES, cached
from dermis.mesh.head import Head
from dermis.scene.heads import HUMAN, load_head

HEAD_FILES = (".glb", ".obj", ".ply", ".json", ".toml")
"""What a file that a page sends may end in: meshes, people, scenes."""

_MOST_RECENT = 8
Opened = Head | ViewerState


class Heads:
    """What the viewer can show, and what it is opening.

    recent : paths of files opened, the last one first
    wake : called from another thread when the next frame is to take what was opened
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
        """What is being opened, empty for nothing."""
        return f"opening {self.called(self._name)} ..." if self._coming else ""

    def called(self, name: str) -> str:
        """A head's name as people read it: a file's without its folder."""
        return Path(self.sent_as(name)).name

    def sent_as(self, name: str) -> str:
        """What the page that sent a file calls it; the name itself for others."""
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
        """The state with what was opened in it, once; None while there is nothing.

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
    """The state with another head in the same light, posed as before where it has the same names."""
    old = state.scene.head
    alike = old.targets == head.targets and old.bones == head.bones
    pose = state.scene.pose if alike else None
    kept = pose if pose is None or pose.positions_mm is None else None
    return replace(state, scene=replace(state.scene, head=head, pose=kept), head={"name": name})


@lru_cache(maxsize=1)
def built_in() -> tuple[str, ...]:
    """Names of the heads that are there without a file or a download."""
    samples = (name for name, sample in SAMPLES.items() if sample.kind == "head" and cached(name))
    return (HUMAN, *samples)
