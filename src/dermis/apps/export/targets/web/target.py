"""HTML file that holds a recorded head and the player of its frames."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import gaussian_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, floats, numbers_of
from dermis.apps.export.targets.pages.html import inline, page
from dermis.apps.export.targets.web.build import PageContent
from dermis.apps.export.targets.web.dials import Dial
from dermis.apps.export.targets.web.packing import seven_bits
from dermis.base.errors import refuse
from dermis.optics.curve import Curve
from dermis.optics.gaussians import GaussianSum

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
_ATLAS = 512
_MAP = 1024  # texels a side, most


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


class Web(Target):
    """Page that needs no library, no server and no network."""

    name = "web"
    title = "WebGPU"
    versions = ("1",)
    suffixes = (".html",)
    wrong = (
        "The page draws square pictures with an atlas of 512 texels; maps have at most 1024 texels a side, "
        "8 bits a channel, and lose what WebP loses. Expressions move the skin, but their folds and flushes "
        "are not painted; between the nodes of a dial, numbers are interpolated. Hairs keep the thickness of "
        "the first view."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the Gaussians that spread light."""
        profile = self._profile(subject)
        return (
            Row("atlas", _ATLAS, "texel", "side of the atlas that light spreads on"),
            Row("variance", floats(profile.variance_mm2), "mm2", "of each Gaussian"),
            *(
                Row(f"weight.{colour}", floats(profile.weight[:, k]), "-", "of each Gaussian")
                for k, colour in enumerate(("red", "green", "blue"))
            ),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the same: there is nothing to type."""
        return self.parameters(subject, version)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of the sum of Gaussians."""
        _, variance, *weight = (np.array(numbers_of(rows, row.name)) for row in rows)
        return gaussian_curve(variance, np.stack(weight, axis=1), subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the page."""
        from dermis.apps.export.targets.web.build import MOVING, SIZES, PageRequest, page_content
        from dermis.apps.export.targets.web.dials import dials_of
        from dermis.apps.export.targets.web.maps import with_smaller_maps
        from dermis.apps.export.targets.web.target import web_page
        from dermis.scene.settings import Settings

        scene = subject.scene
        if scene is None:
            came = f"the skin {subject.name} came"
            refuse("subject", "a head, which the page renders", came, "Name a head")
        scene = replace(scene, head=with_smaller_maps(scene.head, min(self.side, _MAP)))
        dials = dials_of(scene)
        made = page_content(PageRequest(scene, dials, Settings(atlas=_ATLAS), SIZES, self.adapter, MOVING))
        place.write_text(web_page(made, dials, subject.name, self.wrong), encoding="utf-8")
        return [place]

    @staticmethod
    def _profile(subject: Subject) -> GaussianSum:
        from dermis.frame.features.diffusion.profiles import SkinProfiles
        from dermis.optics.profiles import load_profile

        scene = subject.scene
        return SkinProfiles().of(scene.skin) if scene else load_profile(subject.name)


TARGET = Web()
