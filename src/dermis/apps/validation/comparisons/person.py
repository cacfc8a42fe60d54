"""Views of the package's human rendered by dermis and by path tracing, with the errors of dermis."""

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
from dermis.apps.validation.comparisons.references import check_visible
from dermis.apps.validation.comparisons.scenes import medium_gaussians
from dermis.environment.panorama import UNIFORM_PANORAMA
from dermis.frame.renderer import Renderer
from dermis.human.expressions import expression
from dermis.human.skin.painted import PaintedMaps, mean_colour
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import SKIN_ETA, Medium
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.profiles import write_profile
from dermis.scene.camera import CAMERA_PRESETS, Camera, cheek, portrait, side, three_quarter
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, PointLight, RectangleLight, preset_lights
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import DEFAULT_ROUGHNESS, Skin

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
_FULL_COVERAGE = 0.999  # fraction of a pixel from which it counts as covered
_WHITE_PERCENTILE = 98.0
_DIRECT_DEPTH = 2


@dataclass(frozen=True, eq=False)
class PersonComparison:
    """View of a person rendered by dermis and by path tracing, with the errors of dermis.

    name : name of the view
    ours, reference : (h, w, 3) linear radiance by dermis, and by path tracing
    variance : (h, w, 3) variance of the reference's noise
    mask : (h, w) pixels that are compared
    relrmse : relative RMSE within the mask [-]
    energy : ratio of the total light by dermis to that of the reference, within the mask [-]
    energy_by_channel : the same ratio in red, green and blue [-]
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
        bright = np.percentile(self.reference[self.mask], _WHITE_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def tone_mapped(self, image: Floats) -> NDArray[np.uint8]:
        """Return a linear image as sRGB bytes (h, w, 3), at the comparison's exposure."""
        encoded = encode_srgb(np.clip(self.exposure * image, 0.0, 1.0))
        return np.asarray(np.rint(255 * encoded), np.uint8)


TruthName = Literal["matched", "refracting", "layered"]
"""Model of the skin that frame and path tracer share.

"matched": homogeneous skin without refraction, whose surface adds its reflection. "refracting": homogeneous
skin below a refracting surface of index 1.4 with a strength of 1. "layered": epidermis over dermis with the
pigments of the person, with the surface of "matched".
"""
TRUTHS: tuple[TruthName, ...] = get_args(TruthName)
Cause = Literal["pigments", "relief", "reflection", "hair", "scattering", "bounces"]
"""Cause of error that frame and path tracer can leave out.

"pigments": variation of the colour. "relief": folds, pores, and variation of gloss. "reflection": specular
lobe of the skin. "hair": hair, brows and lashes. "scattering": subsurface scattering, so that skin is
Lambertian. "bounces": all light but direct light on Lambertian skin, so that eyes are black; and hair.
"""
CAUSES: tuple[Cause, ...] = get_args(Cause)


@dataclass(frozen=True, eq=False)
class SharedSkin:
    """Skin that frame and path tracer share: the layers, and the profile that the frame makes of them.

    medium : layers of skin of the mean colour
    profile : file with the Gaussians that fit photon counts of these layers
    """

    medium: Medium
    profile: Path


def shared_skin(renderer: Renderer, head: Head, truth: TruthName, folder: Path) -> SharedSkin:
    """Return the skin of a person for a truth, with its profile in a file.

    In homogeneous skin, light exits at the same mean distance from its entry as by the published profile.

    folder : existing folder of the file
    """
    maps, eta = head.maps, SKIN_ETA if truth == "refracting" else 1.0
    assert isinstance(maps, PaintedMaps)
    colour = mean_colour(maps.look)
    if truth == "layered":
        look = maps.look
        parameters = SkinParameters(look.melanin, look.eumelanin, look.blood, look.oxygen, look.epidermis_mm)
        medium = pigmented_skin(parameters, colour, eta)
    else:
        medium = uniform_skin(colour, mean_distance_mm(renderer.skin_profile(Skin())), eta)
    file = folder / f"{truth}.toml"
    write_profile(file, medium_gaussians(medium, "montecarlo"), {"model": "montecarlo"})
    return SharedSkin(medium, file)


