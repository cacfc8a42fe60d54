"""One HTML file with a head: what it may load stands in it, and words of users stay words."""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Mapping, Sequence
from importlib import resources
from string import Template
from typing import Any

from dermis.apps.export.inlining import hash_of, inline
from dermis.apps.export.targets.web_library import Script

Json = Mapping[str, Any]
_NONE = "default-src 'none'; base-uri 'none'; form-action 'none'"
_MADE = "img-src blob: data:; connect-src blob: data:"  # textures of the head's file


def page(
    *, title: str, note: str, settings: Json, head: bytes, draw: str, libraries: str, sources: Sequence[str]
) -> str:
    """The text of the page.

    draw : name of the script that draws
    libraries : elements that load or hold the library
    sources : what else scripts may come from, as in a Content-Security-Policy
    """
    script, style = inline(_text("panel.js") + _text(draw)), _text("page.css")
    allowed = " ".join([hash_of(script), *sources])
    return Template(_text("page.html")).substitute(
        policy=html.escape(f"{_NONE}; {_MADE}; style-src {hash_of(style)}; script-src {allowed}"),
        title=html.escape(title),
        note=html.escape(note),
        style=style,
        script=script,
        settings=json_text(settings),
        head=base64.b64encode(head).decode(),
        libraries=libraries,
    )


def json_text(value: Json) -> str:
    """JSON that no element of HTML begins or ends in."""
    told = json.dumps(value, ensure_ascii=True)
    return told.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def linked(script: Script) -> str:
    """An element that loads a script, if it is the one that it was."""
    return f'<script src="{script.url}" integrity="{script.integrity}" crossorigin="anonymous"></script>'


def _text(name: str) -> str:
    return (resources.files("dermis.apps.export") / "pages" / name).read_text("utf-8")
