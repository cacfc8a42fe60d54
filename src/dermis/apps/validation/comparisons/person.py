"""Comparisons of people rendered by dermis and by path tracing."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.truths.half_space import diffuse_albedo, directional_albedo
from dermis.apps.truths.metrics import Estimate, energy_ratio, relative_rmse
from dermis.apps.truths.path_traced import MitsubaVariant, PathTraced
from dermis.apps.truths.person.medium import pigmented_skin, uniform_skin
from dermis.apps.truths.person.path_traced import path_trace_person
from dermis.apps.truths.person.person import SkinTextures
from dermis.apps.validation.comparisons.references import require_visible_pixels
from dermis.apps.validation.comparisons.scenes import medium_gaussians
from dermis.frame.renderer import Renderer
from dermis.human.skin.painted import PaintedMaps, mean_colour
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import SKIN_ETA, Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.profiles import write_profile
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import DEFAULT_ROUGHNESS, Skin

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
_FULL_COVERAGE = 0.999  # fraction of a pixel from which it counts as covered
_EXPOSURE_PERCENTILE = 98.0
_DIRECT_LIGHT_DEPTH = 2


@dataclass(frozen=True, eq=False)
class PersonComparison:
    """Pictures of one view of a person by dermis and by path tracing, with the errors of dermis.

    name : name of the view
    ours : (h, w, 3) linear radiance rendered by dermis
    reference : (h, w, 3) linear radiance rendered by path tracing
    variance : (h, w, 3) variance of the noise in `reference`
    mask : (h, w) mask of the pixels that are compared
    relrmse : relative RMSE within the mask [-]
    energy : total light in `ours`, divided by the total light in `reference`, within the mask [-]
    energy_by_channel : `energy` in red, green and blue [-]
    samples : paths per pixel
    seconds : duration of path tracing [s]
    """

    name: str
    ours: Floats
    reference: Floats
    variance: Floats
    mask: Mask
    relrmse: Estimate
    energy: Estimate
    energy_by_channel: tuple[Estimate, ...]
    samples: int
    seconds: float

    @property
    def exposure(self) -> float:
        """Return the exposure factor that makes bright pixels of the reference nearly white."""
        bright = np.percentile(self.reference[self.mask], _EXPOSURE_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def tone_mapped(self, image: Floats) -> NDArray[np.uint8]:
        """Return a linear image as sRGB bytes (h, w, 3), at the comparison's exposure."""
        encoded = encode_srgb(np.clip(self.exposure * image, 0.0, 1.0))
        return np.asarray(np.rint(255 * encoded), np.uint8)


SharedSkinKind = Literal["matched", "refracting", "layered"]
"""Model of the skin that frame and path tracer share.

"matched": homogeneous skin without refraction; the reflection of its surface is added to the scattered
light. "refracting": homogeneous skin below a refracting surface with an index of refraction of 1.4 and a
specular strength of 1. "layered": epidermis over dermis, with the pigments of the person and the same surface
as "matched".
"""
SHARED_SKIN_KINDS: tuple[SharedSkinKind, ...] = get_args(SharedSkinKind)
OmittedFeature = Literal["pigments", "relief", "reflection", "hair", "scattering", "bounces"]
"""Feature that frame and path tracer can both omit, to find how much of the error it causes.

"pigments": variation of the colour. "relief": folds, pores, and variation of gloss. "reflection": specular
lobe of the skin. "hair": hair, brows and lashes. "scattering": subsurface scattering, so that skin is
Lambertian. "bounces": subsurface scattering, hair, and all light that is not direct, so that eyes are black.
"""
OMITTED_FEATURES: tuple[OmittedFeature, ...] = get_args(OmittedFeature)


@dataclass(frozen=True, eq=False)
class SharedSkin:
    """Skin in two equivalent forms: a medium for the path tracer, and a diffusion profile for dermis.

    medium : homogeneous or layered skin with the mean colour of the person
    profile : file with Gaussians fitted to the diffusion profile of the medium, computed by Monte Carlo
    """

    medium: Medium
    profile: Path