@dataclass(frozen=True, eq=False)
class PersonSubject:
    """Scene of a person with its textures, as frame and path tracer get it.

    cause : cause of error that both leave out, or None
    """

    scene: Scene
    textures: SkinTextures
    cause: Cause | None = None


def without_cause(subject: PersonSubject, cause: Cause) -> PersonSubject:
    """Return a subject that lacks a cause of error on both sides."""
    scene, textures, head = subject.scene, subject.textures, subject.scene.head
    maps, flat = head.maps, np.ones((1, 1), np.float32)
    assert isinstance(maps, PaintedMaps)
    if cause == "pigments":
        colour = np.broadcast_to(mean_colour(maps.look), textures.colour.shape).astype(np.float32)
        maps, textures = replace(maps, colour=colour), replace(textures, colour=colour)
    elif cause == "relief":
        rough = flat * np.float32(DEFAULT_ROUGHNESS)
        maps = replace(maps, height=0.0 * flat, specular=flat, roughness=rough)
        strength = flat * np.float32(scene.skin.strength)
        textures = replace(textures, height_mm=0.0 * flat, strength=strength, roughness=rough)
    elif cause == "reflection":
        textures = replace(textures, strength=0.0 * flat)
    elif cause in ("hair", "bounces"):
        head = replace(head, strands=None, hair=None)
    return PersonSubject(scene.replace(head=replace(head, maps=maps)), textures, cause)


def frame_of(
    renderer: Renderer, subject: PersonSubject, skin: SharedSkin | None, settings: Settings
) -> Floats:
    """Return the linear radiance (h, w, 3) of the frame with the model of a truth.

    Without refraction, the light from below is that of skin without a surface, and the reflection is added.

    skin : skin that the path tracer has; None for the default skin
    """
    scene, cause = subject.scene, subject.cause
    if cause in ("scattering", "bounces"):
        settings = settings.model_copy(update={"technique": "none", "transmission": "none"})
    if cause == "bounces":
        settings = settings.model_copy(update={"interreflection": False, "occlusion": "none"})
    own = scene.skin if skin is None else scene.skin.replace(profile=str(skin.profile))
    if cause in ("scattering", "bounces"):
        own = own.replace(direction="lambertian")
    if skin is not None and skin.medium.eta != 1.0:
        own = own.replace(rho_s=1.0)
    matte = own.replace(specular="none")
    if cause == "reflection":
        return render_frame(renderer, scene.replace(skin=matte), settings)
    if skin is None or skin.medium.eta != 1.0:
        return render_frame(renderer, scene.replace(skin=own), settings)
    parts = {"diffuse": matte, "specular": own}
    return sum_of(
        render_frame(renderer, scene.replace(skin=one), settings.model_copy(update={"parts": part}))
        for part, one in parts.items()
    )


def sum_of(images: Iterable[Floats]) -> Floats:
    """Return the sum of images of one shape."""
    return np.asarray(np.sum(list(images), axis=0))


def compare_person(
    renderer: Renderer,
    subject: PersonSubject,
    skin: SharedSkin,
    name: str,
    *,
    side: int = 256,
    samples: int = 64,
    atlas: int = 2048,
    use_cache: bool = True,
    variant: MitsubaVariant = "scalar_rgb",
    progress: Callable[[int, int], None] | None = None,
) -> PersonComparison:
    """Render a person by dermis and by path tracing with the same model of the skin.

    skin : model of the skin, from `shared_skin`
    name : name of the view
    side : side of the pictures [pixel]
    samples : paths per pixel
    atlas : side of dermis's atlas [texel]
    variant, use_cache, progress : as in `path_trace`

    Raises DermisError for heads without modelled eyes.
    """
    settings = Settings(size=(side, side), atlas=atlas, samples=4)
    reference = path_trace_subject(subject, skin, settings.size, samples, use_cache, variant, progress)
    mask = reference.mask > _FULL_COVERAGE
    check_visible(mask)
    return person_comparison(name, frame_of(renderer, subject, skin, settings), reference, mask)


