"""three.js: a page with the head, lit and turned, whose skin spreads no light."""

from __future__ import annotations

import json
from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, with_values
from dermis.apps.export.targets.pages.engine_page import EnginePage, Script, module_url, surface_rows
from dermis.apps.export.targets.pages.html import hash_of
from dermis.base.tables import read_rows
from dermis.optics.curve import Curve

_IMPORTS = {
    "./three.core.js": "three/core",
    "../utils/BufferGeometryUtils.js": "three/buffers",
    "../utils/SkeletonUtils.js": "three/skeletons",
}
_DEFAULT_IOR = 1.5


class Three(EnginePage):
    """Page with three.js."""

    name = "three"
    title = "three.js"
    versions = ("0.187.0",)
    licence = "MIT"
    draw = Path(__file__).with_name("three.js")
    wrong = (
        "Nothing spreads: its materials send all light back from where it falls, so shadows' edges are sharp "
        "and have no red fringe, and nothing shines through an ear. Transmission would make glass of the "
        "skin and is left at 0. Lights are parallel here."
    )
    scripts: ClassVar = {
        "0.187.0": tuple(Script("three", "0.187.0", **row) for row in read_rows(__package__, "scripts"))
    }

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the surface; there is nothing for what is below."""
        return (
            *surface_rows(subject),
            Row("specularIntensity", 1.0, "-", "all that the index of refraction gives"),
            Row("transmission", 0.0, "-", "of clear glass, which skin is not"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the index of refraction that the material begins with."""
        return with_values(self.parameters(subject, version), {"ior": _DEFAULT_IOR})

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of light that leaves where it falls."""
        return Curve.of(lambda r: np.ones((len(r), 3)), subject.curve.energy)

    def loaded(self, version: str) -> tuple[str, list[str]]:
        """Return six modules and the map of their names."""
        scripts = self.scripts[version]
        if self.installed is None:
            places = {script.name: script.url for script in scripts}
            checks = {script.url: script.integrity for script in scripts}
            return _import_map({"imports": places, "integrity": checks}, [script.url for script in scripts])
        texts = {script.name: script.read(self.installed) for script in scripts}
        return _import_map(
            {"imports": {name: module_url(text, _IMPORTS) for name, text in texts.items()}}, ["data:"]
        )


def _import_map(entries: dict[str, dict[str, str]], sources: list[str]) -> tuple[str, list[str]]:
    text = json.dumps(entries)
    return f'<script type="importmap">{text}</script>', [hash_of(text), *sources]


TARGET = Three()