def shared_skin(renderer: Renderer, head: Head, skin_kind: SharedSkinKind, folder: Path) -> SharedSkin:
    """Return the skin of a person that dermis and the path tracer share, and write its diffusion profile.

    For `skin_kind` "layered", the skin has two layers with the pigments of the person. Otherwise, it
    is homogeneous, with the mean scattering distance of the default skin.

    skin_kind : model of the skin that both renderers use, one of `SHARED_SKIN_KINDS`
    folder : existing folder in which the file of the profile is written
    """
    maps, eta = head.maps, SKIN_ETA if skin_kind == "refracting" else 1.0
    assert isinstance(maps, PaintedMaps)
    colour = mean_colour(maps.look)
    if skin_kind == "layered":
        look = maps.look
        parameters = SkinParameters(look.melanin, look.eumelanin, look.blood, look.oxygen, look.epidermis_mm)
        medium = pigmented_skin(parameters, colour, eta)
    else:
        medium = uniform_skin(colour, mean_distance_mm(renderer.skin_profile(Skin())), eta)
    file = folder / f"{skin_kind}.toml"
    write_profile(file, medium_gaussians(medium, "montecarlo"), {"model": "montecarlo"})
    return SharedSkin(medium, file)


@dataclass(frozen=True, eq=False)
class PersonSubject:
    """Scene of a person, and the textures of the skin for the path tracer.

    omitted_feature : feature that both renderers omit, such as "hair", to find how much of the error it
        causes; None if they omit nothing
    """

    scene: Scene
    textures: SkinTextures
    omitted_feature: OmittedFeature | None = None


def without_feature(subject: PersonSubject, omitted_feature: OmittedFeature) -> PersonSubject:
    """Return a subject for which dermis and the path tracer both omit one feature that causes errors."""
    scene, textures, head = subject.scene, subject.textures, subject.scene.head
    maps, flat = head.maps, np.ones((1, 1), np.float32)
    assert isinstance(maps, PaintedMaps)
    if omitted_feature == "pigments":
        colour = np.broadcast_to(mean_colour(maps.look), textures.colour.shape).astype(np.float32)
        maps, textures = replace(maps, colour=colour), replace(textures, colour=colour)
    elif omitted_feature == "relief":
        rough = flat * np.float32(DEFAULT_ROUGHNESS)
        maps = replace(maps, height=0.0 * flat, specular=flat, roughness=rough)
        strength = flat * np.float32(scene.skin.specular_strength)
        textures = replace(textures, height_mm=0.0 * flat, strength=strength, roughness=rough)
    elif omitted_feature == "reflection":
        textures = replace(textures, strength=0.0 * flat)
    elif omitted_feature in ("hair", "bounces"):
        head = replace(head, strands=None, hair=None)
    return PersonSubject(scene.replace(head=replace(head, maps=maps)), textures, omitted_feature)


def render_subject_frame(
    renderer: Renderer, subject: PersonSubject, skin: SharedSkin | None, settings: Settings
) -> Floats:
    """Render a person with dermis, and return the linear radiance (h, w, 3).

    For skin that does not refract light, the result is the sum of two frames. One shows the scattered light
    of skin without surface reflection; the other shows only surface reflection.

    skin : skin of the path-traced reference; None for the skin of the scene
    """
    scene, omitted_feature = subject.scene, subject.omitted_feature
    if omitted_feature in ("scattering", "bounces"):
        settings = settings.model_copy(update={"technique": "none", "transmission": "none"})
    if omitted_feature == "bounces":
        settings = settings.model_copy(update={"interreflection": False, "occlusion": "none"})
    own = scene.skin if skin is None else scene.skin.replace(profile=str(skin.profile))
    if omitted_feature in ("scattering", "bounces"):
        own = own.replace(direction="lambertian")
    if skin is not None and skin.medium.eta != 1.0:
        own = own.replace(rho_s=1.0)
    matte = own.replace(specular="none")
    if omitted_feature == "reflection":
        return render_frame(renderer, scene.replace(skin=matte), settings)
    if skin is None or skin.medium.eta != 1.0:
        return render_frame(renderer, scene.replace(skin=own), settings)
    parts = {"diffuse": matte, "specular": own}
    return sum_images(
        render_frame(renderer, scene.replace(skin=one), settings.model_copy(update={"parts": part}))
        for part, one in parts.items()
    )


def sum_images(images: Iterable[Floats]) -> Floats:
    """Return the sum of images of one shape."""
    return np.asarray(np.sum(list(images), axis=0))