def render_frame(renderer: Renderer, scene: Scene, settings: Settings) -> Floats:
    """Return the linear radiance (h, w, 3) of a scene by dermis, drawn at twice the size and averaged.

    More samples per pixel would be equivalent, but on software adapters many samples with many large lights
    exceed the time limit of a pass.
    """
    width, height = settings.size
    larger = settings.model_copy(update={"size": (2 * width, 2 * height)})
    image = renderer.draw(scene, larger).linear().astype(np.float64)
    return np.asarray(image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)))


def path_trace_subject(
    subject: PersonSubject,
    skin: SharedSkin,
    size: tuple[int, int],
    samples: int,
    use_cache: bool = True,
    variant: MitsubaVariant = "scalar_rgb",
    progress: Callable[[int, int], None] | None = None,
) -> PathTraced:
    """Path-trace a person with the skin that the frame has.

    size : width and height of the picture [pixel]
    samples : paths per pixel
    variant : variant of Mitsuba, as in `path_trace`
    """
    medium = None if subject.cause in ("scattering", "bounces") else skin.medium
    textures, scene = subject.textures, subject.scene
    if skin.medium.eta != 1.0 and scene.skin.strength > 0.0:
        textures = replace(textures, strength=textures.strength / np.float32(scene.skin.strength))
    return path_trace_person(
        scene,
        textures,
        medium,
        size,
        samples,
        max_depth=_DIRECT_DEPTH if subject.cause == "bounces" else None,
        variant=variant,
        use_cache=use_cache,
        progress=progress,
    )


def path_trace_view(
    renderer: Renderer,
    scene: Scene,
    textures: SkinTextures,
    size: tuple[int, int],
    samples: int,
    *,
    variant: MitsubaVariant = "scalar_rgb",
) -> PathTraced:
    """Path-trace a person of homogeneous skin that reflects with a strength of 1 and does not refract.

    In the medium, light exits at the same mean distance from its entry as by the profile of the scene's skin.

    textures : maps of the skin as dermis paints them, but with colours under uniform light
    size : width and height of the picture [pixel]
    samples : paths per pixel
    variant : variant of Mitsuba, as in `path_trace`
    """
    mean = scene.head.maps.mean_colour
    assert mean is not None  # painted maps always have one
    medium = uniform_skin(at_normal_incidence(mean), mean_distance_mm(renderer.skin_profile(scene.skin)), 1.0)
    colour = at_normal_incidence(textures.colour).astype(np.float32)
    textures = replace(textures, colour=colour, strength=np.ones((1, 1), np.float32))
    return path_trace_person(scene, textures, medium, size, samples, variant=variant)


def mean_distance_mm(profile: GaussianSum) -> Floats:
    """Return the mean lateral distance (3,) between entry and exit of light by a profile [mm]."""
    weight, width = profile.weight, np.sqrt(0.5 * np.pi * profile.variance_mm2)
    return np.asarray((weight * width[:, None]).sum(axis=0) / weight.sum(axis=0))


def at_normal_incidence(colour: ArrayLike) -> Floats:
    """Return reflectances at normal incidence of half-spaces of index 1, by those for uniform light [-]."""
    albedo = 1.0 - np.linspace(1.0, 0.01, 48) ** 2
    uniform, normal = (
        [float(f(one)) for one in albedo] for f in (diffuse_albedo, partial(directional_albedo, 1.0))
    )
    return np.asarray(np.interp(np.asarray(colour, float), uniform, normal))


def person_comparison(name: str, ours: Floats, reference: PathTraced, mask: Mask) -> PersonComparison:
    """Return the comparison of a frame with a path-traced picture.

    ours : (h, w, 3) linear radiance by dermis
    mask : (h, w) pixels to compare
    """
    image, variance = reference.image.astype(np.float64), reference.variance.astype(np.float64)
    return PersonComparison(
        name,
        ours,
        image,
        variance,
        mask,
        relative_rmse(ours, image, mask, variance),
        energy_ratio(ours, image, mask, variance),
        tuple(energy_ratio(ours[..., c], image[..., c], mask, variance[..., c]) for c in range(3)),
        reference.samples,
        reference.seconds,
    )


