"""Sphinx extension that replaces the first picture of the front page by an interactive head."""

from __future__ import annotations

from pathlib import Path
from typing import Any

FILE = "head.html"
_STYLE = "width:100%;aspect-ratio:4/3;border:0;background:#000"


def turning(text: str, head: str) -> str:
    """Return the text of the front page with an embedded web page in place of its first picture.

    head : name of the head; "" keeps the picture
    """
    if not head:
        return text
    begin = text.index("![")
    end = text.index("\n", begin)
    frame = f'<iframe src="{FILE}" title="Interactive head" loading="lazy" style="{_STYLE}"></iframe>'
    caption = "Drag to rotate the head ([about this page](web.md)). Without WebGPU it is a still picture."
    return f"{text[:begin]}```{{raw}} html\n{frame}\n```\n\n{caption}{text[end:]}"


def setup(app: Any) -> dict[str, bool]:
    """Register the extension; Sphinx calls this function.

    `-D turning_head=` omits the head, whose export takes half a minute.
    """
    app.add_config_value("turning_head", "human", "env")
    app.connect("source-read", _read)
    app.connect("build-finished", _finished)
    return {"parallel_read_safe": True}


def _read(app: Any, page: str, source: list[str]) -> None:
    if page == "index" and app.builder.format == "html":
        source[0] = turning(source[0], app.config.turning_head)


def _finished(app: Any, fault: Exception | None) -> None:
    head = app.config.turning_head
    if fault is None and head and app.builder.format == "html":
        from dermis.apps.export.run import export_skin

        export_skin(head, "web", Path(app.outdir) / FILE)