def compare_person(
    renderer: Renderer,
    subject: PersonSubject,
    skin: SharedSkin,
    comparison_name: str,
    *,
    picture_side: int = 256,
    samples: int = 64,
    atlas: int = 2048,
    use_cache: bool = True,
    variant: MitsubaVariant = "scalar_rgb",
    progress: Callable[[int, int], None] | None = None,
) -> PersonComparison:
    """Render a person with dermis and by path tracing, and compare the pictures.

    skin : skin that both render, from `shared_skin`
    comparison_name : name of the view
    picture_side : side of the pictures [pixel]
    samples : paths per pixel
    atlas : side of dermis's atlas [texel]
    variant, use_cache, progress : as in `path_trace`

    Raises DermisError for heads without modelled eyes.
    """
    settings = Settings(size=(picture_side, picture_side), atlas=atlas, samples=4)
    reference = path_trace_subject(subject, skin, settings.size, samples, use_cache, variant, progress)
    mask = reference.mask > _FULL_COVERAGE
    require_visible_pixels(mask)
    return person_comparison(
        comparison_name, render_subject_frame(renderer, subject, skin, settings), reference, mask
    )


def render_frame(renderer: Renderer, scene: Scene, settings: Settings) -> Floats:
    """Render a scene at twice the size, and return its linear radiance (h, w, 3) averaged over 2 x 2 pixels.

    A frame with more samples per pixel would look the same, but on software adapters it can exceed the time
    limit of a pass.
    """
    width, height = settings.size
    larger = settings.model_copy(update={"size": (2 * width, 2 * height)})
    image = renderer.draw(scene, larger).linear().astype(np.float64)
    return np.asarray(image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)))


def path_trace_subject(
    subject: PersonSubject,
    skin: SharedSkin,
    picture_size: tuple[int, int],
    samples: int,
    use_cache: bool = True,
    variant: MitsubaVariant = "scalar_rgb",
    progress: Callable[[int, int], None] | None = None,
) -> PathTraced:
    """Render a person by path tracing.

    skin : skin to render, from `shared_skin`
    picture_size : width and height of the picture [pixel]
    samples : paths per pixel
    variant : variant of Mitsuba, as in `path_trace`
    """
    medium = None if subject.omitted_feature in ("scattering", "bounces") else skin.medium
    textures, scene = subject.textures, subject.scene
    if skin.medium.eta != 1.0 and scene.skin.specular_strength > 0.0:
        textures = replace(textures, strength=textures.strength / np.float32(scene.skin.specular_strength))
    return path_trace_person(
        scene,
        textures,
        medium,
        picture_size,
        samples,
        max_depth=_DIRECT_LIGHT_DEPTH if subject.omitted_feature == "bounces" else None,
        variant=variant,
        use_cache=use_cache,
        progress=progress,
    )


def path_trace_view(
    renderer: Renderer,
    scene: Scene,
    textures: SkinTextures,
    picture_size: tuple[int, int],
    samples: int,
    *,
    variant: MitsubaVariant = "scalar_rgb",
) -> PathTraced:
    """Path-trace a person with homogeneous skin that has a specular strength of 1 and does not refract light.

    The mean scattering distance is that of the diffusion profile of the scene's skin.

    textures : textures that dermis paints for the skin; the colour is the reflectance in uniform light
    picture_size : width and height of the picture [pixel]
    samples : paths per pixel
    variant : variant of Mitsuba, as in `path_trace`
    """
    mean = scene.head.maps.mean_colour
    assert mean is not None  # painted maps always have one
    medium = uniform_skin(
        normal_incidence_reflectance(mean), mean_distance_mm(renderer.skin_profile(scene.skin)), 1.0
    )
    colour = normal_incidence_reflectance(textures.colour).astype(np.float32)
    textures = replace(textures, colour=colour, strength=np.ones((1, 1), np.float32))
    return path_trace_person(scene, textures, medium, picture_size, samples, variant=variant)


def mean_distance_mm(profile: GaussianSum) -> Floats:
    """Return the mean scattering distance (3,) of a diffusion profile [mm].

    This is the mean distance between the points where light enters and leaves the skin.
    """
    weight, width = profile.weight, np.sqrt(0.5 * np.pi * profile.variance_mm2)
    return np.asarray((weight * width[:, None]).sum(axis=0) / weight.sum(axis=0))


def normal_incidence_reflectance(diffuse_reflectance: ArrayLike) -> Floats:
    """Convert reflectances of index-matched half-spaces from uniform light to normal incidence [-].

    diffuse_reflectance : reflectances in uniform light
    """
    albedo = 1.0 - np.linspace(1.0, 0.01, 48) ** 2
    uniform, normal = (
        [float(f(one)) for one in albedo] for f in (diffuse_albedo, partial(directional_albedo, 1.0))
    )
    return np.asarray(np.interp(np.asarray(diffuse_reflectance, float), uniform, normal))


