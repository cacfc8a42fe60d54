"""Bibliography keys of the methods used to render a picture, for `dermis cite` and metadata."""

from __future__ import annotations

from collections.abc import Sequence

from dermis.scene.environment import Environment
from dermis.scene.lights import Light
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES

_FRAME_CITATION_KEYS = ("dEonLuebke2007", "Burns2013")
_FRESNEL_CITATION_KEYS = {"schlick": ("Schlick1994", "Dudash2007"), "exact": ("CookTorrance1982",)}
_HALF_SPACE_CITATION_KEYS = ("Chandrasekhar1960", "Jensen2001")
_ANISOTROPY_CITATION_KEYS = ("HenyeyGreenstein1941", "Wiscombe1977")
_TONE_MAPPING_CITATION_KEYS = {"none": (), "filmic": ("Hable2010",), "neutral": ("Khronos2024",)}
_SHADOW_CITATION_KEYS = ("Williams1978", "Reeves1987", "Hanika2021")
_RELIEF_CITATION_KEYS = ("Mikkelsen2010", "OlanoBaker2010")
_ENVIRONMENT_CITATION_KEYS = ("RamamoorthiHanrahan2001", "KautzMcCool2000", "Karis2013", "Debevec2005")
_OCCLUSION_CITATION_KEYS = ("Keinert2015", "Jimenez2016", "LagardeRousiers2014")


def picture_citation_keys(
    skin: Skin,
    settings: Settings,
    lights: Sequence[Light] = (),
    environment: Environment | None = None,
    *,
    has_relief: bool = True,
) -> tuple[str, ...]:
    """Return the bibliography keys of all methods used for a picture, without duplicates.

    has_relief : whether the head has a normal map or height map

    Raises DermisError for an unknown profile.
    """
    keys = [*_FRAME_CITATION_KEYS, *scattering_citation_keys(settings), *_surface_citation_keys(skin)]
    keys += profile_citation_keys(skin)
    if skin.direction == "half-space":
        keys += _HALF_SPACE_CITATION_KEYS + _ANISOTROPY_CITATION_KEYS * (skin.anisotropy > 0)
    keys += _RELIEF_CITATION_KEYS * has_relief
    keys += _light_citation_keys(lights)
    if environment is not None:
        keys += _ENVIRONMENT_CITATION_KEYS + _OCCLUSION_CITATION_KEYS * (settings.occlusion != "none")
    keys += _TONE_MAPPING_CITATION_KEYS[settings.tone]
    keys += ("BurtAdelson1983",) * (settings.bloom > 0)
    return tuple(dict.fromkeys(keys))


def scattering_citation_keys(settings: Settings) -> tuple[str, ...]:
    """Return the bibliography keys of the scattering technique, the seam treatment, and translucency."""
    technique = TECHNIQUES[settings.technique]
    substituted = settings.seams != "stitch" or not technique.stitches_seams
    keys: tuple[str, ...] = technique.sources + ("Dudash2007",) * (substituted and technique.uses_atlas)
    if settings.transmission == "thin" and technique.supports_translucency:
        keys += ("JensenBuhler2002",)
    return keys


def profile_citation_keys(skin: Skin) -> tuple[str, ...]:
    """Return the bibliography keys of a skin's diffusion profile; empty for Gaussians from a user's file."""
    from dermis.optics.profiles import find_gaussians
    from dermis.scene.tissue import skin_tissue

    if find_gaussians(skin.profile) is not None:
        return ("dEonLuebke2007", "DonnerJensen2005") if skin.profile == "gpu-gems-3" else ()
    return skin_tissue(skin).profile().sources


def _surface_citation_keys(skin: Skin) -> tuple[str, ...]:
    from dermis.specular.models import MODELS

    if skin.specular == "none":
        return ()
    energy = ("Kelemen2001",) * (skin.energy != "none")
    return MODELS[skin.specular].sources + _FRESNEL_CITATION_KEYS[skin.fresnel] + energy


def _light_citation_keys(lights: Sequence[Light]) -> tuple[str, ...]:
    keys: tuple[str, ...] = _SHADOW_CITATION_KEYS * any(light.shadows for light in lights)
    return keys + tuple(key for light in lights for key in light.sources)