_SOFTBOX_MM = 500.0
EYE_FRAME_MM = 30.0
"""Height of the field of view for pictures of an eye."""
_LIPS_FRAME_MM, _EAR_FRAME_MM = 72.0, 120.0


@dataclass(frozen=True)
class View:
    """View of a person in which frame and path tracing are compared.

    camera : function that returns the camera for a head
    light : name of a light preset or of a panorama
    pose : name of an expression; None for the rest pose
    sample_factor : factor by which the number of paths per pixel is multiplied
    """

    camera: Callable[[Head], Camera]
    light: str
    pose: str | None = None
    sample_factor: float = 1.0


def eye_camera(head: Head) -> Camera:
    """Return a camera in front of the left eye, with a field of view of 30 mm."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x, y, z + 500.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def eye_side_camera(head: Head) -> Camera:
    """Return a camera on the outer side of the left eye."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x + 380.0, y, z + 330.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def lips_camera(head: Head) -> Camera:
    """Return a camera in front of the mouth, a little to its left."""
    x, y, z = head.frontmost(0.0, _mouth_height_mm(head))
    return Camera(position=(x + 120.0, y, z + 500.0), target=(x, y - 4.0, z), frame_mm=_LIPS_FRAME_MM)


def behind_ear_camera(head: Head) -> Camera:
    """Return a camera behind the left ear."""
    preset = CAMERA_PRESETS["ear"](head)
    x, y, z = preset.target
    return Camera(position=(x + 430.0, y + 10.0, z - 430.0), target=(x - 8.0, y, z), frame_mm=_EAR_FRAME_MM)


def _eye_position_mm(head: Head) -> tuple[float, float, float]:
    """Return the front of the left cornea, relative to the head's centre [mm]."""
    if head.eyes is None:
        return head.frontmost(30.0, 0.0)
    x, y, z = head.control.positions_mm[head.eyes.apex[0]] - np.array(head.centre_mm)
    return float(x), float(y), float(z)


def _mouth_height_mm(head: Head) -> float:
    """Return the mean height of the teeth relative to the head's centre [mm]."""
    names = [material.part for material in head.mesh.materials]
    teeth = [names.index(part) for part in ("upper teeth", "lower teeth") if part in names]
    vertices = np.unique(head.mesh.triangles[np.isin(head.mesh.material, teeth)])
    if not len(vertices):
        return -60.0
    return float(head.mesh.positions[vertices, 1].mean() - head.centre_mm[1])


VIEWS: dict[str, View] = {
    "portrait": View(portrait, "studio"),
    "three-quarter": View(three_quarter, "studio"),
    "profile": View(side, "studio"),
    "eye": View(eye_camera, "window", sample_factor=2.0),
    "eye from its side": View(eye_side_camera, "window", sample_factor=2.0),
    "lips and teeth": View(lips_camera, "studio", "smile-with-teeth"),
    "cheek": View(cheek, "studio"),
    "ear from behind": View(behind_ear_camera, "studio"),
    "portrait, window": View(portrait, "window"),
    "portrait, esplanade": View(portrait, "royal_esplanade"),
    "three-quarter, lebombo": View(three_quarter, "lebombo"),
}
PANORAMAS = ("royal_esplanade", "lebombo", UNIFORM_PANORAMA)


def view_scene(head: Head, view: View) -> Scene:
    """Return the scene of a view, with softboxes in place of point lights.

    A path that leaves an eye through its cornea cannot hit a point light.
    """
    pose = None if view.pose is None else Pose(expression(view.pose))
    camera = view.camera(head)
    if view.light in PANORAMAS:
        return Scene(head, environment=Environment(name=view.light), camera=camera, pose=pose)
    lights = tuple(as_softbox(light) for light in preset_lights(view.light))
    return Scene(head, lights=lights, camera=camera, pose=pose)


