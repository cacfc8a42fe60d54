"""JavaScript libraries of pages: from where they are loaded, or the files that are put into the page."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
import re
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from string import Template
from typing import Any, ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target
from dermis.apps.export.targets.gltf.file import encoded
from dermis.apps.export.targets.pages.html import hash_of, inline
from dermis.base.errors import refuse
from dermis.base.reading import read_file
from dermis.optics.media import SKIN_ETA
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

_CDN = "https://cdn.jsdelivr.net/npm"
_MOST = 32 << 20


@dataclass(frozen=True)
class Script:
    """A file of a package, as npm has it.

    name : by which a page's modules import it, "" for one that is simply run
    sha384 : of its bytes, base64
    """

    package: str
    version: str
    path: str
    sha384: str
    name: str = ""

    @property
    def url(self) -> str:
        """Where it is loaded from."""
        return f"{_CDN}/{self.package}@{self.version}/{self.path}"

    @property
    def integrity(self) -> str:
        """What the browser checks it by."""
        return f"sha384-{self.sha384}"

    def read(self, folder: Path) -> str:
        """Its text, from the folder that npm installs packages into (node_modules).

        DermisError : it is not there, or another version
        """
        expected = f"{self.path} of {self.package} {self.version}, as npm installs it"
        file = folder / self.package / self.path
        data = read_file(file, expected, _MOST)
        if base64.b64encode(hashlib.sha384(data).digest()).decode() != self.sha384:
            remedy = f"Install it: npm install {self.package}@{self.version}"
            refuse(file, expected, "other bytes came", remedy)
        return data.decode("utf-8")


def module_url(text: str, names: dict[str, str]) -> str:
    """A module as an address that holds it.

    names : by which it imports others, and by which the page knows these
    """
    for old, new in names.items():
        text = re.sub(rf"(\bfrom\s*)(['\"]){re.escape(old)}\2", rf"\1\2{new}\2", text)
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


Json = Mapping[str, Any]
_NONE = "default-src 'none'; base-uri 'none'; form-action 'none'"
_MADE = "img-src blob: data:; connect-src blob: data:"  # textures of the head's file


def page(
    *, title: str, note: str, settings: Json, head: bytes, draw: Path, libraries: str, sources: Sequence[str]
) -> str:
    """The text of the page.

    draw : script that draws
    libraries : elements that load or hold the library
    sources : what else scripts may come from, as in a Content-Security-Policy
    """
    script, style = inline(_text("panel.js") + draw.read_text("utf-8")), _text("page.css")
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
    return Path(__file__).with_name(name).read_text("utf-8")


_M = 1e-3  # of a millimetre
_SHADOW_SIDE = 2048
_WARM_FRAMES = 4  # until all passes' programs are compiled
_NO_LIBRARY = "{} could not be loaded from {}. Is there no network? Export again with --library."


@dataclass(frozen=True)
class WebPage(Target):
    """A page that draws a head.

    installed : folder that npm has installed the library's packages into, whose files then stand in the page;
        None loads them from a public server
    """

    installed: Path | None = None

    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    needs_maps: ClassVar[bool] = True
    licence: ClassVar[str]
    """Of the library."""
    draw: ClassVar[Path]
    """Script that draws."""
    scripts: ClassVar[Mapping[str, tuple[Script, ...]]]
    """Files of the library, by version."""

    def with_library(self, folder: str | Path) -> WebPage:
        """The same with the library inside the page."""
        return replace(self, installed=Path(folder))

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The page."""
        libraries, sources = self.loaded(version)
        text = page(
            title=f"{subject.name} in {self.title}",
            note=f"{self.title} {version} ({self.licence}). {self.wrong}",
            settings=self._settings(subject, rows, version),
            head=encoded(subject, {"KHR_materials_ior": {"ior": SKIN_ETA}}, ""),
            draw=self.draw,
            libraries=libraries,
            sources=sources,
        )
        place.write_text(text, encoding="utf-8")
        return [place]

    @abstractmethod
    def loaded(self, version: str) -> tuple[str, list[str]]:
        """Elements that load or hold the library, and what scripts may come from."""

    def _settings(self, subject: Subject, rows: Rows, version: str) -> dict[str, Any]:
        scene = subject.scene or Scene(subject.shape)
        where = self.scripts[version][0].url
        middle = scene.head.centre_mm if subject.scene else (0.0, 0.0, 0.0)  # a ball's own
        return {
            "camera": camera_of(scene, middle),
            "lights": [light_of(light) for light in scene.lights],
            "skin": {row.name.rpartition(".")[2]: row.value for row in rows},
            "shadow_side": _SHADOW_SIDE,
            "warm_frames": _WARM_FRAMES,
            "smooth": True,
            "no_library": _NO_LIBRARY.format(self.title, where),
        }


def surface_rows(subject: Subject) -> Rows:
    """What both libraries take for the surface."""
    return (
        Row("albedo", tuple(float(x) for x in subject.albedo), "-", "diffuse; the mean where it is a map"),
        Row("ior", SKIN_ETA, "-", "of the surface, which reflects 0.028 straight ahead"),
    )


def camera_of(scene: Scene, middle_mm: Sequence[float]) -> dict[str, Any]:
    """Where the scene is seen from in the head's file [m], and the vertical angle of view [rad].

    middle_mm : what cameras are placed around
    """
    camera = scene.camera
    position, target = (_M * (np.array(middle_mm) + each) for each in (camera.position, camera.target))
    up = [float(x) for x in camera.up]
    fov = 2.0 * math.atan(camera.half_tangent)
    return {"position": position.tolist(), "target": target.tolist(), "up": up, "fov": fov}


def light_of(light: Light) -> dict[str, Any]:
    """A light as parallel light with its irradiance at the head."""
    if isinstance(light, DirectionalLight):
        way = np.asarray(light.direction, np.float64)
    else:
        way = np.subtract(light.target, light.position)
    return {
        "direction": (way / np.linalg.norm(way)).tolist(),
        "irradiance": [float(x) for x in light.irradiance],
    }
