"""Skin tone of meshes without a colour map: a measured tone, the tone of the materials, or the default."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.formats.parts import DEFAULT_COLOUR
from dermis.human.skin.measured import measured_tone
from dermis.mesh.geometry import triangle_areas
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL_PRESET
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.tissue import load_tissue

SKIN_WITHOUT_COLOUR_MAP = "skin without a colour map"
_WHITE = (1.0, 1.0, 1.0)
_COLOUR_TOLERANCE = 1e-3  # tolerance for colours that were rounded in files


@cache
def default_skin_colour() -> Doubles:
    """Return the diffuse reflectance (3,) of the default skin, from the spectra of its pigments [-]."""
    spectrum = load_tissue(SPECTRAL_PRESET).spectrum()
    assert spectrum is not None
    return np.asarray(rgb_weights(WAVELENGTHS_NM) @ spectrum)


def with_skin_tone(
    mesh: Mesh, maps: Maps, skin_site: str | None = None, colour_map_chosen: bool = False
) -> tuple[Maps, str]:
    """Return maps in which a uniform colour replaces a missing colour map, and a note for the user.

    skin_site : name of a measured colour to use instead of the materials' colours, see `measured_tone`
    colour_map_chosen : whether the user has chosen the colour map

    By default, the uniform colour is the mean colour of the skin's materials. For a material that has no
    colour of its own, because it is white or has Blender's default grey, the colour of the default skin
    enters the mean. Maps with a colour map are returned unchanged. The note is "" if there is nothing to say.

    Raises DermisError for an unknown `skin_site`, and for a `skin_site` together with a colour map.
    """
    if colour_map_chosen or (maps.colour is not None and maps.colour.shape[:2] != (1, 1)):
        if skin_site is not None:
            refuse(
                "skin_site", SKIN_WITHOUT_COLOUR_MAP, "the skin has a colour map", "Leave one of the two out"
            )
        return maps, ""
    if skin_site is not None:
        measured = measured_tone(skin_site)
        return replace(maps, colour=measured.colour.astype(np.float32)[None, None]), measured.note
    skin = [k for k, one in enumerate(mesh.materials) if one.kind == "skin"]
    stated = [mesh.materials[k].colour if maps.colour is None else maps.colour[0, 0] for k in skin]
    plain = [
        any(np.allclose(one, none, atol=_COLOUR_TOLERANCE) for none in (DEFAULT_COLOUR, _WHITE))
        for one in stated
    ]
    colours = np.array(
        [default_skin_colour() if bare else one for one, bare in zip(stated, plain, strict=True)]
    )
    areas = np.bincount(mesh.material, triangle_areas(mesh.positions[mesh.triangles]), len(mesh.materials))
    tone = np.average(colours, axis=0, weights=areas[skin])
    if all(plain):
        pigments = f"{100 * DEFAULT_SKIN.melanin:g} % melanosomes and {100 * DEFAULT_SKIN.blood:g} % blood"
        note = f"its skin has no colour and is drawn as skin of {pigments}; --colour FILE sets another"
    else:
        differ = np.ptp(colours, axis=0).max() > _COLOUR_TOLERANCE
        note = (
            "its skin groups have no picture and are drawn with the mean of their colours" if differ else ""
        )
    return replace(maps, colour=tone.astype(np.float32)[None, None]), note
