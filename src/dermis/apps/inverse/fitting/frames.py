"""Frames of a face under each light alone; linear combinations of these frames approximate a photograph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.light_basis import AMBIENT_LOBE_COUNT, ambient_panorama
from dermis.apps.inverse.fitting.unknowns import FitUnknowns, sun_lights, with_skin
from dermis.base.atomic_write import atomic_file
from dermis.frame.rendered_frame import RenderedFrame
from dermis.frame.renderer import Renderer
from dermis.images.hdr import encode_exr
from dermis.optics.media import Floats
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Mask = NDArray[np.bool_]
_SKIN_LABELS = 1, 2  # labels of face and scalp, and of the nose
_MIN_VIEW_COSINE = 0.3
"""Smallest cosine between normal and view of a pixel in the mask; frames are inaccurate at grazing angles."""
_FULL_COVERAGE = 0.999


@dataclass(eq=False)
class FaceRenderer:
    """Renderer of a scene's head under any light and with any skin, for the pixels of a mask.

    renderer : renderer that draws the frames
    scene : head, camera and pose, without lights and environment
    settings : size and quality of the frames
    folder : temporary folder for the panoramas of ambient light
    mask : (h, w) skin pixels that are compared with the photograph, set by `find_mask`
    frame_count : number of frames drawn so far
    """

    renderer: Renderer
    scene: Scene
    settings: Settings
    folder: Path
    mask: Mask = field(init=False)
    frame_count: int = 0

    def find_mask(self, fit_unknowns: FitUnknowns, unclipped_pixels: Floats) -> None:
        """Set the mask (h, w) to the pixels of skin that are neither clipped nor seen at grazing angles.

        fit_unknowns : unknowns of the fit, of which only the skin parameters are used
        unclipped_pixels : (h, w) for each pixel of the photograph, the fraction of its area that is opaque
            and has no clipped channel
        """
        scene = with_skin(self._scene_with_lights(()), fit_unknowns)
        scene = replace(scene, lights=sun_lights(np.array([[0.0, 0.0, 1.0]]), [1.0], np.ones(3)))
        rendered = self._draw_frame(scene, "mask", ("label", "normal_camera", "alpha"))
        label, alpha = rendered.output("label"), rendered.output("alpha")
        view_cosine = np.abs(rendered.output("normal_camera")[..., 2])
        skin = np.isin(label, _SKIN_LABELS) & (alpha > _FULL_COVERAGE) & (view_cosine > _MIN_VIEW_COSINE)
        self.mask = _erode(skin) & (unclipped_pixels > _FULL_COVERAGE)

    def single_light_radiance(self, fit_unknowns: FitUnknowns) -> Floats:
        """Render the face under each light alone; return the radiance (9 + k, p, 3) of p pixels in the mask.

        The first nine lights are wide lobes of ambient light, see `lobe_directions`, with radiance 1 along
        their axes. The other k lights are suns with irradiance 1.
        """
        return np.stack(
            [self._masked_radiance(scene, view) for scene, view in self._single_light_scenes(fit_unknowns)]
        )

    def diffuse_and_specular_radiance(self, fit_unknowns: FitUnknowns) -> tuple[Floats, Floats]:
        """Return the diffuse radiance (9 + k, p, 3) and the specular radiance under each light alone."""
        scenes = []
        for scene, view in self._single_light_scenes(fit_unknowns):
            rendered = self._draw_frame(scene, view, ("diffuse", "specular"))
            scenes.append([rendered.output(name)[self.mask] for name in ("diffuse", "specular")])
        both = np.asarray(scenes, np.float64)
        return both[:, 0], both[:, 1]

    def combined_radiance(
        self, fit_unknowns: FitUnknowns, light_strengths: Floats, frame_name: str
    ) -> Floats:
        """Render the face under all lights together; return the radiance (p, 3) of the p pixels in the mask.

        light_strengths : (9 + k,) strengths of ambient lobes and suns
        frame_name : file name of the ambient light's panorama, without suffix
        """
        return self._masked_radiance(self.lit_scene(fit_unknowns, light_strengths, frame_name), "together")

    def lit_scene(
        self, fit_unknowns: FitUnknowns, light_strengths: Floats, panorama_name: str = "light"
    ) -> Scene:
        """Return the scene with the fitted skin and all lights; write the panorama of its ambient light.

        light_strengths : (9 + k,) strengths of ambient lobes and suns
        panorama_name : file name of the panorama in `folder`, without suffix
        """
        suns = sun_lights(fit_unknowns.suns, light_strengths[AMBIENT_LOBE_COUNT:], np.ones(3))
        radiance = ambient_panorama(light_strengths[:AMBIENT_LOBE_COUNT])
        lights = [one for one in suns if max(one.irradiance) > 0.0]
        ambient = self._panorama_environment(panorama_name, radiance) if radiance.max() > 0.0 else None
        return with_skin(replace(self._scene_with_lights(lights), environment=ambient), fit_unknowns)

    def render_picture(self, scene: Scene) -> Floats:
        """Render a scene; return the linear radiance of all pixels (h, w, 3)."""
        return np.asarray(self._draw_frame(scene, "together").linear(), np.float64)

    def _single_light_scenes(self, fit_unknowns: FitUnknowns) -> list[tuple[Scene, str]]:
        """Return for each light a scene with this light alone, and the name for caching the scene's frame."""
        base = with_skin(self._scene_with_lights(()), fit_unknowns)
        scenes = []
        for k in range(AMBIENT_LOBE_COUNT):
            path = self.folder / f"lobe_{k}.exr"
            existing = Environment(name=str(path)) if path.exists() else None
            ambient = existing or self._panorama_environment(
                path.stem, ambient_panorama(np.eye(AMBIENT_LOBE_COUNT)[k])
            )
            scenes.append((replace(base, environment=ambient), f"lobe {k}"))
        for k, sun in enumerate(sun_lights(fit_unknowns.suns, np.ones(len(fit_unknowns.suns)), np.ones(3))):
            scenes.append((replace(base, lights=(sun,)), f"sun {k}"))
        return scenes

    def _panorama_environment(self, panorama_name: str, radiance: Floats) -> Environment:
        path = self.folder / f"{panorama_name}.exr"
        with atomic_file(path) as file:
            file.write_bytes(encode_exr(np.repeat(radiance[..., None], 3, axis=2).astype(np.float32)))
        return Environment(name=str(path))

    def _scene_with_lights(self, lights: Sequence[object]) -> Scene:
        return replace(self.scene, lights=tuple(lights), environment=None)  # type: ignore[arg-type]

    def _masked_radiance(self, scene: Scene, view_name: str) -> Floats:
        return np.asarray(self._draw_frame(scene, view_name).linear()[self.mask], np.float64)

    def _draw_frame(self, scene: Scene, view_name: str, outputs: tuple[str, ...] = ()) -> RenderedFrame:
        self.frame_count += 1
        return self.renderer.draw(scene, self.settings, timed=False, view=view_name, outputs=outputs)


def _erode(mask: Mask) -> Mask:
    """Return a mask eroded by one pixel in all eight directions."""
    padded = np.pad(mask, 1)
    rows = padded[:-2] & padded[1:-1] & padded[2:]
    return np.asarray(rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:])
