"""The thin parts of a head: their translucent pairs, and space for the light that passes between them."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.atlas.atlas import Atlas
from dermis.atlas.cached import cached_pairs, pairs_key
from dermis.frame.kept import Kept
from dermis.frame.passes.translucency import Thin
from dermis.frame.passes.translucency_weights import Pairs, TranslucencyWeights, source_level, upload_pairs
from dermis.gpu import Device
from dermis.mesh.head import Head
from dermis.mesh.mesh import Mesh
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
_WITH_TRANSMISSION = ("texture-space", "gpu-gems-3")
_WIDTHS_TO_DOUBLE, _LEAST_SHARED_MM = 2, 0.5


def lets_through(settings: Settings) -> bool:
    """Whether light comes through thin parts."""
    return settings.transmission == "thin" and settings.technique in _WITH_TRANSMISSION


def shared_width(widest_mm: float) -> float:
    """The nearest of a few widths [mm]: similar skins share their pairs."""
    step = round(_WIDTHS_TO_DOUBLE * float(np.log2(max(widest_mm, _LEAST_SHARED_MM))))
    return float(2.0 ** (step / _WIDTHS_TO_DOUBLE))


def pairs_of(device: Device, mesh: Mesh, atlas: Atlas, widest_mm: float, *, changing: bool) -> Pairs:
    """The translucent pairs of a mesh, searched for or read from disk.

    widest_mm : standard deviation of the widest Gaussian [mm]
    changing : whether profiles come and go, so that it is not worth while to keep what each lets pass
    """
    key = "" if changing else pairs_key(mesh, atlas, widest_mm)
    return upload_pairs(device, cached_pairs(mesh, atlas, widest_mm), key)


@dataclass
class Latest:
    """What was found last for a head and an atlas, and the search that was begun last."""

    pairs: Pairs | None = None
    search: Future[Pairs] | None = None


class ThinParts:
    """The translucent pairs of heads, searched for on another thread.

    patient : whether frames wait for it; else those of the last skin stand in while the search goes on
    """

    def __init__(self, device: Device, kept: Kept) -> None:
        self._device, self._kept = device, kept
        self.patient = True
        self._awaited: Future[Pairs] | None = None

    @property
    def provisional(self) -> bool:
        """Whether something stood in for what is looked for in the frame that was begun last."""
        return self._awaited is not None

    @property
    def searching(self) -> bool:
        """Whether what that frame should have shown is still looked for."""
        return self._awaited is not None and not self._awaited.done()

    def begin(self) -> None:
        """Begin a frame."""
        self._awaited = None

    def pairs(self, index: int, head: Head, atlas: Atlas, widest_mm: float, *, changing: bool) -> Pairs:
        """What `pairs_of` says, or a skin's of other width.

        index : of the layout
        """

        def search() -> Future[Pairs]:
            return self._device.executor.submit(
                pairs_of, self._device, head.mesh, atlas, widest_mm, changing=changing
            )

        latest = self._kept.keep(f"latest pairs {index}", (head, atlas), Latest)
        if latest.pairs is None or latest.search is None or self.patient or latest.search.done():
            latest.search = self._kept.keep(f"pairs {index}", (head, atlas, repr(widest_mm)), search)
            if latest.pairs is None or self.patient or latest.search.done():
                latest.pairs = self._result(latest.search)
                return latest.pairs
        self._awaited = latest.search
        return latest.pairs

    def _result(self, search: Future[Pairs]) -> Pairs:
        try:
            return search.result()
        except Exception:
            self._kept.forget_all()  # a search that failed must not be found again
            raise


def thin_of(
    device: Device, stage: TranslucencyWeights, pairs: Pairs, variance_mm2: Floats, weight: Floats
) -> Thin:
    """What a profile lets pass between pairs, and space for it.

    variance_mm2, weight : (k,) and (k, 3) of the blurred levels
    """
    gathered = device.buffer(np.zeros((pairs.source_count, 2), np.uint32), "STORAGE")
    weights = stage.weigh(pairs, variance_mm2, weight)
    return Thin(pairs, weights, source_level(pairs, variance_mm2), gathered)
