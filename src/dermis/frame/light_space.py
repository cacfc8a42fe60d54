"""Space for the outputs of light and of what is below the skin, and what they need of a scene."""

from __future__ import annotations

from typing import Any

from dermis.base.errors import DermisError, refuse
from dermis.frame.asked import Asked
from dermis.frame.atlas_layout import AtlasLayout
from dermis.frame.passes.outputs import thickness
from dermis.frame.passes.outputs.light import LightSpace
from dermis.frame.passes.outputs.pigments import Pigmented
from dermis.frame.techniques.technique import Technique
from dermis.gpu import Device, Memo
from dermis.optics.pigments.parameters import SKINS, SkinParameters
from dermis.scene.skin import Skin
from dermis.scene.techniques import TECHNIQUES
from dermis.scene.tissue import tissue_of

_THROUGH = ("translucent", "thickness")
_PIGMENTS = ("melanin", "blood")


def light_space(memo: Memo, device: Device, asked: Asked, layouts: tuple[AtlasLayout, ...]) -> LightSpace:
    """Space for outputs of light, and where those of what is below the skin come from.

    Raises DermisError for outputs that the technique, the lights or the skin do not have.
    """
    wanted, keep, pairs = set(asked.outputs), memo.keep, _pairs(asked, layouts)
    if "visibility" in wanted and not asked.parts:
        refuse("output visibility", "a scene with lights", "it has none", "Add one, or leave the output out")
    through: tuple[Any, ...] = ()
    if "translucent" in wanted:
        roles = [*map(str, range(len(layouts))), *(["both"] if layouts[1:] else [])]
        through = tuple(
            keep(_make_sum, device, asked.technique, asked.settings.atlas, of=f"through {role}")
            for role in roles
        )
    return LightSpace(
        parts=asked.parts,
        apart=asked.technique.make_apart(memo, device, asked.settings) if "diffuse" in wanted else None,
        through=through,
        thickness=keep(thickness.make_map, device, pairs) if "thickness" in wanted else None,
        pigmented=_pigmented(asked) if wanted & set(_PIGMENTS) else None,
    )


def _make_sum(device: Device, technique: Technique, side: int) -> Any:
    return technique.make_sum(device, side)


def _pairs(asked: Asked, layouts: tuple[AtlasLayout, ...]) -> Any:
    """The pairs of places that light passes between, None where nobody asks for what comes of them."""
    culprit = next((name for name in asked.outputs if name in _THROUGH), None)
    if culprit is None:
        return None
    thin, settings = layouts[0].translucency, asked.settings
    if thin is None:
        able = ", ".join(name for name in TECHNIQUES.names if TECHNIQUES[name].transmits)
        came = f"technique {settings.technique} with transmission {settings.transmission} came"
        expected = f"light that passes thin parts: transmission thin with technique {able}"
        refuse(f"output {culprit}", expected, came, "Choose these, or leave the output out")
    return thin.pairs


def _pigmented(asked: Asked) -> Pigmented:
    """Where the skin's melanin and blood are known from.

    Raises DermisError for skin that is not made of pigments.
    """
    maps = asked.head.maps
    if asked.painted_side and asked.white and maps.colour is None and maps.roughness is None:
        return Pigmented(None)
    found = _parameters(asked.skin)
    if found is None:
        culprit = next(name for name in asked.outputs if name in _PIGMENTS)
        skins = ", ".join(SKINS)
        expected = f"a person's painted skin, or a profile made of pigments ({skins} or a file's)"
        came = f"profile {asked.skin.profile} on {asked.head.name}"
        refuse(f"output {culprit}", expected, came, "Choose one of them, or leave the output out")
    return Pigmented((found.melanin, found.blood))


def _parameters(skin: Skin) -> SkinParameters | None:
    """Those of a profile that is made of pigments."""
    try:
        return tissue_of(skin).parameters
    except DermisError:  # profiles that are no tissue, as the default
        return None
