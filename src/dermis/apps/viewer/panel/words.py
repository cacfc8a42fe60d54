"""What people call the fields of a scene and the words that they take, where the models are brief.

A label is "shown###name": the name is the field's, by which the panel knows its controls.
"""

from __future__ import annotations

from dermis.apps.viewer.panel.fields import Style

SURFACE = {
    "mix": Style("colour before blur###mix"),
    "roughness": Style("roughness m###roughness"),
    "rho_s": Style("specular strength ρ_s###rho_s"),
    "specular": Style(
        "specular BRDF###BRDF",
        called={
            "kelemen": "Kelemen, Szirmay-Kalos",
            "torrance-sparrow": "Torrance-Sparrow",
            "torrance-sparrow-smith": "Torrance-Sparrow, Smith's G",
            "blinn-phong": "Blinn-Phong",
            "blinn-phong-plain": "Blinn-Phong, not normalised",
            "phong": "Phong",
            "phong-plain": "Phong, not normalised",
            "two-lobe": "two lobes",
            "kelemen-direct": "Kelemen, without its table",
        },
    ),
    "fresnel": Style("Fresnel###Fresnel", called={"schlick": "Schlick", "exact": "exact dielectric"}),
    "specular_colour": Style("reflection colour###reflection", called={"wrong": "albedo (wrong)"}),
    "energy": Style("energy conserved###energy", called={"none": "no", "published": "as published"}),
    "direction": Style("exit direction###direction", called={"lambertian": "Lambertian"}),
}
"""Of `Skin`, for its surface."""

ALBEDO = {"albedo": Style("colour by###colour from", called={"map": "albedo map", "profile": "profile"})}
"""Of `Skin`, for its profile."""

TECHNIQUE = {
    "technique": Style(
        called={"none": "none (dry skin)", "one-blur": "one Gaussian", "gpu-gems-3": "GPU Gems 3"}
    ),
    "stretch": Style(
        "stretch correction###stretch", called={"full": "stretch and shear", "axes": "along u and v"}
    ),
    "seams": Style("uv seams###seams", called={"stitch": "stitched", "none": "left open"}),
    "transmission": Style("translucency###transmission", called={"thin": "thin parts"}),
    "occlusion": Style("ambient occlusion###occlusion", called={"baked": "as posed", "rest": "as at rest"}),
    "strands": Style("hairs###strands"),
    "tone": Style("tone curve###tone", called={"none": "none (linear)", "neutral": "Khronos neutral"}),
    "gamma": Style(called={"right": "gamma-correct", "wrong": "not gamma-correct"}),
}
"""Of `Settings`."""

LAYER = {
    "thickness_mm": Style("thickness###thickness"),
    "absorption_per_mm": Style("absorption σ_a###absorption"),
    "scattering_per_mm": Style("scattering σ_s'###scattering"),
}
"""Of `TissueLayer`."""

LIGHT = {
    "irradiance": Style("colour###irradiance"),
    "softness_mm": Style("shadow softness###softness"),
    "shadows": Style("casts shadows###shadows"),
    "angle_degrees": Style("angular size###angle"),
}
"""Of the lights."""

LIGHT_KINDS = {
    "point": "point light",
    "spot": "spotlight",
    "rectangle": "softbox (rectangle)",
    "sphere": "globe (sphere)",
    "directional": "sun (directional)",
    "stripe": "laser stripe",
}
"""Kinds of lights."""

PROFILES = {
    "gpu-gems-3": "GPU Gems 3",
    "skin1": "skin 1 (measured)",
    "skin2": "skin 2 (measured)",
    "dj3": "three layers of skin",
    "spectral": "spectral skin",
    "light": "light skin",
    "medium": "medium skin",
    "dark": "dark skin",
    "skimmilk": "skim milk",
    "wholemilk": "whole milk",
    "chicken1": "chicken 1",
    "chicken2": "chicken 2",
}
"""Names of profiles: first those of skin, then some of other media."""
