"""Export to a web page with captured frames of a head and a WebGPU player that replays the frames."""

from __future__ import annotations

import base64
import gzip
import io
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import cumulative_gaussian_profile
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, flat_tuple, get_numbers
from dermis.apps.export.targets.pages.html import escape_script, render_page
from dermis.apps.export.targets.web import build
from dermis.apps.export.targets.web.maps import with_reduced_maps
from dermis.apps.export.targets.web.packing import encode_seven_bits
from dermis.apps.export.targets.web.sliders import Slider, scene_sliders
from dermis.base.errors import notify, refuse
from dermis.frame.features.diffusion.profiles import SkinProfiles
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.settings import Settings

PLAYER_MODULES = (
    "graph",
    "packed",
    "device",
    "player",
    "maps",
    "camera",
    "state",
    "screen",
    "mixing",
    "input",
    "page",
)
"""Modules of the player, each after the modules that it imports."""
_PAGE_FOLDER = Path(__file__).parent
_IMPORT_STATEMENT = re.compile(r"^import [^;]*;\n", re.MULTILINE)
_EXPORT_KEYWORD = re.compile(r"^export ", re.MULTILINE)
_ATLAS_SIDE = 512
_MAX_MAP_SIDE = 1024


def page_html(page_content: build.PageContent, sliders: tuple[Slider, ...], title: str, note: str) -> str:
    """Return the HTML of the page with all its data and scripts.

    title, note : plain text, which is escaped
    """
    scene = {
        "forms": page_content.frames_by_kind,
        "blobs": page_content.byte_runs.runs,
        "images": [len(one) for one in page_content.pictures],
        "dials": [{"name": one.name, "values": one.values, "rest": one.default_value} for one in sliders],
    }
    assert page_content.poster is not None
    return render_page(
        _PAGE_FOLDER,
        title=title,
        note=note,
        script=escape_script(player_script()),
        policy="img-src data:",
        poster=f"data:image/webp;base64,{base64.b64encode(_encode_webp(page_content.poster)).decode()}",
        scene=encode_seven_bits(gzip.compress(json.dumps(scene).encode(), 9, mtime=0)),
        data=encode_seven_bits(page_content.byte_runs.compress()),
        pictures=encode_seven_bits(b"".join(page_content.pictures)),
    )


def player_script() -> str:
    """Return one script with all JavaScript modules of the player, which replays the captured frames."""
    texts = ((_PAGE_FOLDER / f"{name}.js").read_text("utf-8") for name in PLAYER_MODULES)
    return "".join(_EXPORT_KEYWORD.sub("", _IMPORT_STATEMENT.sub("", text)) for text in texts)


def _encode_webp(poster: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(poster).save(file, "WEBP", quality=80)
    return file.getvalue()


class Web(Target):
    """Export to a web page that renders the head with WebGPU and needs no library, server or network."""

    name = "web"
    title = "WebGPU"
    versions = ("1",)
    suffixes = (".html",)
    import_steps = (
        "Open the page in a browser with WebGPU, such as Chrome, Edge or Safari.",
        "Drag with the mouse to turn the head.",
        "Change light and skin with the panel of the page; heads with expressions have them there, too.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.html": "web page that contains the renderer and the head",
    }
    limitations = (
        "The page renders square pictures with an atlas of 512 texels. Maps have at most 1024 texels per "
        "side, 8 bits per channel and WebP compression. Expressions move skin without folds and flushing. "
        "Sliders interpolate between a few values. Hairs keep the width of the first view."
    )
    part_limitations = ""

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the side of the atlas, and the Gaussians that the page uses to diffuse light."""
        profile = self._diffusion_profile(subject)
        return (
            Parameter("atlas", _ATLAS_SIDE, "texel", "side of the map in which light is diffused"),
            Parameter("variance", flat_tuple(profile.variance_mm2), "mm2", "of each Gaussian"),
            *(
                Parameter(f"weight.{colour}", flat_tuple(weight), "-", "of each Gaussian")
                for colour, weight in zip(("red", "green", "blue"), profile.weight.T, strict=True)
            ),
        )

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the exported parameters: the page has none that a user could choose differently."""
        return self.parameters(subject, version)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of the Gaussians that the page uses to diffuse light."""
        _, variance, *weight = (np.array(get_numbers(parameters, one.name)) for one in parameters)
        return cumulative_gaussian_profile(variance, np.stack(weight, axis=1), subject.curve.energy)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Capture the frames of the scene, and write the page with these frames."""
        scene = subject.scene
        if scene is None:
            actual = f"got the skin {subject.name}"
            refuse("subject", "a head, which the page renders", actual, "Name a head")
        if scene.state is not None:
            notify("state: the page shows it in maps without pores, and has no sliders of melanin and blood")
            painted = subject.with_painted_maps(min(self.side, _MAX_MAP_SIDE), self.adapter)
            scene = painted.scene or scene
        scene = replace(scene, head=with_reduced_maps(scene.head, min(self.side, _MAX_MAP_SIDE)))
        sliders, settings = scene_sliders(scene), Settings(atlas=_ATLAS_SIDE)
        sides, quality = build.PICTURE_SIDES, build.INTERACTIVE_QUALITY
        request = build.PageRequest(scene, sliders, settings, sides, self.adapter, quality)
        text = page_html(build.build_page_content(request), sliders, subject.name, self.limitations)
        output.write_text(text, encoding="utf-8")
        return [output]

    @staticmethod
    def _diffusion_profile(subject: Subject) -> GaussianSum:
        return SkinProfiles().profile(subject.scene.skin) if subject.scene else load_profile(subject.name)


TARGET = Web()
