"""Frame pacing: trades quality for speed while something moves."""

from __future__ import annotations

from dataclasses import dataclass

from dermis.apps.viewer.state import changed
from dermis.scene.settings import MOST_WORK, Settings

_BUDGET_MS = {True: 100.0, False: 33.0}  # of a frame in motion, on a software adapter and on a GPU
_MOST_MS_OVER, _LEAST_SHARE = 1.25, 0.45
_PATIENCE = 2  # slow or fast frames in a row before a change: a single one may have lit the atlas again


@dataclass(frozen=True)
class Quality:
    """Quality limits of a frame in motion; a still one has all that the settings ask for.

    scale : of the image's sides
    samples, atlas, shadow_size : maxima
    """

    scale: float
    samples: int
    atlas: int
    shadow_size: int


_ALL = 1 << 14
QUALITY_LEVELS = (
    Quality(1.0, _ALL, _ALL, _ALL),
    Quality(1.0, 2, 1024, 1024),
    Quality(1.0, 1, 512, 512),
    Quality(0.75, 1, 512, 512),
    Quality(0.5, 1, 256, 512),
    Quality(0.35, 1, 256, 256),
)
_FIRST_ON_SOFTWARE = 2


class Pace:
    """Chooses the quality of frames in motion from the time that the last ones took.

    software : whether the adapter renders on the CPU
    """

    def __init__(self, software: bool) -> None:
        self.software = software
        self._budget_ms = _BUDGET_MS[software]
        self._level = self._first = _FIRST_ON_SOFTWARE if software else 0
        self._streak = 0

    @property
    def quality(self) -> Quality:
        """Quality of the next frame in motion."""
        return QUALITY_LEVELS[self._level]

    def note(self, frame_ms: float) -> None:
        """Record the time of the last frame in motion, without preparation [ms]."""
        slow, fast = frame_ms > _MOST_MS_OVER * self._budget_ms, frame_ms < _LEAST_SHARE * self._budget_ms
        wish = slow - fast
        self._streak = self._streak + wish if wish * self._streak >= 0 else wish
        if not wish:
            self._streak = 0
        if abs(self._streak) >= _PATIENCE:
            self._level = max(self._first, min(len(QUALITY_LEVELS) - 1, self._level + wish))
            self._streak = 0

    def settings(self, wanted: Settings, size: tuple[int, int], moving: bool) -> Settings:
        """The settings of a frame for a window of that size."""
        quality = self.quality if moving else QUALITY_LEVELS[0]
        width, height = (max(1, round(quality.scale * side)) for side in size)
        return changed(
            wanted,
            size=(width, height),
            samples=min(wanted.samples, quality.samples, max(1, MOST_WORK // (width * height))),
            atlas=min(wanted.atlas, quality.atlas),
            shadow_size=min(wanted.shadow_size, quality.shadow_size),
        )
