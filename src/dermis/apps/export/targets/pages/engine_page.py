"""Web pages that draw a head with a JavaScript library: library files, page, camera and lights."""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import math
import re
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, flat_tuple
from dermis.apps.export.targets.gltf.file import encode_glb
from dermis.apps.export.targets.pages.html import escape_script, render_page
from dermis.base.errors import refuse
from dermis.base.reading import read_file
from dermis.optics.media import SKIN_ETA
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

Json = dict[str, object]
_CDN_URL = "https://cdn.jsdelivr.net/npm"
_MAX_SCRIPT_BYTES = 32 << 20
_METRES_PER_MM = 1e-3
_SHADOW_MAP_SIDE = 2048
_WARM_UP_FRAME_COUNT = 4  # frames until all shaders are compiled
_LOAD_ERROR_TEXT = "{} could not be loaded from {}. Check the network, or export again with --library."
_TEXTURE_CSP_DIRECTIVES = "img-src blob: data:; connect-src blob: data:"  # for textures in the head's file
_PAGE_FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class LibraryFile:
    """JavaScript file of an npm package, with a hash to check the content of the file.

    package, version : name and version of the package
    path : path of the file within the package
    sha384 : SHA-384 of the file, in base64
    name : name under which modules of the page import the file; "" for a script that is not imported
    """

    package: str
    version: str
    path: str
    sha384: str
    name: str = ""

    @property
    def url(self) -> str:
        """Return the public URL from which the page loads this library file."""
        return f"{_CDN_URL}/{self.package}@{self.version}/{self.path}"

    @property
    def integrity(self) -> str:
        """Return the value of the HTML attribute `integrity`, with which the browser checks this file."""
        return f"sha384-{self.sha384}"

    @property
    def html_element(self) -> str:
        """Return the HTML element that loads this script; the browser runs it only if its hash is right."""
        return f'<script src="{self.url}" integrity="{self.integrity}" crossorigin="anonymous"></script>'

    def read(self, node_modules_folder: Path) -> str:
        """Return the text of the file from a node_modules folder of npm.

        Raises DermisError if the file is missing or differs from the expected version.
        """
        expected = f"{self.path} of {self.package} {self.version}, as npm installs it"
        file = node_modules_folder / self.package / self.path
        data = read_file(file, expected, _MAX_SCRIPT_BYTES)
        if base64.b64encode(hashlib.sha384(data).digest()).decode() != self.sha384:
            advice = f"Install it: npm install {self.package}@{self.version}"
            refuse(file, expected, "its SHA-384 differs", advice)
        return data.decode("utf-8")


