"""What the pages have in common: the head, its camera and lights, and the library."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target
from dermis.apps.export.targets.gltf_file import encoded
from dermis.apps.export.targets.web_library import Script
from dermis.apps.export.targets.web_page import page
from dermis.optics.media import SKIN_ETA
from dermis.scene.lights import DirectionalLight, Light
from dermis.scene.model import Scene

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
    draw: ClassVar[str]
    """Name of the script that draws."""
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
