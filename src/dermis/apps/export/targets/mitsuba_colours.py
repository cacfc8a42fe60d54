"""The colours of a skin as Mitsuba can have them: a medium for the brightest, and textures that dim it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.mitsuba_files import Boundary
from dermis.optics.media import Floats
from dermis.scene.skin import USUAL_ROUGHNESS, Skin

_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_BRIGHTEST = 99.0  # percentile; what is brighter is shown as that
_SAMPLED = 512  # texels of a map's side that the percentile is taken on
Map = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Colours:
    """Of a skin.

    mean, peak : (3,) linear Rec. 709, the same for a skin that is alike everywhere
    lightest : luminance of the lightest over that of the mean
    """

    mean: Floats
    peak: Floats
    lightest: float

    def brightest(self, boundary: Boundary) -> Floats:
        """(3,) what the medium alone brings back; a matched surface dims by lightness alone."""
        return np.minimum(self.lightest * self.mean if boundary == "matched" else self.peak, 0.97)

    def passing(self, boundary: Boundary) -> tuple[float, ...]:
        """What textures let pass on the mean, both ways."""
        return tuple(map(float, self.mean / self.brightest(boundary)))


def colours_of(subject: Subject) -> Colours:
    """The colours of the subject's map, or the one of its profile."""
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
    """Beckmann roughness where no map has it."""
    skin = _skin(subject)
    return float(skin.smoothing * skin.roughness)


def textures(subject: Subject, colours: Colours) -> tuple[float | Map, Map | None, Map | None]:
    """Roughness, what a refracting surface lets pass each way, and what a matched one holds back."""
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


def _skin(subject: Subject) -> Skin:
    return Skin() if subject.scene is None else subject.scene.skin
