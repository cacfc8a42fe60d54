"""Settings that reproduce faults and older methods shown in the 2007 talk [Dudash2007], for comparison.

These settings are fields of `Skin` and `Settings`. Help texts and the viewer list them last, under a separate
heading.

Source: [dEonLuebke2007].
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.frozen_model import Colour, HelpHeading
from dermis.specular.models import EnergyConservationName

COMPARISONS_HEADING = HelpHeading("Comparisons of the 2007 talk")

_SPECULAR_COLOUR_HELP = 'Colour of reflections; "wrong" multiplies them by the colour map.'
SpecularColour = Annotated[
    Literal["white", "wrong"], COMPARISONS_HEADING, Field(description=_SPECULAR_COLOUR_HELP)
]

_ENERGY_HELP = """Energy conservation of diffuse light: "full" subtracts what the surface reflects,
"published" subtracts pi times too much, as the talk does, "none" subtracts nothing."""
EnergyConservation = Annotated[EnergyConservationName, COMPARISONS_HEADING, Field(description=_ENERGY_HELP)]

_STRETCH_HELP = """Correction of blur kernels for the uv layout: "full" for stretch and shear, "axes" for
stretch alone, "none" for the same kernel everywhere."""
StretchCorrection = Annotated[
    Literal["full", "axes", "none"], COMPARISONS_HEADING, Field(description=_STRETCH_HELP)
]

_SEAMS_HELP = """How seams in the uv layout are treated: "stitch" diffuses light across them; the other
methods are the talk's. Techniques that cannot stitch use "clear-colour" instead."""
SeamTreatment = Annotated[
    Literal["stitch", "none", "clear-colour", "stretch-map", "alpha", "multi-uv"],
    COMPARISONS_HEADING,
    Field(description=_SEAMS_HELP),
]

_SEAM_COLOUR_HELP = 'Light between the charts with seams "clear-colour", as irradiance divided by pi.'
SeamColour = Annotated[Colour, COMPARISONS_HEADING, Field(description=_SEAM_COLOUR_HELP)]

_GAMMA_HELP = (
    'Colour space: "wrong" reads the colour map as linear and leaves out the sRGB encoding of the picture.'
)
GammaHandling = Annotated[Literal["right", "wrong"], COMPARISONS_HEADING, Field(description=_GAMMA_HELP)]