@dataclass(frozen=True)
class EnginePage(Target):
    """Base class of exports to a web page that draws a head with a JavaScript library.

    library_folder : npm folder node_modules with the library that the page embeds; None if the page loads the
        library from a public server
    """

    library_folder: Path | None = None

    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    needs_maps: ClassVar[bool] = True
    part_limitations: ClassVar[str] = ""
    import_steps: ClassVar[tuple[str, ...]] = (
        "Open the page in a browser with WebGL 2, such as Chrome, Firefox or Safari.",
        "Drag with the mouse to turn the head, scroll to approach it.",
        "Change light and roughness with the panel of the page.",
    )
    file_meanings: ClassVar[Mapping[str, str]] = {"*.html": "web page with head, pictures and script"}
    drawing_script: ClassVar[Path]
    """Script that draws the head."""
    library_files: ClassVar[Mapping[str, tuple[LibraryFile, ...]]]
    """Files of the library, by version."""

    def with_embedded_library(self, node_modules_folder: str | Path) -> EnginePage:
        """Return a copy of the target that embeds the library from an npm folder in the page."""
        return replace(self, library_folder=Path(node_modules_folder))

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the page with the head, its parameters, camera and lights."""
        libraries, sources = self.library_script_tags(version)
        script = (_PAGE_FOLDER / "panel.js").read_text("utf-8") + self.drawing_script.read_text("utf-8")
        text = render_page(
            _PAGE_FOLDER,
            title=f"{subject.name} in {self.title}",
            note=f"{self.title} {version} ({self.licence}). {self.limitations}",
            script=escape_script(script),
            policy=_TEXTURE_CSP_DIRECTIVES,
            script_sources=sources,
            settings=html_safe_json(self._page_settings_json(subject, parameters, version)),
            head=base64.b64encode(gzip.compress(_encode_still_head(subject), mtime=0)).decode(),
            libraries=libraries,
        )
        output.write_text(text, encoding="utf-8")
        return [output]

    @abstractmethod
    def library_script_tags(self, version: str) -> tuple[str, list[str]]:
        """Return the HTML elements of the library, and the sources for script-src.

        A source is a URL, a scheme or a hash that the page's Content-Security-Policy allows.
        """

    def _page_settings_json(self, subject: Subject, parameters: Parameters, version: str) -> Json:
        scene = subject.scene or Scene(subject.head_or_ball)
        centre_mm = scene.head.centre_mm if subject.scene else (0.0, 0.0, 0.0)  # of the ball
        return {
            "camera": page_camera_json(scene, centre_mm),
            "lights": [page_light_json(light) for light in scene.lights],
            "skin": {one.name.rpartition(".")[2]: one.value for one in parameters},
            "shadow_side": _SHADOW_MAP_SIDE,
            "warm_frames": _WARM_UP_FRAME_COUNT,
            "smooth": True,
            "no_library": _LOAD_ERROR_TEXT.format(self.title, self.library_files[version][0].url),
        }


def _encode_still_head(subject: Subject) -> bytes:
    """Return a .glb file of the head at rest, without the morph targets and bones, which no page uses."""
    if subject.scene is not None:
        subject = replace(
            subject, scene=subject.scene.replace(head=replace(subject.scene.head, rig=None), pose=None)
        )
    return encode_glb(subject, {"KHR_materials_ior": {"ior": SKIN_ETA}}, "")


def html_safe_json(json_value: Json) -> str:
    """Return a value as JSON without characters that begin or end HTML elements."""
    text = json.dumps(json_value, ensure_ascii=True)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def module_url(module_text: str, import_names: Mapping[str, str]) -> str:
    """Return a JavaScript module as a data URL, with the names in its import statements replaced.

    module_text : source of the module
    import_names : dictionary from a name in the import statements to the name in the page's import map
    """
    for old, new in import_names.items():
        module_text = re.sub(rf"(\bfrom\s*)(['\"]){re.escape(old)}\2", rf"\1\2{new}\2", module_text)
    return f"data:text/javascript;base64,{base64.b64encode(module_text.encode()).decode()}"


def material_parameters(subject: Subject) -> Parameters:
    """Return the surface parameters that the skin has in both Babylon.js and three.js."""
    return (
        Parameter("albedo", flat_tuple(subject.albedo), "-", "diffuse reflectance; the mean of a colour map"),
        Parameter("ior", SKIN_ETA, "-", "of the surface; reflectance 0.028 at normal incidence"),
    )


def page_camera_json(scene: Scene, centre_mm: Sequence[float]) -> Json:
    """Return the scene's camera as JSON, with positions in the page's scene [m] and angle of view [rad].

    centre_mm : (3,) position of the head's centre in the page's scene; positions in `scene` are relative to
        this centre [mm]
    """
    camera, centre = scene.camera, np.array(centre_mm)
    position, target = (_METRES_PER_MM * (centre + one) for one in (camera.position, camera.target))
    fov = 2.0 * math.atan(camera.half_view_tangent)
    return {
        "position": flat_tuple(position),
        "target": flat_tuple(target),
        "up": flat_tuple(camera.up),
        "fov": fov,
    }


def page_light_json(light: Light) -> Json:
    """Return the JSON of a directional light that replaces a light.

    A light with a position becomes parallel light in the direction from this position to the light's target,
    with the same irradiance at the target.
    """
    if isinstance(light, DirectionalLight):
        direction = np.asarray(light.direction, np.float64)
    else:
        direction = np.subtract(light.target, light.position)
    direction = direction / np.linalg.norm(direction)
    return {"direction": flat_tuple(direction), "irradiance": flat_tuple(light.irradiance)}
