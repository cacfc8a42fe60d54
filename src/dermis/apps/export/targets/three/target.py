"""Export to a web page with three.js, which draws the head without subsurface scattering.

The user of the page can move the lights and the head.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, replace_values
from dermis.apps.export.targets.pages.engine_page import (
    EnginePage,
    LibraryFile,
    material_parameters,
    module_url,
)
from dermis.apps.export.targets.pages.html import csp_hash
from dermis.base.tables import read_rows
from dermis.optics.cumulative_profile import CumulativeProfile

_IMPORT_MAP_NAMES = {
    "./three.core.js": "three/core",
    "../utils/BufferGeometryUtils.js": "three/buffers",
    "../utils/SkeletonUtils.js": "three/skeletons",
}
_DEFAULT_IOR = 1.5


class ThreeJs(EnginePage):
    """Export to a web page that draws the head with three.js."""

    name = "three"
    title = "three.js"
    versions = ("0.187.0",)
    licence = "MIT"
    drawing_script = Path(__file__).with_name("three.js")
    limitations = (
        "There is no subsurface scattering: light leaves where it arrives, so shadow edges are sharp without "
        "a red fringe, and ears are opaque. Transmission, which would turn the skin into glass, is 0. All "
        "lights are parallel."
    )
    library_files: ClassVar = {
        "0.187.0": tuple(LibraryFile("three", "0.187.0", **row) for row in read_rows(__package__, "scripts"))
    }

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the surface parameters of MeshPhysicalMaterial, which has no subsurface scattering."""
        return (
            *material_parameters(subject),
            Parameter("specularIntensity", 1.0, "-", "reflectance given by the index of refraction"),
            Parameter("transmission", 0.0, "-", "of clear glass, which does not apply to skin"),
        )

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the exported parameters with the default index of refraction of MeshPhysicalMaterial."""
        return replace_values(self.parameters(subject, version), {"ior": _DEFAULT_IOR})

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of light that leaves the skin where it enters: 1 at every radius."""
        return CumulativeProfile.from_function(lambda r: np.ones((len(r), 3)), subject.curve.energy)

    def library_script_tags(self, version: str) -> tuple[str, list[str]]:
        """Return the import map of three.js, and the values to add to script-src.

        script-src is the part of the page's Content-Security-Policy that lists the permitted scripts. The
        values are the hash of the import map, and the URLs of the scripts or the scheme "data:".
        """
        files = self.library_files[version]
        if self.library_folder is None:
            imports = {file.name: file.url for file in files}
            integrity = {file.url: file.integrity for file in files}
            return _import_map({"imports": imports, "integrity": integrity}, [*integrity])
        modules = {file.name: module_url(file.read(self.library_folder), _IMPORT_MAP_NAMES) for file in files}
        return _import_map({"imports": modules}, ["data:"])


def _import_map(import_map: dict[str, dict[str, str]], script_sources: list[str]) -> tuple[str, list[str]]:
    text = json.dumps(import_map)
    return f'<script type="importmap">{text}</script>', [csp_hash(text), *script_sources]


TARGET = ThreeJs()
