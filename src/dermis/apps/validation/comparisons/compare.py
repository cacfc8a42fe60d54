"""Techniques against one truth: figures and pictures."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.comparisons.scenes import LIGHTS, REGIONS, ModelName, medium_scene
from dermis.apps.validation.comparisons.references import REFERENCES, ComparisonSubject, ReferenceImage, check_visible
from dermis.base.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import surface_points
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.optics.media import media
from dermis.scene.settings import Settings
from dermis.scene.skin import DirectionName, Skin
from dermis.scene.sources import scattering_sources

Floats = NDArray[np.float64]
_WHITE_PERCENTILE = 99.0


@dataclass(frozen=True)
class ComparisonRow:
    """A technique's figures, with standard errors where the truth is noisy.

    relrmse, relrmse_se : root mean square error over the root mean square of the truth [-]
    flip : mean perceived difference [0..1]; None without the package flip-evaluator
    energy_ratio, energy_ratio_se : light in the image over that in the truth [-]
    ms : device time of a frame
    """

    technique: str
    against: str
    relrmse: float
    relrmse_se: float
    flip: float | None
    energy_ratio: float
    energy_ratio_se: float
    ms: float


@dataclass(frozen=True)
class Comparison:
    """What was compared, and the results.

    images : linear radiance (h, w, 3) by technique
    """

    title: str
    adapter: str
    truth: ReferenceImage
    against: str
    rows: tuple[ComparisonRow, ...]
    images: dict[str, Floats]

    @property
    def exposure(self) -> float:
        """Factor that makes the truth's bright parts nearly white."""
        bright = np.percentile(self.truth.image[self.truth.mask], _WHITE_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def shown(self, image: Floats) -> Floats:
        """Return sRGB (h, w, 3) in 0..1 at the comparison's exposure."""
        return np.asarray(encode_srgb(np.clip(self.exposure * image, 0.0, 1.0)))


def compare(
    head: Head,
    against: str,
    techniques: Sequence[str],
    *,
    light: str = "front",
    region: str = "portrait",
    medium: str = "skin1",
    settings: Settings | None = None,
    direction: DirectionName | None = None,
    model: ModelName | None = None,
    samples: int = 64,
    adapter: str = "auto",
    report: Callable[[str], None] = lambda doing: None,
) -> Comparison:
    """Compare techniques, with the profile's own colour and no surface reflection, with a truth.

    against : of TRUTHS
    light, region : of `scenes.LIGHTS` and `scenes.REGIONS`
    medium : a named medium, taken as index-matched
    direction : of the techniques' skin; None for that of the truth's
    model : of the medium's profile, as the techniques have it; see `gaussians_of` for the default
    samples : paths through each pixel
    report : called with what is being done

    Raises DermisError for unknown names, pictures without the head, and what the truth cannot do.
    """
    check_names(against, light, region, medium)
    settings = settings or Settings(size=(256, 256), atlas=1024)
    with comparison_subject(head, light, region, medium, settings, adapter, model) as subject:
        check_visible(surface_points(subject.renderer, subject.scene, settings).mask)
        report(f"truth: {against}")
        truth = REFERENCES[against](subject, samples)
        check_visible(truth.mask)
        skin = Skin(**(subject.scene.skin.model_dump() | {"direction": direction or truth.direction}))
        judged = replace(subject, scene=replace(subject.scene, skin=skin))
        images, ms = {}, {}
        for technique in techniques:
            report(technique)
            images[technique], ms[technique] = _render(judged, technique, truth)
        name = subject.renderer.device.adapter.name
    title = f"{head.name}, {medium}, light: {light}, region: {region}, {settings.size[0]}x{settings.size[1]}"
    title += (
        f", {skin.direction} skin, profile by {'photons' if subject.profile.from_photons else 'diffusion'}"
    )
    made = Comparison(title, name, truth, against, (), images)
    return replace(made, rows=tuple(_comparison_row(made, technique, ms[technique]) for technique in techniques))


@contextmanager
def comparison_subject(
    head: Head,
    light: str,
    region: str,
    medium: str,
    settings: Settings,
    adapter: str,
    model: ModelName | None = None,
) -> Iterator[ComparisonSubject]:
    """Provide the subject of a comparison within the context; arguments as of `compare`."""
    body = media()[medium].with_eta(1.0)
    with medium_scene(head, light, region, body, model) as (scene, profile):
        yield ComparisonSubject(Renderer(adapter), scene, profile, body, settings)


def check_names(against: str, light: str, region: str, medium: str) -> None:
    """Raises DermisError for unknown names; cheap, so call it before long work."""
    choices: dict[str, tuple[str, Collection[str]]] = {
        "against": (against, REFERENCES),
        "light": (light, LIGHTS),
        "region": (region, REGIONS),
        "medium": (medium, media()),
    }
    for option, (chosen, known) in choices.items():
        if chosen not in known:
            refuse(f"--{option}", f"one of {', '.join(known)}", f"got {chosen!r}", "Choose one of them")


def _render(subject: ComparisonSubject, technique: str, truth: ReferenceImage) -> tuple[Floats, float]:
    """Linear radiance of a technique, and the device time of its frame at four samples a pixel [ms]."""
    without: dict[str, object] = {} if truth.through else {"transmission": "none"}
    without |= {} if truth.between else {"interreflection": False}
    chosen = subject.settings.model_dump() | {"technique": technique} | without
    drawn = subject.renderer.draw(subject.scene, Settings(**(chosen | {"samples": truth.subpixels})))
    image = drawn.linear().astype(np.float64)
    timed = subject.renderer.draw_warm(subject.scene, Settings(**(chosen | {"samples": 4})))
    return image, (timed.gpu_ms or {"total": timed.frame_ms})["total"]


def _comparison_row(made: Comparison, technique: str, ms: float) -> ComparisonRow:
    from dermis.apps.truths.metrics import energy_ratio, relative_rmse

    truth, image = made.truth, made.images[technique]
    error = relative_rmse(image, truth.image, truth.mask, truth.variance)
    energy = energy_ratio(image, truth.image, truth.mask, truth.variance)
    perceived = _flip(made.shown(image), made.shown(truth.image), truth.mask)
    return ComparisonRow(technique, made.against, *error, perceived, *energy, ms)


def _flip(image: Floats, truth: Floats, mask: NDArray[np.bool_]) -> float | None:
    from importlib.util import find_spec

    from dermis.apps.truths.metrics import flip

    return flip(image, truth, mask).mean if find_spec("flip_evaluator") else None


_REFERENCE_SOURCES = {
    "surface-integral": ("JensenBuhler2002", "Turk1992"),
    "heat": ("PinkallPolthier1993", "BobenkoSpringborn2007", "Fisher2007", "SharpCrane2020", "Bank1985"),
    "path-traced": ("Jakob2022", "Miller2019", "Welford1962"),
    "cycles": ("ChristensenBurley2015",),
}
_FLIP_SOURCE = "Andersson2020"


def comparison_sources(against: str, techniques: Iterable[str]) -> tuple[str, ...]:
    """Return keys of the bibliography, without duplicates.

    against : of `truths.TRUTHS`
    """
    keys = [*_REFERENCE_SOURCES[against], _FLIP_SOURCE]
    for technique in techniques:
        keys += scattering_sources(Settings.model_validate({"technique": technique}))
    return tuple(dict.fromkeys(keys))
