"""The package's human beside the same person path-traced: pictures and figures view by view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import Estimate, energy_ratio, relative_rmse
from dermis.apps.truths.path_traced import PathTraced, Variant
from dermis.apps.truths.person.traced import Paint, trace_person
from dermis.apps.validation.comparisons.person_views import VIEWS, scene_of
from dermis.apps.validation.comparisons.truths import check_seen
from dermis.base.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
_COVERED = 0.999  # share of a pixel
_SHOWN_PERCENTILE = 98.0


@dataclass(frozen=True, eq=False)
class Pair:
    """A view of a person by the frame and by path tracing, and how far they are apart.

    ours, truth : (h, w, 3) linear radiance
    variance : (h, w, 3) of the truth's noise
    mask : (h, w) pixels that are judged
    relrmse, energy : over the mask
    by_channel : energy of red, green and blue alone
    """

    name: str
    ours: Floats
    truth: Floats
    variance: Floats
    mask: NDArray[np.bool_]
    relrmse: Estimate
    energy: Estimate
    by_channel: tuple[Estimate, ...]
    samples: int
    seconds: float

    @property
    def exposure(self) -> float:
        """Factor that makes the truth's bright parts nearly white."""
        bright = np.percentile(self.truth[self.mask], _SHOWN_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def shown(self, image: Floats) -> NDArray[np.uint8]:
        """(h, w, 3) sRGB bytes at the exposure of both."""
        encoded = encode_srgb(np.clip(self.exposure * image, 0.0, 1.0))
        return np.asarray(np.rint(255 * encoded), np.uint8)


def compare_person(
    renderer: Renderer,
    head: Head,
    paint: Paint,
    name: str,
    *,
    side: int = 256,
    samples: int = 64,
    atlas: int = 2048,
    keep: bool = True,
    report: Callable[[int, int], None] | None = None,
) -> Pair:
    """A view of a person by both.

    paint : what the frame shows on it, see `paint_of`
    name : of `VIEWS`
    side : of the pictures [pixel]
    samples : paths through each pixel, more in some views
    atlas : side of the frame's atlas [texel]
    keep, report : as of `path_trace`

    Raises DermisError for other views, and for heads without eyes of true shape.
    """
    if name not in VIEWS:
        refuse("view", f"one of {', '.join(VIEWS)}", f"{name!r} came", "Choose one of them")
    settings = Settings(size=(side, side), atlas=atlas, samples=4)
    scene, wanted = scene_of(head, VIEWS[name]), round(samples * VIEWS[name].times)
    truth = traced(renderer, scene, paint, settings.size, wanted, keep, report)
    mask = truth.mask > _COVERED
    check_seen(mask)
    return pair_of(name, drawn(renderer, scene, settings), truth, mask)


def drawn(renderer: Renderer, scene: Scene, settings: Settings) -> Floats:
    """(h, w, 3) linear radiance by the frame, drawn twice as large and averaged.

    More samples of a pixel would do as well, but on software adapters many samples of many large lights end
    the shading before its last pixels.
    """
    width, height = settings.size
    larger = settings.model_copy(update={"size": (2 * width, 2 * height)})
    image = renderer.draw(scene, larger).linear().astype(np.float64)
    return np.asarray(image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)))


def traced(
    renderer: Renderer,
    scene: Scene,
    paint: Paint,
    size: tuple[int, int],
    samples: int,
    keep: bool = True,
    report: Callable[[int, int], None] | None = None,
    variant: Variant = "scalar_rgb",
) -> PathTraced:
    """A person path-traced; light below skin of the mean colour spreads as far as the profile says.

    variant : as of `path_trace`
    """
    profile, colour = renderer.profile_of(scene.skin), scene.head.maps.mean_colour
    assert colour is not None  # painted people have one
    weight, width = profile.weight, np.sqrt(0.5 * np.pi * profile.variance_mm2)
    distance = (weight * width[:, None]).sum(axis=0) / weight.sum(axis=0)
    return trace_person(
        scene, paint, distance, colour, size, samples, variant=variant, keep=keep, report=report
    )


def pair_of(name: str, ours: Floats, truth: PathTraced, mask: NDArray[np.bool_]) -> Pair:
    """Both pictures with their figures."""
    image, variance = truth.image.astype(np.float64), truth.variance.astype(np.float64)
    return Pair(
        name,
        ours,
        image,
        variance,
        mask,
        relative_rmse(ours, image, mask, variance),
        energy_ratio(ours, image, mask, variance),
        tuple(energy_ratio(ours[..., c], image[..., c], mask, variance[..., c]) for c in range(3)),
        truth.samples,
        truth.seconds,
    )
