"""Mitsuba 3: a scene whose skin is a homogeneous medium, as it has no diffusion profiles.

A surface of index 1.4 around the medium is what tissue has, and light that is found by rays alone passes it:
an environment, lamps of some size. Points and spots need the matched one, whose medium is another.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.fitting import fit_d, homogeneous
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, floats, numbers_of, with_values, write_files
from dermis.apps.export.targets.mitsuba.scene import (
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
from dermis.scene.skin import USUAL_ROUGHNESS

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_BRIGHTEST = 99.0  # percentile; what is brighter is shown as that
_SAMPLED = 512  # texels of a map's side that the percentile is taken on
Map = NDArray[np.float32]
_SIGMA, _ALBEDO, _PASSING, _INDEX, _ALPHA = "sigma_t", "albedo", "passing", "int_ior", "alpha"
_SIZE, _SAMPLES = (512, 512), 256


class Mitsuba(Target):
    """Scene, medium, surface, lights, camera and meshes, in mm."""

    name = "mitsuba"
    title = "Mitsuba"
    suffixes = ("",)
    versions = ("3",)
    variants = ("matched", "rough", "smooth")
    needs_maps = True
    wrong = (
        "One medium a channel cannot hold layers: their red light leaves nearer and farther than shown. "
        "Under rough and smooth surfaces points, spots and parallel light are black, for no ray finds them; "
        "the matched surface mirrors alike from all sides and dims by lightness, without hues. Hairs are "
        "left out."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the medium whose curve is nearest, for the map's brightest skin; textures dim the rest."""
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
        """Return the skin's colour as albedo, and 1/d as extinction."""
        typed = {_SIGMA: floats(1.0 / fit_d(subject.curve)), _ALBEDO: floats(subject.colour())}
        return with_values(self.parameters(subject, version), {**typed, _PASSING: (1.0,) * 3})

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of walks through the medium, of light along the normal."""
        boundary = self._boundary
        sigma, albedo, passing = (np.array(numbers_of(rows, name)) for name in (_SIGMA, _ALBEDO, _PASSING))
        curve = half_space(_kind(boundary), albedo, 1.0 / sigma)
        energy = curve.energy if boundary != "matched" else _everywhere(albedo)
        wanted = np.maximum(colours_of(subject).mean, 1e-9)
        return curve.with_energy(subject.curve.energy * _crossing(boundary) * energy * passing / wanted)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the scene with a file for each surface, meshes and textures."""
        colours, scene = colours_of(subject), subject.scene or Scene(subject.shape)
        media = {each: medium_for(subject.curve, colours, each) for each in BOUNDARIES}
        looks = Looks(media, *textures(subject, colours), _painted(scene, self.adapter))
        return write_files(place, scene_files(scene, looks, self._boundary, _SIZE, _SAMPLES))

    @property
    def _boundary(self) -> Boundary:
        return next(each for each in BOUNDARIES if each == (self.variant or self.variants[0]))


def medium_for(curve: Curve, colours: Colours, boundary: Boundary) -> Walked:
    """Return the medium that shows a curve best under a surface, as bright as the brightest skin.

    Light falls on heads from everywhere. Under a matched surface oblique light brings back up to a quarter
    more than light along the normal; refraction leaves no such difference.
    """
    energy = colours.brightest(boundary) / _crossing(boundary)
    if boundary == "matched":
        energy = half_space("matched", albedo_of("walk", energy), np.ones(3)).energy
    found = homogeneous(curve, energy, _kind(boundary))
    return Walked(floats(1.0 / found.mfp_mm), floats(found.albedo))


def _kind(boundary: Boundary) -> Kind:
    return "matched" if boundary == "matched" else "skin"


def _everywhere(albedo: Floats) -> Floats:
    return half_space("walk", albedo, np.ones(3)).energy


def _crossing(boundary: Boundary) -> float:
    """Return the share that enters a matched surface, over that which its rough mirror does not reflect."""
    return 1.0 - REFLECTED if boundary == "matched" else 1.0


def _painted(scene: Scene, adapter: str) -> dict[int, bytes]:
    """Return files of the head's other materials."""
    if all(material.kind == "skin" for material in scene.head.mesh.materials):
        return {}
    from dermis.apps.export.targets.mitsuba.meshes import painted_meshes
    from dermis.frame.renderer import Renderer

    return painted_meshes(Renderer(adapter), scene)


@dataclass(frozen=True, eq=False)
class Colours:
    """Colours of a skin: a medium has the brightest, and textures dim it.

    mean, peak : (3,) linear Rec. 709, the same for a skin that is alike everywhere
    lightest : luminance of the lightest over that of the mean
    """

    mean: Floats
    peak: Floats
    lightest: float

    def brightest(self, boundary: Boundary) -> Floats:
        """Return the colour (3,) of the medium alone; a matched surface dims by lightness alone."""
        return np.minimum(self.lightest * self.mean if boundary == "matched" else self.peak, 0.97)

    def passing(self, boundary: Boundary) -> tuple[float, ...]:
        """Return the mean share that textures let pass, both ways."""
        return floats(self.mean / self.brightest(boundary))


def colours_of(subject: Subject) -> Colours:
    """Return the colours of the subject's map, or the one of its profile."""
    texels = None if subject.head is None else subject.head.maps.colour
    if texels is None:
        colour = np.asarray(subject.albedo, np.float64)
        return Colours(colour, colour, 1.0)
    apart = max(min(texels.shape[:2]) // _SAMPLED, 1)
    found = texels[::apart, ::apart].reshape(-1, 3).astype(np.float64)
    found = found[found.sum(axis=1) > 0.0]
    mean = found.mean(axis=0)
    lightest = float(np.percentile(found @ _LUMINANCE, _BRIGHTEST) / (mean @ _LUMINANCE))
    return Colours(mean, np.maximum(np.percentile(found, _BRIGHTEST, axis=0), mean), max(lightest, 1.0))


def rough(subject: Subject) -> float:
    """Return Beckmann's roughness where no map has it."""
    return float(subject.skin.smoothing * subject.skin.roughness)


def textures(subject: Subject, colours: Colours) -> tuple[float | Map, Map | None, Map | None]:
    """Return the roughness, the share that a refracting surface lets pass, and what a matched one keeps."""
    roughness: float | Map = rough(subject)
    maps = None if subject.head is None else subject.head.maps
    if maps is not None and maps.roughness is not None:
        roughness = np.clip(maps.roughness * (rough(subject) / USUAL_ROUGHNESS), 0.02, 1.0)
    if maps is None or maps.colour is None:
        return roughness, None, None
    texels = maps.colour
    passing = np.sqrt(np.clip(texels / colours.brightest("rough"), 0.0, 1.0))
    lightness = texels @ (_LUMINANCE / (colours.brightest("matched") @ _LUMINANCE))
    held_back = 1.0 - np.clip(lightness, 0.0, 1.0)
    return roughness, passing.astype(np.float32), held_back.astype(np.float32)


TARGET = Mitsuba()
