"""Mitsuba 3: a scene whose skin is a homogeneous medium, as it has no diffusion profiles.

A surface of index 1.4 around the medium is what tissue has, and light that is found by rays alone passes it:
an environment, lamps of some size. Points and spots need the matched one, whose medium is another.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.equivalent import homogeneous
from dermis.apps.export.lobe import fit_d
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of
from dermis.apps.export.targets.mitsuba_colours import Colours, colours_of, rough, textures
from dermis.apps.export.targets.mitsuba_files import (
    BOUNDARIES,
    REFLECTED,
    Boundary,
    Looks,
    Walked,
    scene_files,
)
from dermis.optics.curve import Curve
from dermis.optics.half_space import Kind, albedo_of, half_space
from dermis.optics.media import Floats
from dermis.scene.model import Scene

_SIGMA, _ALBEDO, _PASSING, _INDEX, _ALPHA = "sigma_t", "albedo", "passing", "int_ior", "alpha"
_SIZE, _SAMPLES = (512, 512), 256


class Mitsuba(Target):
    """Scene, medium, surface, lights, camera and meshes, in mm."""

    name: ClassVar[str] = "mitsuba"
    title: ClassVar[str] = "Mitsuba"
    suffixes: ClassVar[tuple[str, ...]] = ("",)
    versions: ClassVar[tuple[str, ...]] = ("3",)
    variants: ClassVar[tuple[str, ...]] = ("matched", "rough", "smooth")
    needs_maps: ClassVar[bool] = True
    wrong: ClassVar[str] = (
        "One medium a channel cannot hold layers: their red light leaves nearer and farther than shown. "
        "Under rough and smooth surfaces points, spots and parallel light are black, for no ray finds them; "
        "the matched surface mirrors alike from all sides and dims by lightness, without hues. Hairs are "
        "left out."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """The medium whose curve is nearest, for the map's brightest skin; textures dim the rest."""
        boundary, colours = self._boundary, colours_of(subject)
        found = medium_for(subject.curve, colours, boundary)
        return (
            Row(_SIGMA, found.sigma_t, "1/mm", "extinction; in the file by its largest channel and scale"),
            Row(_ALBEDO, found.albedo, "-", "of one scattering, isotropic: not the skin's colour"),
            Row(_PASSING, colours.passing(boundary), "-", "mean share that textures let pass, both ways"),
            Row(_INDEX, BOUNDARIES[boundary], "-", "of the surface; 1 for none"),
            Row(_ALPHA, rough(subject), "-", "Beckmann roughness, where no texture has it"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """The skin's colour as albedo, and 1/d as extinction."""
        colour = tuple(map(float, np.clip(subject.albedo, 0.0, 1.0)))
        typed = {_SIGMA: tuple(map(float, 1.0 / fit_d(subject.curve))), _ALBEDO: colour, _PASSING: (1.0,) * 3}
        rows = self.parameters(subject, version)
        return tuple(Row(r.name, typed.get(r.name, r.value), r.unit, r.meaning) for r in rows)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """What walks through the medium show, of light that falls straight down."""
        boundary = self._boundary
        sigma, albedo, passing = (np.array(numbers_of(rows, name)) for name in (_SIGMA, _ALBEDO, _PASSING))
        curve = half_space(_kind(boundary), albedo, 1.0 / sigma)
        energy = curve.energy if boundary != "matched" else _everywhere(albedo)
        wanted = np.maximum(colours_of(subject).mean, 1e-9)
        return curve.with_energy(subject.curve.energy * _crossing(boundary) * energy * passing / wanted)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The scene with a file for each surface, meshes and textures."""
        colours, scene = colours_of(subject), subject.scene or Scene(subject.shape)
        media = {each: medium_for(subject.curve, colours, each) for each in BOUNDARIES}
        looks = Looks(media, *textures(subject, colours), _painted(scene, self.adapter))
        written = []
        for name, content in scene_files(scene, looks, self._boundary, _SIZE, _SAMPLES):
            file = place / name
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(content)
            written.append(file)
        return written

    @property
    def _boundary(self) -> Boundary:
        return next(each for each in BOUNDARIES if each == (self.variant or self.variants[0]))


def medium_for(curve: Curve, colours: Colours, boundary: Boundary) -> Walked:
    """The medium that shows a curve best under a surface, as bright as the brightest skin.

    Light falls on heads from everywhere. Under a matched surface a slant brings back up to a quarter more
    than a light from straight above; refraction leaves no such difference.
    """
    energy = colours.brightest(boundary) / _crossing(boundary)
    if boundary == "matched":
        energy = half_space("matched", albedo_of("walk", energy), np.ones(3)).energy
    found = homogeneous(curve, energy, _kind(boundary))
    return Walked(tuple(map(float, 1.0 / found.mfp_mm)), tuple(map(float, found.albedo)))


def _kind(boundary: Boundary) -> Kind:
    return "matched" if boundary == "matched" else "skin"


def _everywhere(albedo: Floats) -> Floats:
    return half_space("walk", albedo, np.ones(3)).energy


def _crossing(boundary: Boundary) -> float:
    """Share of what enters a matched surface, over that which its rough mirror does not reflect."""
    return 1.0 - REFLECTED if boundary == "matched" else 1.0


def _painted(scene: Scene, adapter: str) -> dict[int, bytes]:
    """Files of the head's other materials."""
    if all(material.kind == "skin" for material in scene.head.mesh.materials):
        return {}
    from dermis.apps.export.targets.mitsuba_painted import painted_meshes
    from dermis.frame.renderer import Renderer

    return painted_meshes(Renderer(adapter), scene)


TARGET = Mitsuba()
