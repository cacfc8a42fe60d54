"""Skin tone of meshes without a colour map, from their materials or the default skin."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles
from dermis.formats.parts import GREY
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL_PRESET
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.tissue import load_tissue

_WHITE = (1.0, 1.0, 1.0)
_TOLERANCE = 1e-3  # tolerance for colours that were rounded in files


@cache
def default_skin_colour() -> Doubles:
    """Return the diffuse reflectance (3,) of the default skin, from the spectra of its pigments [-]."""
    spectrum = load_tissue(SPECTRAL_PRESET).spectrum()
    assert spectrum is not None
    return np.asarray(rgb_weights(WAVELENGTHS_NM) @ spectrum)


def with_skin_tone(mesh: Mesh, maps: Maps) -> tuple[Maps, str]:
    """Return maps in which a uniform colour replaces a missing colour map, and a note for the user or "".

    The colour is the mean colour of the skin's materials. A material with no colour, white, or the default
    grey of Blender counts with the colour of the default skin. Maps with a colour map are returned unchanged.
    """
    if maps.colour is not None and maps.colour.shape[:2] != (1, 1):
        return maps, ""
    skin = [k for k, one in enumerate(mesh.materials) if one.kind == "skin"]
    stated = [mesh.materials[k].colour if maps.colour is None else maps.colour[0, 0] for k in skin]
    plain = [any(np.allclose(one, none, atol=_TOLERANCE) for none in (GREY, _WHITE)) for one in stated]
    colours = np.array(
        [default_skin_colour() if bare else one for one, bare in zip(stated, plain, strict=True)]
    )
    areas = np.bincount(mesh.material, triangle_areas(mesh.positions[mesh.triangles]), len(mesh.materials))
    tone = np.average(colours, axis=0, weights=areas[skin])
    if all(plain):
        pigments = f"{100 * DEFAULT_SKIN.melanin:g} % melanosomes and {100 * DEFAULT_SKIN.blood:g} % blood"
        note = f"its skin has no colour and is drawn as skin of {pigments}; --colour FILE sets another"
    else:
        differ = np.ptp(colours, axis=0).max() > _TOLERANCE
        note = (
            "its skin groups have no picture and are drawn with the mean of their colours" if differ else ""
        )
    return replace(maps, colour=tone.astype(np.float32)[None, None]), note
