"""Heads and lights for spectral frames, in which wavelengths take the place of red, green and blue."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from dermis.gpu import Constants
from dermis.human.skin.painted import PaintedMaps
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps, PartMaps
from dermis.optics.bands import Bands
from dermis.scene.lights import Light

if TYPE_CHECKING:
    from dermis.base.arrays import Floats

_HAIR_COLOURS = ("dark", "white", "dye")


def band_constants(bands: Bands | None) -> Constants:
    """Return the constant of shaders that convert RGB colours to bands; empty for red, green and blue."""
    return () if bands is None else (("BANDS", 1),)


def head_in_bands(head: Head, bands: Bands) -> Head:
    """Return a head whose maps and hairs have reflectance and absorption in bands instead of RGB colours."""
    strands, hair = head.strands, head.hair
    if strands is not None:
        absorption = bands.reflectance(strands.absorption).astype(strands.absorption.dtype)
        strands = replace(strands, absorption=absorption)
    if hair is not None:
        parameters = hair.parameters.copy()
        for name in _HAIR_COLOURS:
            parameters[name] = bands.reflectance(parameters[name])
        hair = replace(hair, parameters=parameters)
    return replace(head, maps=_maps_in_bands(head.maps, bands), strands=strands, hair=hair)


def light_in_bands(light: Light, bands: Bands) -> Light:
    """Return a light whose irradiance is relative to that of white light at each of the wavelengths."""
    irradiance = tuple(bands.reflectance(light.irradiance).tolist())
    return light.model_copy(update={"irradiance": irradiance})


def _maps_in_bands(maps: Maps, bands: Bands) -> Maps:
    colour = None if maps.colour is None else _converted(maps.colour, bands)
    parts = None if maps.parts is None else _part_maps_in_bands(maps.parts, bands)
    if isinstance(maps, PaintedMaps):
        return replace(maps, colour=colour, parts=parts, bands=bands)
    return replace(maps, colour=colour, parts=parts)


def _part_maps_in_bands(part_maps: PartMaps, bands: Bands) -> PartMaps:
    colour = part_maps.colour.copy()
    colour[..., :3] = bands.reflectance(colour[..., :3])
    emission = None if part_maps.emission is None else _converted(part_maps.emission, bands)
    return replace(part_maps, colour=colour, emission=emission)


def _converted(linear_colours: Floats, bands: Bands) -> Floats:
    return np.asarray(linear_colours @ bands.of_rgb.T.astype(np.float32), np.float32)
