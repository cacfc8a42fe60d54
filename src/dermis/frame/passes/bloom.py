"""Light that the lens scatters around: ever wider Gaussians of the whole picture, without a threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from dermis.frame.passes import STAGES
from dermis.gpu import ComputeProgram, Device, Frame, make_texture

_COARSEST = 4  # halvings short of one pixel: the widest Gaussian spans a sixteenth of the picture


@dataclass(frozen=True)
class Glow:
    """Space for a picture's halvings, for the sums on the way back, and for the result."""

    halved: list[Any]
    sums: list[Any]
    result: Any


class Bloom:
    """Scatters a share of the light; what one place loses others gain."""

    def __init__(self, device: Device) -> None:
        self._device = device
        path = STAGES / "bloom.wgsl"
        self._halve, self._widen = (ComputeProgram(device, path, constants={"WIDEN": w}) for w in (0, 1))

    def make_glow(self, size: tuple[int, int]) -> Glow:
        """Space for a picture of size (width, height)."""
        count = max(1, int(math.log2(min(size))) - _COARSEST) if min(size) > 1 else 1
        sides = [(max(1, size[0] >> k), max(1, size[1] >> k)) for k in range(1, count + 1)]
        halved, sums = ([make_texture(self._device, side, "rgba32float") for side in sides] for _ in range(2))
        return Glow(halved, sums[:-1], make_texture(self._device, size, "rgba32float"))

    def draw(self, frame: Frame, glow: Glow, picture: Any, share: float) -> Any:
        """The picture with `share` of its light scattered; the texture belongs to `glow`."""
        source = picture
        for halved in glow.halved:
            self._step(frame, self._halve, source, source, halved, 0.0, 0.0)
            source = halved
        for own, total in zip(reversed(glow.halved[:-1]), reversed(glow.sums), strict=True):
            self._step(frame, self._widen, own, source, total, 1.0, 1.0)
            source = total
        self._step(frame, self._widen, picture, source, glow.result, 1.0 - share, share / len(glow.halved))
        return glow.result

    def _step(
        self, frame: Frame, program: ComputeProgram, own: Any, smaller: Any, into: Any, *factors: float
    ) -> None:
        record = program.record("Bloom", own=factors[0], wider=factors[1])
        bound = {"bloom": record, "picture": own, "smaller": smaller, "result": into}
        frame.compute("bloom", program, bound, into.size[:2])
