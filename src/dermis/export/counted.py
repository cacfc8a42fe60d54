"""Profiles of tissue that the package has counted photons for."""

from __future__ import annotations

from dermis.export.curve import Curve
from dermis.export.half_space import half_space
from dermis.optics.media import SKIN_ETA
from dermis.optics.tissue import Tissue


def counted_curve(tissue: Tissue) -> Curve | None:
    """The curve of one layer without end under skin's surface, scattering made isotropic; None for others."""
    medium = tissue.medium
    layer = medium.layers[0]
    plain = tissue.rgb is None and len(medium.layers) == 1 and medium.semi_infinite
    if not plain or medium.eta != SKIN_ETA or medium.channels != 3:
        return None
    return half_space("skin", layer.alpha_prime, layer.mean_free_path_mm)
