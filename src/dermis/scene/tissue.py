"""Conversion of skin settings to tissue, the layered optical medium that the settings describe."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from dermis.optics.media import Layer
from dermis.optics.tissue import Tissue, load_tissue
from dermis.scene.skin import Pigments, Skin, TissueLayer


def skin_tissue(skin: Skin) -> Tissue:
    """Return the tissue of a skin: the tissue of its profile, overridden by the skin's pigments or layers.

    Raises DermisError for a profile that does not describe a tissue, and for overrides of pigments or layers
    that the tissue lacks.
    """
    if skin.layers:
        return load_tissue(skin.profile).with_layers(_to_media_layers(skin.layers))
    pigments = skin.pigments or Pigments()
    return load_tissue(skin.profile, pigments.structure, pigments.overrides())


def tissue_layers(skin: Skin) -> tuple[TissueLayer, ...]:
    """Return the layers of a skin's tissue; empty for a tissue given by spectra instead of RGB coefficients.

    Raises DermisError for a profile that does not describe a tissue.
    """
    if skin.layers:
        return skin.layers
    tissue = skin_tissue(skin)
    return () if tissue.rgb is not None else tuple(map(_to_scene_layer, tissue.medium.layers))


def _to_scene_layer(layer: Layer) -> TissueLayer:
    return TissueLayer(
        name=layer.name,
        thickness_mm=float(layer.thickness_mm) if np.isfinite(layer.thickness_mm) else None,
        absorption_per_mm=tuple(layer.sigma_a.tolist()),
        scattering_per_mm=tuple(layer.sigma_s_prime.tolist()),
    )


def _to_media_layers(layers: Iterable[TissueLayer]) -> tuple[Layer, ...]:
    return tuple(
        Layer(
            np.array(layer.absorption_per_mm),
            np.array(layer.scattering_per_mm),
            float("inf") if layer.thickness_mm is None else layer.thickness_mm,
            layer.name,
        )
        for layer in layers
    )
