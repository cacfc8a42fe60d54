"""One HTML file that holds a head, and what plays it."""

from __future__ import annotations

import base64
import gzip
import html
import io
import json
import re
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.pages.html import hash_of, inline
from dermis.apps.export.targets.web.build import Built
from dermis.apps.export.targets.web.dials import Dial
from dermis.apps.export.targets.web.packing import seven_bits

MODULES = (
    "graph",
    "packed",
    "device",
    "player",
    "maps",
    "camera",
    "turned",
    "screen",
    "mixing",
    "hands",
    "page",
)
"""Of the player, each after those that it imports."""
_NONE = "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:"
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def web_page(built: Built, dials: tuple[Dial, ...], title: str, note: str) -> str:
    """The text of the page.

    title, note : words of users among them are escaped
    """
    script, style = inline(player()), _text("page.css")
    told = {
        "forms": built.forms,
        "blobs": built.packer.runs,
        "images": [len(one) for one in built.pictures],
        "dials": [{"name": one.name, "values": one.values, "rest": one.rest} for one in dials],
    }
    assert built.poster is not None
    return Template(_text("page.html")).substitute(
        policy=html.escape(f"{_NONE}; style-src {hash_of(style)}; script-src {hash_of(script)}"),
        title=html.escape(title),
        note=html.escape(note),
        style=style,
        poster=f"data:image/webp;base64,{_base64(_poster(built.poster))}",
        scene=seven_bits(gzip.compress(json.dumps(told).encode(), 9, mtime=0)),
        data=seven_bits(built.packer.packed()),
        pictures=seven_bits(b"".join(built.pictures)),
        script=script,
    )


def player() -> str:
    """The player's modules as one."""
    return "".join(_EXPORT.sub("", _IMPORT.sub("", _text(f"{name}.js"))) for name in MODULES)


def _poster(picture: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    into = io.BytesIO()
    Image.fromarray(picture).save(into, "WEBP", quality=80)
    return into.getvalue()


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _text(name: str) -> str:
    return Path(__file__).with_name(name).read_text("utf-8")
