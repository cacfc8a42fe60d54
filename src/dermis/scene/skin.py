"""What the skin is made of, as far as its maps do not say."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from dermis.scene.plain import Plain


class Skin(Plain):
    """Parameters of the two layers: the rough white surface, and what scatters below.

    profile : preset name or CSV file of the diffusion profile
    albedo : "map" renormalises the profile to white and takes the colour from the map; "profile" keeps
        the profile's own colour and uses no map
    mix : share of the colour map applied before scattering, the rest after it [0..1]
    roughness : Beckmann roughness m [-]
    rho_s : strength of the surface lobe [-]

    Source: [dEonLuebke2007] sections 14.3-14.5; values of [Dudash2007].
    """

    profile: str = "gpu-gems-3"
    albedo: Literal["map", "profile"] = "map"
    mix: Annotated[float, Field(ge=0, le=1)] = 0.5
    roughness: Annotated[float, Field(ge=0.05, le=1)] = 0.3
    rho_s: Annotated[float, Field(ge=0, le=1)] = 0.18
