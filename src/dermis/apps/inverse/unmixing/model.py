"""Skin colours as logarithms, by melanin, blood and a third number: what unmixing turns round."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from dermis.base.errors import refuse, shown_value
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import DEFAULT_SKIN, SkinParameters
from dermis.optics.skin_colours import colour_table

Third = Literal["none", "oxygen", "shade"]
DARKEST = 1e-4
"""What darker colours are taken for: no skin is [-]."""
USUAL_BLOOD, BLOOD_SPREAD = 0.1, 0.1
"""What the root of the share of blood is believed to be, mean and standard deviation: it decides where
melanin hides the blood, and nowhere else.
"""
_NODES = 129  # along melanin and along blood
_OXYGENS = 5
_OXYGEN_SPREAD, _SHADE_SPREAD, _HELD = 0.1, 0.3, 1e-3
_SHADES = -3.0, 1.5  # logarithms


@dataclass(frozen=True, eq=False)
class SkinModel:
    """Colours of skins that differ in melanin, blood and a third number.

    logs : (k, n, n, 3) logarithms of diffuse reflectance in linear Rec. 709, at the squares of n evenly
        spaced numbers from 0 to 1 of melanin and blood, and at k evenly spaced ones of oxygen
    third : oxygen is the share of haemoglobin that carries it; shade is the logarithm of a factor on all
        three channels, as light that was not even leaves it in a photograph
    span : of the third number
    usual, spread : mean and standard deviation of what it is believed to be, before any colour is seen
    """

    logs: Floats
    third: Third
    span: tuple[float, float]
    usual: float
    spread: float

    def read(self, x: Floats) -> tuple[Floats, Floats]:
        """Logarithms (t, 3) of the colours at roots of melanin and blood and a third number (t, 3), and their
        derivatives (t, 3, 3), channels first. Between nodes all is linear.
        """
        thirds, nodes = len(self.logs), self.logs.shape[1]
        i, u = _cell(x[:, 0], nodes)
        j, v = _cell(x[:, 1], nodes)
        share = (x[:, 2] - self.span[0]) / (self.span[1] - self.span[0])
        k, w = _cell(share if thirds > 1 else np.zeros(len(x)), thirds)
        far = min(1, thirds - 1)
        c = np.array([self.logs[k + (d & far), i + (e >> 1), j + (e & 1)] for d in (0, 1) for e in range(4)])
        near, across, both = c[0::2], c[1::2], v[:, None]
        rows = near + both * (across - near)  # by third and melanin
        along_q = across - near
        u, w = u[:, None], w[:, None]
        faces = rows[0::2] + u * (rows[1::2] - rows[0::2])
        by_p = _mixed(rows[1::2] - rows[0::2], w) * (nodes - 1)
        by_q = _mixed(along_q[0::2] + u * (along_q[1::2] - along_q[0::2]), w) * (nodes - 1)
        by_t = (faces[1] - faces[0]) * max(thirds - 1, 1) / (self.span[1] - self.span[0])
        found = _mixed(faces, w)
        if self.third == "shade":
            found, by_t = found + x[:, 2:], np.ones_like(found)
        return found, np.stack([by_p, by_q, by_t], axis=-1)

    def colours(self, melanin: Floats, blood: Floats, third: Floats | float | None = None) -> Floats:
        """(t, 3) diffuse reflectance, linear Rec. 709, of shares (t,) of melanin and blood [-]."""
        last = np.broadcast_to(self.usual if third is None else third, np.shape(melanin))
        x = np.stack([np.sqrt(melanin), np.sqrt(blood), last], axis=-1)
        return np.asarray(np.exp(self.read(x)[0]))


def _cell(share: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    """The node before each share, and how far it is to the next."""
    place = np.clip(share, 0.0, 1.0) * (nodes - 1)
    before = np.clip(place.astype(np.int64), 0, max(nodes - 2, 0))
    return before, place - before


def _mixed(pair: Floats, share: Floats) -> Floats:
    return np.asarray(pair[0] + share * (pair[1] - pair[0]))


def skin_model(skin: SkinParameters = DEFAULT_SKIN, third: Third = "none") -> SkinModel:
    """The colours of all skins like this one, by layered diffusion; its own melanin and blood are ignored.

    third : what colour is to tell beside melanin and blood; "none" holds the skin's own oxygen

    Raises DermisError for another third.
    """
    if third not in get_args(Third):
        refuse("third", ", ".join(get_args(Third)), f"{shown_value(third)} came", "Take one of them")
    return _model(replace(skin, melanin=0.0, blood=0.0, epidermal_blood=0.0), third)


@lru_cache(maxsize=8)
def _model(skin: SkinParameters, third: Third) -> SkinModel:
    if third == "oxygen":
        oxygens = np.linspace(0.0, 1.0, _OXYGENS)
        return SkinModel(_logs(skin, oxygens), third, (0.0, 1.0), skin.oxygen, _OXYGEN_SPREAD)
    logs = _logs(skin, [skin.oxygen])
    if third == "shade":
        return SkinModel(logs, third, _SHADES, 0.0, _SHADE_SPREAD)
    return SkinModel(logs, third, (-1.0, 1.0), 0.0, _HELD)


def _logs(skin: SkinParameters, oxygens: Floats | list[float]) -> Floats:
    tables = [colour_table(replace(skin, oxygen=float(one)), _NODES).colours for one in oxygens]
    return np.log(np.maximum(np.stack(tables), DARKEST))
