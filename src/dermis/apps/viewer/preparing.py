"""What takes long before the first picture of another head, made in a thread while the last picture stays."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

from dermis.apps.viewer.state import ViewerState
from dermis.apps.viewer.studio import Studio, copied
from dermis.mesh.mesh import Mesh

T = TypeVar("T")


class Preparation:
    """Prepares heads one after the other; meanwhile a studio draws nothing else.

    wake : called from another thread when the next frame may draw
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._ready: Mesh | None = None  # with other maps it takes little more than a frame
        self._coming: Future[None] | None = None
        self._next: Mesh | None = None
        self._kept: Any = None

    @property
    def is_running(self) -> bool:
        """Whether a head is being prepared, or a frame is to take it."""
        return self._coming is not None

    def forget(self) -> None:
        """Leave what was begun, for another studio."""
        self._ready = self._coming = self._next = self._kept = None

    def picture(self, studio: Studio, state: ViewerState) -> Any:
        """The last picture while the head of a state is prepared; None when the state may be drawn.

        Raises what stopped the preparation, once.
        """
        if self._coming is not None:
            if not self._coming.done():
                return self._kept
            coming, self._coming, self._kept = self._coming, None, None
            self._ready = self._next
            coming.result()
        mesh = state.scene.head.mesh
        if studio.last_image is None or mesh is self._ready:
            self._ready = mesh
            return None
        self._kept = copied(studio.renderer.device, studio.last_image)
        self._next, studio.is_preparing = mesh, True
        self._coming = begun(lambda: studio.prepare(state))
        self._coming.add_done_callback(lambda _: self._wake())
        return self._kept


def begun(work: Callable[[], T]) -> Future[T]:
    """What `work` returns, made in a thread for which an interpreter that ends does not wait."""
    coming: Future[T] = Future()
    coming.set_running_or_notify_cancel()

    def run() -> None:
        try:
            coming.set_result(work())
        except Exception as error:
            coming.set_exception(error)

    threading.Thread(target=run, name="preparing", daemon=True).start()
    return coming
