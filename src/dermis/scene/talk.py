"""Comparisons of the talk of 2007: dials that show a mistake, or a remedy of its time.

They are fields of `Skin` and `Settings`, which the gallery needs; help texts and the viewer list them last,
under a heading of their own.

Source: [dEonLuebke2007].
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.frozen_model import Colour, Heading
from dermis.specular.models import EnergyName

COMPARISONS = Heading("Comparisons of the 2007 talk")

_SPECULAR_COLOUR = 'Colour of reflections; "wrong" tints them by the colour map.'
SpecularColour = Annotated[Literal["white", "wrong"], COMPARISONS, Field(description=_SPECULAR_COLOUR)]

_ENERGY = """Light that the surface reflects does not enter: "full" subtracts it all, "published" as the deck
does, pi times too much, "none" nothing."""
Energy = Annotated[EnergyName, COMPARISONS, Field(description=_ENERGY)]

_STRETCH = """Correction of blurs for the uv layout: "full" for its stretch and shear, "axes" as if u and v
were at right angles, "none" to blur alike everywhere."""
Stretch = Annotated[Literal["full", "axes", "none"], COMPARISONS, Field(description=_STRETCH)]

_SEAMS = """What is done at the seams of the uv layout: "stitch" lets light cross them; the others are the
talk's remedies. Techniques that cannot stitch take "clear-colour" instead."""
Seams = Annotated[
    Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"],
    COMPARISONS,
    Field(description=_SEAMS),
]

_SEAM_COLOUR = 'Light between the charts for "clear-colour" seams, as irradiance over pi.'
SeamColour = Annotated[Colour, COMPARISONS, Field(description=_SEAM_COLOUR)]

_GAMMA = 'Colour space: "wrong" takes the colour map to be linear and leaves the encoding out.'
Gamma = Annotated[Literal["right", "wrong"], COMPARISONS, Field(description=_GAMMA)]
