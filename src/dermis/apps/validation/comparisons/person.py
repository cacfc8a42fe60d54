"""The package's human beside the same person path-traced: pictures and figures view by view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.truths.metrics import Estimate, energy_ratio, relative_rmse
from dermis.apps.truths.path_traced import PathTraced, Variant
from dermis.apps.truths.person.path_traced import path_trace_person
from dermis.apps.truths.person.person import SkinTextures
from dermis.apps.validation.comparisons.references import check_visible
from dermis.base.errors import refuse
from dermis.environment.panorama import UNIFORM
from dermis.frame.renderer import Renderer
from dermis.human.expressions import expression
from dermis.images.colour import encode_srgb
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.camera import PRESETS, Camera, side, three_quarter
from dermis.scene.camera import cheek as at_cheek
from dermis.scene.camera import portrait as from_front
from dermis.scene.environment import Environment
from dermis.scene.lights import Light, PointLight, RectangleLight, preset_lights
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Floats = NDArray[np.float64]
_FULL_COVERAGE = 0.999  # share of a pixel
_WHITE_PERCENTILE = 98.0


@dataclass(frozen=True, eq=False)
class PersonComparison:
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
        bright = np.percentile(self.truth[self.mask], _WHITE_PERCENTILE)
        return 0.8 / max(float(bright), 1e-9)

    def shown(self, image: Floats) -> NDArray[np.uint8]:
        """Return (h, w, 3) sRGB bytes at the exposure of both."""
        encoded = encode_srgb(np.clip(self.exposure * image, 0.0, 1.0))
        return np.asarray(np.rint(255 * encoded), np.uint8)


def compare_person(
    renderer: Renderer,
    head: Head,
    paint: SkinTextures,
    name: str,
    *,
    side: int = 256,
    samples: int = 64,
    atlas: int = 2048,
    use_cache: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> PersonComparison:
    """Draw a view of a person by the frame and by path tracing.

    paint : what the frame shows on it, see `paint_of`
    name : of `VIEWS`
    side : of the pictures [pixel]
    samples : paths through each pixel, more in some views
    atlas : side of the frame's atlas [texel]
    use_cache, progress : as of `path_trace`

    Raises DermisError for other views, and for heads without eyes of true shape.
    """
    if name not in VIEWS:
        refuse("view", f"one of {', '.join(VIEWS)}", f"got {name!r}", "Choose one of them")
    settings = Settings(size=(side, side), atlas=atlas, samples=4)
    scene, wanted = view_scene(head, VIEWS[name]), round(samples * VIEWS[name].times)
    truth = trace_view(renderer, scene, paint, settings.size, wanted, use_cache, progress)
    mask = truth.mask > _FULL_COVERAGE
    check_visible(mask)
    return comparison_of(name, render_frame(renderer, scene, settings), truth, mask)


def render_frame(renderer: Renderer, scene: Scene, settings: Settings) -> Floats:
    """Return (h, w, 3) linear radiance by the frame, drawn twice as large and averaged.

    More samples of a pixel would do as well, but on software adapters many samples of many large lights end
    the shading before its last pixels.
    """
    width, height = settings.size
    larger = settings.model_copy(update={"size": (2 * width, 2 * height)})
    image = renderer.draw(scene, larger).linear().astype(np.float64)
    return np.asarray(image.reshape(height, 2, width, 2, 3).mean(axis=(1, 3)))


def trace_view(
    renderer: Renderer,
    scene: Scene,
    paint: SkinTextures,
    size: tuple[int, int],
    samples: int,
    use_cache: bool = True,
    progress: Callable[[int, int], None] | None = None,
    variant: Variant = "scalar_rgb",
) -> PathTraced:
    """Return a person path-traced; light below skin of the mean colour spreads as far as the profile says.

    variant : as of `path_trace`
    """
    profile, colour = renderer.skin_profile(scene.skin), scene.head.maps.mean_colour
    assert colour is not None  # painted people have one
    weight, width = profile.weight, np.sqrt(0.5 * np.pi * profile.variance_mm2)
    distance = (weight * width[:, None]).sum(axis=0) / weight.sum(axis=0)
    return path_trace_person(
        scene, paint, distance, colour, size, samples, variant=variant, use_cache=use_cache, progress=progress
    )


def comparison_of(name: str, ours: Floats, truth: PathTraced, mask: NDArray[np.bool_]) -> PersonComparison:
    """Return both pictures with their figures."""
    image, variance = truth.image.astype(np.float64), truth.variance.astype(np.float64)
    return PersonComparison(
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


_SOFTBOX_MM = 500.0
EYE_FRAME_MM = 30.0
"""Height of the pictures of an eye."""
_LIPS_FRAME_MM, _EAR_FRAME_MM = 72.0, 120.0


@dataclass(frozen=True)
class View:
    """What is looked at.

    camera : before a head
    light : a preset's name, or a panorama's
    pose : name of an expression
    times : by how much more paths it takes than others
    """

    camera: Callable[[Head], Camera]
    light: str
    pose: str | None = None
    times: float = 1.0


def eye_camera(head: Head) -> Camera:
    """Return the left eye from the front, 30 mm of it."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x, y, z + 500.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def eye_side_camera(head: Head) -> Camera:
    """Return the left eye from its outer side."""
    x, y, z = _eye_position_mm(head)
    return Camera(position=(x + 380.0, y, z + 330.0), target=(x, y, z), frame_mm=EYE_FRAME_MM)