def as_softbox(light: Light) -> Light:
    """Return a softbox at the position of a point light; return any other light unchanged."""
    if type(light) is RectangleLight or not isinstance(light, PointLight) or hasattr(light, "radius_mm"):
        return light
    shared = light.model_dump(include={"position", "target", "irradiance"})
    return RectangleLight(**shared, width_mm=_SOFTBOX_MM, height_mm=_SOFTBOX_MM)


_PUPIL_RADIUS_MM = 4.0  # around the middle, for the position of the pupil
_IRIS_INNER_MM, _IRIS_OUTER_MM = 2.6, 5.0  # ring of the iris, as seen from the front
_HIGHLIGHT_FACTOR = 1.6  # least brightness of highlights, relative to the median of the ring


class IrisErrors(NamedTuple):
    """Errors of an iris as rendered by dermis against the path-traced reference.

    right, down : shift of the reference's pupil from that of dermis [pixel]
    brightness : ratio of the mean brightness by dermis to that of the reference, on the ring of the iris
        without highlights [-]
    left_half, right_half : the brightness ratio on each half of the ring [-]
    """

    right: Estimate
    down: Estimate
    brightness: Estimate
    left_half: Estimate
    right_half: Estimate


def iris_errors(pair: PersonComparison, frame_mm: float) -> IrisErrors:
    """Return the errors of an iris, in pictures whose centre shows an eye from the front.

    frame_mm : visible height [mm]
    """
    ours, reference = pair.ours.mean(axis=2), pair.reference.mean(axis=2)
    noise = pair.variance.mean(axis=2)  # an upper bound, since channels may share paths
    side = len(ours)
    along = (np.arange(side) + 0.5 - 0.5 * side) * frame_mm / side
    x, y = np.meshgrid(along, along)
    radius = np.hypot(x, y)
    ring = (radius > _IRIS_INNER_MM) & (radius < _IRIS_OUTER_MM)
    dull = _without_highlights(ours, ring) & _without_highlights(reference, ring)
    right, down = _image_shift(ours, reference, noise, dull & (radius < _PUPIL_RADIUS_MM))
    masks = (ring & dull & half for half in (radius > 0, x < 0, x >= 0))
    return IrisErrors(right, down, *(_brightness_ratio(ours, reference, noise, mask) for mask in masks))


def _without_highlights(image: Floats, ring: Mask) -> Mask:
    """Return the mask (h, w) of pixels outside highlights, which are found in a blurred picture.

    ring : (h, w) mask of the iris, whose median brightness determines the threshold
    """
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(image, 2.0)
    return np.asarray(smooth < _HIGHLIGHT_FACTOR * np.median(smooth[ring]))


def _image_shift(ours: Floats, reference: Floats, noise: Floats, region: Mask) -> tuple[Estimate, Estimate]:
    """Return the shift of the reference relative to the picture by dermis, to the right and down [pixel].

    Shift and brightness are fitted together by least squares.

    noise : (h, w) variance of the reference
    region : (h, w) mask of the pixels to compare
    """
    down, right = (np.asarray(slope) for slope in np.gradient(ours))
    columns = np.stack([ours[region], -right[region], -down[region], np.ones(int(region.sum()))], axis=-1)
    inverse = np.linalg.inv(columns.T @ columns) @ columns.T
    gain, x, y, _ = (float(one) for one in inverse @ reference[region])
    error: Floats = np.sqrt((inverse**2 * noise[region]).sum(axis=1)) / abs(gain)
    return Estimate(x / gain, float(error[1])), Estimate(y / gain, float(error[2]))


def _brightness_ratio(ours: Floats, reference: Floats, noise: Floats, region: Mask) -> Estimate:
    total = float(reference[region].sum())
    ratio = float(ours[region].sum()) / total
    return Estimate(ratio, ratio * float(np.sqrt(noise[region].sum())) / total)
