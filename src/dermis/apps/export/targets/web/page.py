"""HTML file that holds a recorded head and the player of its frames."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.targets.pages.html import inline, page
from dermis.apps.export.targets.web.build import PageContent
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
_HERE = Path(__file__).parent
_IMPORT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT = re.compile(r"^export ", re.MULTILINE)


def web_page(built: PageContent, dials: tuple[Dial, ...], title: str, note: str) -> str:
    """Return the text of the page.

    title, note : any text, which is escaped
    """
    scene = {
        "forms": built.forms,
        "blobs": built.packer.runs,
        "images": [len(one) for one in built.pictures],
        "dials": [{"name": one.name, "values": one.values, "rest": one.rest} for one in dials],
    }
    assert built.poster is not None
    return page(
        _HERE,
        title=title,
        note=note,
        script=inline(player()),
        policy="img-src data:",
        poster=f"data:image/webp;base64,{base64.b64encode(_webp(built.poster)).decode()}",
        scene=seven_bits(gzip.compress(json.dumps(scene).encode(), 9, mtime=0)),
        data=seven_bits(built.packer.packed()),
        pictures=seven_bits(b"".join(built.pictures)),
    )


def player() -> str:
    """Return the player's modules as one script."""
    return "".join(
        _EXPORT.sub("", _IMPORT.sub("", (_HERE / f"{name}.js").read_text("utf-8"))) for name in MODULES
    )


def _webp(picture: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    into = io.BytesIO()
    Image.fromarray(picture).save(into, "WEBP", quality=80)
    return into.getvalue()
