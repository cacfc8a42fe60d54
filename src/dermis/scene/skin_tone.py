"""Skin tone of meshes whose files state no colour."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from dermis.formats.parts import GREY, Colour
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SPECTRAL_PRESET
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.tissue import load_tissue


@cache
def default_skin_colour() -> Colour:
    """Return the diffuse reflectance of the default skin, computed from the spectra of its pigments [-]."""
    spectrum = load_tissue(SPECTRAL_PRESET).spectrum()
    assert spectrum is not None
    red, green, blue = (round(float(one), 4) for one in rgb_weights(WAVELENGTHS_NM) @ spectrum)
    return red, green, blue


def with_skin_tone(mesh: Mesh, maps: Maps) -> tuple[Mesh, str]:
    """Return a mesh whose skin has the colour of the default skin where the file states none, and a note or "".

    The grey that programs give to new materials counts as no colour.
    """
    plain = [one.kind == "skin" and one.colour == GREY for one in mesh.materials]
    if maps.colour is not None or not any(plain):
        return mesh, ""
    tone = default_skin_colour()
    materials = [
        replace(one, colour=tone) if bare else one for one, bare in zip(mesh.materials, plain, strict=True)
    ]
    pigments = f"{100 * DEFAULT_SKIN.melanin:g} % melanosomes and {100 * DEFAULT_SKIN.blood:g} % blood"
    note = f"its skin has no colour and is drawn as skin of {pigments}; --colour FILE sets another"
    return replace(mesh, materials=tuple(materials)), note