def lips_camera(head: Head) -> Camera:
    """Return the mouth from a little to the left."""
    x, y, z = head.frontmost(0.0, _mouth_height_mm(head))
    return Camera(position=(x + 120.0, y, z + 500.0), target=(x, y - 4.0, z), frame_mm=_LIPS_FRAME_MM)


def behind_ear_camera(head: Head) -> Camera:
    """Return the left ear from behind."""
    usual = PRESETS["ear"](head)
    x, y, z = usual.target
    return Camera(position=(x + 430.0, y + 10.0, z - 430.0), target=(x - 8.0, y, z), frame_mm=_EAR_FRAME_MM)


def _eye_position_mm(head: Head) -> tuple[float, float, float]:
    """Return the left eye's apex, from the head's centre."""
    if head.eyes is None:
        return head.frontmost(30.0, 0.0)
    x, y, z = head.control.positions_mm[head.eyes.apex[0]] - np.array(head.centre_mm)
    return float(x), float(y), float(z)


def _mouth_height_mm(head: Head) -> float:
    """Return the height of the mouth: where upper and lower teeth meet, in the mean."""
    names = [material.part for material in head.mesh.materials]
    teeth = [names.index(part) for part in ("upper teeth", "lower teeth") if part in names]
    chosen = np.unique(head.mesh.triangles[np.isin(head.mesh.material, teeth)])
    if not len(chosen):
        return -60.0
    return float(head.mesh.positions[chosen, 1].mean() - head.centre_mm[1])


VIEWS: dict[str, View] = {
    "portrait": View(from_front, "studio"),
    "three-quarter": View(three_quarter, "studio"),
    "profile": View(side, "studio"),
    "eye": View(eye_camera, "window", times=2.0),
    "eye from its side": View(eye_side_camera, "window", times=2.0),
    "lips and teeth": View(lips_camera, "studio", "smile-with-teeth"),
    "cheek": View(at_cheek, "studio"),
    "ear from behind": View(behind_ear_camera, "studio"),
    "portrait, window": View(from_front, "window"),
    "portrait, esplanade": View(from_front, "royal_esplanade"),
    "three-quarter, lebombo": View(three_quarter, "lebombo"),
}
PANORAMAS = ("royal_esplanade", "lebombo", UNIFORM)