def person_comparison(
    comparison_name: str, dermis_image: Floats, reference: PathTraced, mask: Mask
) -> PersonComparison:
    """Return the comparison of a frame with a path-traced picture.

    dermis_image : (h, w, 3) linear radiance rendered by dermis
    mask : (h, w) mask of the pixels to compare
    """
    image, variance = reference.image.astype(np.float64), reference.variance.astype(np.float64)
    return PersonComparison(
        comparison_name,
        dermis_image,
        image,
        variance,
        mask,
        relative_rmse(dermis_image, image, mask, variance),
        energy_ratio(dermis_image, image, mask, variance),
        tuple(energy_ratio(dermis_image[..., c], image[..., c], mask, variance[..., c]) for c in range(3)),
        reference.samples,
        reference.seconds,
    )


_PUPIL_RADIUS_MM = 4.0  # around the middle, for the position of the pupil
_IRIS_INNER_RADIUS_MM, _IRIS_OUTER_RADIUS_MM = 2.6, 5.0  # ring of the iris, as seen from the front
_MIN_RELATIVE_HIGHLIGHT = 1.6  # least brightness of highlights, relative to the median of the ring


class IrisErrors(NamedTuple):
    """Differences between an iris rendered by dermis and the same iris rendered by path tracing.

    right : distance by which the path-traced pupil is further to the right [pixel]
    down : distance by which the path-traced pupil is further down [pixel]
    brightness : mean brightness of the iris in the picture by dermis, divided by its mean brightness in the
        path-traced picture; highlights are left out [-]
    left_half : `brightness` of the left half of the iris [-]
    right_half : `brightness` of the right half of the iris [-]
    """

    right: Estimate
    down: Estimate
    brightness: Estimate
    left_half: Estimate
    right_half: Estimate


def iris_errors(comparison: PersonComparison, view_height_mm: float) -> IrisErrors:
    """Return the errors of the iris in a comparison whose pictures show an eye from the front, in the middle.

    view_height_mm : height of the visible area [mm]
    """
    ours, reference = comparison.ours.mean(axis=2), comparison.reference.mean(axis=2)
    noise = comparison.variance.mean(axis=2)  # an upper bound, since channels may share paths
    side = len(ours)
    along = (np.arange(side) + 0.5 - 0.5 * side) * view_height_mm / side
    x, y = np.meshgrid(along, along)
    radius = np.hypot(x, y)
    ring = (radius > _IRIS_INNER_RADIUS_MM) & (radius < _IRIS_OUTER_RADIUS_MM)
    dull = _highlight_free_mask(ours, ring) & _highlight_free_mask(reference, ring)
    right, down = _image_shift(ours, reference, noise, dull & (radius < _PUPIL_RADIUS_MM))
    masks = (ring & dull & half for half in (radius > 0, x < 0, x >= 0))
    return IrisErrors(right, down, *(_brightness_ratio(ours, reference, noise, mask) for mask in masks))


def _highlight_free_mask(image: Floats, iris_ring: Mask) -> Mask:
    """Return the mask (h, w) of the pixels that are not much brighter than the median of the iris.

    iris_ring : (h, w) mask of the iris
    """
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(image, 2.0)
    return np.asarray(smooth < _MIN_RELATIVE_HIGHLIGHT * np.median(smooth[iris_ring]))


def _image_shift(
    dermis_image: Floats, reference: Floats, noise_variance: Floats, region_mask: Mask
) -> tuple[Estimate, Estimate]:
    """Return the shift of the reference relative to dermis's image, to the right and downwards [pixel].

    The shift is fitted by least squares, together with a factor of brightness.

    noise_variance : (h, w) variance of the noise of the reference
    region_mask : (h, w) mask of the pixels to compare
    """
    down, right = (np.asarray(slope) for slope in np.gradient(dermis_image))
    columns = np.stack(
        [dermis_image[region_mask], -right[region_mask], -down[region_mask], np.ones(int(region_mask.sum()))],
        axis=-1,
    )
    inverse = np.linalg.inv(columns.T @ columns) @ columns.T
    gain, x, y, _ = (float(one) for one in inverse @ reference[region_mask])
    error: Floats = np.sqrt((inverse**2 * noise_variance[region_mask]).sum(axis=1)) / abs(gain)
    return Estimate(x / gain, float(error[1])), Estimate(y / gain, float(error[2]))


def _brightness_ratio(
    dermis_image: Floats, reference: Floats, noise_variance: Floats, region_mask: Mask
) -> Estimate:
    total = float(reference[region_mask].sum())
    ratio = float(dermis_image[region_mask].sum()) / total
    return Estimate(ratio, ratio * float(np.sqrt(noise_variance[region_mask].sum())) / total)
