"""rendercanvas' widget for notebooks, which can be closed and follows its size at once."""

from __future__ import annotations

from typing import Any

from rendercanvas.anywidget import AnywidgetRenderCanvas


class CellCanvas(AnywidgetRenderCanvas):  # type: ignore[misc]
    """A canvas that a notebook's cell shows."""

    def _rfb_handle_msg(self, widget: Any, content: dict[str, Any], buffers: list[Any]) -> None:
        kind = content.get("type")
        super()._rfb_handle_msg(widget, content, buffers)
        if kind == "resize":
            self.request_draw()  # else a cell of another size would wait until something moves

    def _rc_close(self) -> None:
        if not self.get_closed():  # the base class closes itself without end
            self._is_closed = True
            super()._rc_close()