def view_scene(head: Head, view: View) -> Scene:
    """Return a head in a view, in lights with a size: no path through a cornea finds a point light."""
    given = {"camera": view.camera(head), "pose": None if view.pose is None else Pose(expression(view.pose))}
    if view.light in PANORAMAS:
        return Scene(head, environment=Environment(name=view.light), **given)  # type: ignore[arg-type]
    lights = tuple(as_softbox(light) for light in preset_lights(view.light))
    return Scene(head, lights=lights, **given)  # type: ignore[arg-type]


def as_softbox(light: Light) -> Light:
    """Return a light from a point as a softbox in its place; any other as it is."""
    if type(light) is RectangleLight or not isinstance(light, PointLight) or hasattr(light, "radius_mm"):
        return light
    return RectangleLight(
        position=light.position,
        target=light.target,
        irradiance=light.irradiance,
        width_mm=_SOFTBOX_MM,
        height_mm=_SOFTBOX_MM,
    )


Mask = NDArray[np.bool_]
_PUPIL_RADIUS_MM = 4.0  # around the middle: what tells where the pupil is
_IRIS_INNER_MM, _IRIS_OUTER_MM = 2.6, 5.0  # ring of the iris, as seen from the front
_HIGHLIGHT_FACTOR = 1.6  # over the median of the ring: highlights


class IrisErrors(NamedTuple):
    """Of ours against the truth.

    right, down : how far the truth's pupil lies from ours [pixel]
    brightness : mean of ours over that of the truth on the ring of the iris, highlights aside [-]
    left, beside : the same on the ring's left and right halves
    """

    right: Estimate
    down: Estimate
    brightness: Estimate
    left: Estimate
    beside: Estimate


def iris_errors(pair: PersonComparison, frame_mm: float) -> IrisErrors:
    """Return the figures of a picture with an eye in its middle, seen from the front.

    frame_mm : height of the picture
    """
    ours, truth = pair.ours.mean(axis=2), pair.truth.mean(axis=2)
    noise = pair.variance.mean(axis=2)  # channels may share paths: at most so much
    side = len(ours)
    along = (np.arange(side) + 0.5 - 0.5 * side) * frame_mm / side
    x, y = np.meshgrid(along, along)
    off = np.hypot(x, y)
    ring = (off > _IRIS_INNER_MM) & (off < _IRIS_OUTER_MM)
    dull = _without_highlights(ours, ring) & _without_highlights(truth, ring)
    right, down = _image_shift(ours, truth, noise, dull & (off < _PUPIL_RADIUS_MM))
    ring &= dull
    whole, left, beside = (_brightness_ratio(ours, truth, noise, ring & part) for part in (off > 0, x < 0, x >= 0))
    return IrisErrors(right, down, whole, left, beside)


def _without_highlights(image: Floats, ring: Mask) -> Mask:
    """Return (h, w) pixels off highlights; a mean over neighbours tells them in a noisy picture."""
    from scipy.ndimage import gaussian_filter

    smooth = gaussian_filter(image, 2.0)
    return np.asarray(smooth < _HIGHLIGHT_FACTOR * np.median(smooth[ring]))


def _image_shift(ours: Floats, truth: Floats, noise: Floats, part: Mask) -> tuple[Estimate, Estimate]:
    """Return the shift of the truth to the right of and below ours, fitted along with its brightness."""
    down, right = (np.asarray(slope) for slope in np.gradient(ours))
    columns = np.stack([ours[part], -right[part], -down[part], np.ones(int(part.sum()))], axis=-1)
    inverse = np.linalg.inv(columns.T @ columns) @ columns.T
    gain, x, y, _ = (float(one) for one in inverse @ truth[part])
    error: Floats = np.sqrt((inverse**2 * noise[part]).sum(axis=1)) / abs(gain)
    return Estimate(x / gain, float(error[1])), Estimate(y / gain, float(error[2]))


def _brightness_ratio(ours: Floats, truth: Floats, noise: Floats, part: Mask) -> Estimate:
    total = float(truth[part].sum())
    ratio = float(ours[part].sum()) / total
    return Estimate(ratio, ratio * float(np.sqrt(noise[part].sum())) / total)
