"""How a skin is to be recoloured."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dermis.base.errors import refuse
from dermis.base.quantities import number
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import SkinParameters

_FACTORS = 0.0, 100.0


@dataclass(frozen=True)
class Share:
    """What becomes of a map of shares: a factor times it, or one of another median.

    A larger median adds the same everywhere, because pale skin's noise would be multiplied with it; a smaller
    one multiplies.
    """

    factor: float = 1.0
    median: float | None = None

    def over(self, median: float) -> tuple[float, float]:
        """Factor for a map of this median, and what is then added."""
        if self.median is None:
            return self.factor, 0.0
        if self.median < median:
            return self.median / median, 0.0
        return 1.0, self.median - median


@dataclass(frozen=True)
class Change:
    """Other pigments for the same skin; what is None stays.

    oxygen, eumelanin : shares, as of `SkinParameters` [-]
    """

    melanin: Share = Share()
    blood: Share = Share()
    oxygen: float | None = None
    eumelanin: float | None = None

    def of(self, skin: SkinParameters) -> SkinParameters:
        """The skin with what is given here."""
        given = {name: getattr(self, name) for name in ("oxygen", "eumelanin")}
        return replace(skin, **{name: one for name, one in given.items() if one is not None})

    def over(self, melanin: float, blood: float) -> tuple[Floats, Floats]:
        """Factors of melanin, blood and the third number for maps of these medians, and what is added."""
        factors, added = zip(self.melanin.over(melanin), self.blood.over(blood), (1.0, 0.0), strict=True)
        return np.array(factors), np.array(added)


def share_of(option: str, words: str) -> Share:
    """What somebody wrote: x2 for a factor, 0.1 for a median.

    Raises DermisError for anything else.
    """
    factor = words[:1] in "x×*" and bool(words)
    try:
        value = float(words[1:] if factor else words)
    except ValueError:
        refuse(option, "a factor, such as x2, or a median, such as 0.1", f"{words!r} came", "Correct it")
    if factor:
        return Share(factor=number(option, value, *_FACTORS, "a factor"))
    return Share(median=number(option, value, 0.0, 1.0, "a share of the volume"))
