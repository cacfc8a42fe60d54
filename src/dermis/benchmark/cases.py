"""Which frames are measured: a usual one, and others that differ from it in one thing each."""

from __future__ import annotations

from dataclasses import dataclass, replace

GPU_GEMS_3 = "gpu-gems-3"
FRAGMENTS = "published-fragments"
"""The passes of 2007 in the graphics pipeline; `GPU_GEMS_3` has the same in compute."""


@dataclass(frozen=True)
class Case:
    """One frame to measure.

    image : (width, height) [pixel]
    atlas : side of the irradiance map [texel]
    gaussians : terms of the profile
    lights : spots with shadows
    environment : name of the light around, "" for none beside the lights
    subdivide : levels of subdivision of the head: four times the triangles each
    samples : of a pixel
    technique : of `Settings`, or `FRAGMENTS`
    varies : what tells it from the usual frame, "" for that itself
    """

    image: tuple[int, int] = (1920, 1080)
    atlas: int = 2048
    gaussians: int = 6
    lights: int = 3
    environment: str = ""
    subdivide: int = 0
    samples: int = 4
    technique: str = "texture-space"
    varies: str = ""


@dataclass(frozen=True)
class Preset:
    """A usual frame, and the values that each of its numbers takes by itself."""

    usual: Case
    image: tuple[tuple[int, int], ...]
    atlas: tuple[int, ...]
    gaussians: tuple[int, ...]
    lights: tuple[int, ...]
    subdivide: tuple[int, ...]
    environment: tuple[str, ...] = ("uniform",)
    technique: tuple[str, ...] = (GPU_GEMS_3, FRAGMENTS)

    def cases(self) -> list[Case]:
        """The usual frame, then the others."""
        found = [self.usual]
        for name in ("technique", "image", "atlas", "gaussians", "lights", "environment", "subdivide"):
            for value in getattr(self, name):
                if value != getattr(self.usual, name):
                    found.append(replace(self.usual, varies=name, **{name: value}))
        return found


PRESETS: dict[str, Preset] = {
    "film": Preset(
        Case((3840, 2160), atlas=4096, gaussians=8, lights=5, subdivide=2, samples=16),
        image=((1920, 1080), (2048, 2048), (3840, 2160)),
        atlas=(1024, 2048, 4096),
        gaussians=(1, 4, 6, 8),
        lights=(1, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "interactive": Preset(
        Case(),
        image=((512, 512), (1024, 1024), (1920, 1080), (3840, 2160)),
        atlas=(512, 1024, 2048, 4096),
        gaussians=(1, 2, 4, 6, 8),
        lights=(1, 2, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "cpu": Preset(
        Case((1024, 1024), atlas=1024),
        image=((256, 256), (512, 512), (1024, 1024)),
        atlas=(256, 512, 1024),
        gaussians=(1, 3, 6, 8),
        lights=(1, 3, 8),
        subdivide=(0, 1),
    ),
}
