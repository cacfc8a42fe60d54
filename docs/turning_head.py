"""The front page turns a head: in its picture's place is a page that draws it, made when the pages are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

FILE = "head.html"
_STYLE = "width:100%;aspect-ratio:4/3;border:0;background:#000"


def turning(text: str, head: str) -> str:
    """Return the front page with the page of the turning head in place of its first picture.

    head : "" leaves the picture
    """
    if not head:
        return text
    begin = text.index("![")
    end = text.index("\n", begin)
    frame = f'<iframe src="{FILE}" title="A head to turn" loading="lazy" style="{_STYLE}"></iframe>'
    told = "Drag to turn it; [how this page is made](web.md). Without WebGPU it is a still picture."
    return f"{text[:begin]}```{{raw}} html\n{frame}\n```\n\n{told}{text[end:]}"


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this. `-D turning_head=` leaves the head out, which takes half a minute to make."""
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
