"""Comparison of scattering techniques with one reference image: pictures and errors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from importlib.util import find_spec

import numpy as np
from numpy.typing import NDArray

from dermis.apps.validation.comparisons.references import (
    REFERENCES,
    ComparisonSubject,
    ReferenceImage,
    require_visible_pixels,
)
from dermis.apps.validation.comparisons.scenes import LIGHTS, REGIONS, ModelName, medium_scene
from dermis.base.errors import refuse
from dermis.frame.renderer import Renderer
from dermis.frame.surface_points import surface_points
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.optics.media import published_media
from dermis.scene.settings import Settings
from dermis.scene.skin import DiffuseDirectionName, Skin
from dermis.scene.sources import scattering_citation_keys

Floats = NDArray[np.float64]
_EXPOSURE_PERCENTILE = 99.0


@dataclass(frozen=True)
class ComparisonRow:
    """Errors of a technique against a reference, with standard errors where the reference has noise.

    relrmse : ratio of the root mean square error to the root mean square of the reference [-]
    relrmse_se : standard error of `relrmse` [-]
    flip : mean perceived difference by FLIP, from 0 to 1; None without the package flip-evaluator
    energy_ratio : ratio of the technique's total light to the total light of the reference [-]
    energy_ratio_se : standard error of `energy_ratio` [-]
    ms : device time of a frame [ms]
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
    """Reference image, and the images and errors of the techniques compared with it.

    images : linear radiance (h, w, 3) by technique
    """

    title: str
    adapter: str
    reference: ReferenceImage
    against: str
    rows: tuple[ComparisonRow, ...]
    images: dict[str, Floats]

    @property
    def exposure(self) -> float:
        """Return the exposure factor that makes bright pixels of the reference nearly white."""
        bright = np.percentile(self.reference.image[self.reference.mask], _EXPOSURE_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def tone_mapped(self, image: Floats) -> Floats:
        """Return a linear image as sRGB values (h, w, 3) from 0 to 1, at the comparison's exposure."""
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
    direction: DiffuseDirectionName | None = None,
    model: ModelName | None = None,
    samples: int = 64,
    adapter: str = "auto",
) -> Comparison:
    """Compare techniques with a reference.

    The skin has the colour of its diffusion profile, and no surface reflection.

    head : head to render
    against : name of the reference in `references.REFERENCES`
    techniques : names of scattering techniques
    light : name of the light in `scenes.LIGHTS`
    region : name of the visible region in `scenes.REGIONS`
    medium : name of a medium, which is made index-matched
    settings : frame settings; None for 256 x 256 pixels and an atlas of 1024 x 1024 texels
    direction : angular distribution of the light that leaves the rendered skin; None for the same
        distribution as in the reference
    model : scattering model of the medium's profile; see `medium_gaussians` for the default
    samples : paths per pixel of a path-traced reference

    Raises DermisError for unknown names, pictures that do not show the head, and scenes that the reference
    does not support.
    """
    check_names(against, light, region, medium)
    settings = settings or Settings(size=(256, 256), atlas=1024)
    with comparison_subject(head, light, region, medium, settings, adapter, model) as subject:
        require_visible_pixels(surface_points(subject.renderer, subject.scene, settings).mask)
        reference = REFERENCES[against](subject, samples)
        require_visible_pixels(reference.mask)
        skin = Skin(**(subject.scene.skin.model_dump() | {"direction": direction or reference.direction}))
        compared = replace(subject, scene=replace(subject.scene, skin=skin))
        images, ms = {}, {}
        for technique in techniques:
            images[technique], ms[technique] = _render_technique(compared, technique, reference)
        name = subject.renderer.device.adapter.name
    title = f"{head.name}, {medium}, light: {light}, region: {region}, {settings.size[0]}x{settings.size[1]}"
    model_name = "photons" if subject.profile.from_photons else "diffusion"
    title += f", {skin.direction} skin, profile by {model_name}"
    comparison = Comparison(title, name, reference, against, (), images)
    rows = tuple(_comparison_row(comparison, technique, ms[technique]) for technique in techniques)
    return replace(comparison, rows=rows)


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
    """Yield the scene of a comparison, with the renderer, settings, profile and medium.

    The scene reads the profile from a temporary file, which is deleted when the context ends. The parameters
    are described in `compare`.
    """
    index_matched = published_media()[medium].with_eta(1.0)
    with medium_scene(head, light, region, index_matched, model) as (scene, profile):
        yield ComparisonSubject(Renderer(adapter), scene, profile, index_matched, settings)


def check_names(reference_name: str, light_name: str, region_name: str, medium_name: str) -> None:
    """Raise DermisError if any of the names is unknown."""
    choices: dict[str, tuple[str, Collection[str]]] = {
        "against": (reference_name, REFERENCES),
        "light": (light_name, LIGHTS),
        "region": (region_name, REGIONS),
        "medium": (medium_name, published_media()),
    }
    for option, (name, known) in choices.items():
        if name not in known:
            refuse(f"--{option}", f"one of {', '.join(known)}", f"got {name!r}", "Choose one of them")


def _render_technique(
    subject: ComparisonSubject, technique: str, reference: ReferenceImage
) -> tuple[Floats, float]:
    """Return the linear radiance rendered by a technique, and the device time of a frame [ms].

    The time is measured with 4 samples per pixel.

    reference : reference image; the frame leaves out translucency or interreflection if the reference does
    """
    disabled: dict[str, object] = {} if reference.has_translucency else {"transmission": "none"}
    disabled |= {} if reference.has_interreflection else {"interreflection": False}
    values = subject.settings.model_dump() | {"technique": technique} | disabled
    drawn = subject.renderer.draw(subject.scene, Settings(**(values | {"samples": reference.samples})))
    image = drawn.linear().astype(np.float64)
    timed = subject.renderer.draw_after_warm_up(subject.scene, Settings(**(values | {"samples": 4})))
    return image, (timed.gpu_ms or {"total": timed.frame_ms})["total"]


def _comparison_row(comparison: Comparison, technique: str, frame_ms: float) -> ComparisonRow:
    from dermis.apps.truths.metrics import energy_ratio, flip, relative_rmse

    reference, image = comparison.reference, comparison.images[technique]
    error = relative_rmse(image, reference.image, reference.mask, reference.variance)
    energy = energy_ratio(image, reference.image, reference.mask, reference.variance)
    pictures = comparison.tone_mapped(image), comparison.tone_mapped(reference.image)
    flip_error = flip(*pictures, reference.mask).mean if find_spec("flip_evaluator") else None
    return ComparisonRow(technique, comparison.against, *error, flip_error, *energy, frame_ms)


_REFERENCE_SOURCES = {
    "surface-integral": ("JensenBuhler2002", "Turk1992"),
    "heat": ("PinkallPolthier1993", "BobenkoSpringborn2007", "Fisher2007", "SharpCrane2020", "Bank1985"),
    "path-traced": ("Jakob2022", "Miller2019", "Welford1962"),
    "cycles": ("ChristensenBurley2015",),
}
_FLIP_SOURCE = "Andersson2020"


def comparison_sources(against: str, techniques: Iterable[str]) -> tuple[str, ...]:
    """Return the bibliography keys of a reference and of techniques, without duplicates.

    against : name of the reference in `references.REFERENCES`
    """
    keys = [*_REFERENCE_SOURCES[against], _FLIP_SOURCE]
    for technique in techniques:
        keys += scattering_citation_keys(Settings.model_validate({"technique": technique}))
    return tuple(dict.fromkeys(keys))
