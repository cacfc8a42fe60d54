"""Frames of a face under each light alone; a photograph is a linear combination of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.light_basis import BASIS, panorama
from dermis.apps.inverse.fitting.unknowns import FitPoint, sun_lights, with_skin
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
"""Least cosine between normal and view; at grazing angles the frame is least accurate."""
_FULL_COVERAGE = 0.999


@dataclass(eq=False)
class FaceRenderer:
    """Renderer of a scene's head under any light with any skin, limited to the pixels of a mask.

    scene : head, camera and pose, without lights and environment
    folder : for panoramas
    frame_count : number of frames drawn
    """

    renderer: Renderer
    scene: Scene
    settings: Settings
    folder: Path
    mask: Mask = field(init=False)
    frame_count: int = 0

    def find_mask(self, point: FitPoint, unclipped: Floats) -> None:
        """Set the mask (h, w) of skin pixels at which the photograph is usable.

        unclipped : (h, w) fraction of the pixel without clipped channels
        """
        scene = with_skin(self._lit(()), point)
        scene = replace(scene, lights=sun_lights(np.array([[0.0, 0.0, 1.0]]), [1.0], np.ones(3)))
        rendered = self._draw(scene, "mask", ("label", "normal_camera", "alpha"))
        label, alpha = rendered.output("label"), rendered.output("alpha")
        view_cosine = np.abs(rendered.output("normal_camera")[..., 2])
        skin = np.isin(label, _SKIN_LABELS) & (alpha > _FULL_COVERAGE) & (view_cosine > _MIN_VIEW_COSINE)
        self.mask = _eroded(skin) & (unclipped > _FULL_COVERAGE)

    def basis(self, point: FitPoint) -> Floats:
        """Return the radiance (9 + k, p, 3) under each lobe of radiance 1 and each sun of irradiance 1."""
        return np.stack([self._image(scene, view) for scene, view in self._single_light_scenes(point)])

    def diffuse_and_specular(self, point: FitPoint) -> tuple[Floats, Floats]:
        """Return the radiance of `basis` as diffuse and specular parts."""
        scenes = []
        for scene, view in self._single_light_scenes(point):
            rendered = self._draw(scene, view, ("diffuse", "specular"))
            scenes.append([rendered.output(name)[self.mask] for name in ("diffuse", "specular")])
        both = np.asarray(scenes, np.float64)
        return both[:, 0], both[:, 1]

    def combined(self, point: FitPoint, strengths: Floats, name: str) -> Floats:
        """Return the radiance (p, 3) under all lights at once.

        strengths : (9 + k,) of lobes and suns
        name : of the panorama
        """
        return self._image(self.lit_scene(point, strengths, name), "together")

    def lit_scene(self, point: FitPoint, strengths: Floats, name: str = "light") -> Scene:
        """Return the scene with the skin of a point and all lights, whose panorama is in the folder."""
        suns = sun_lights(point.suns, strengths[BASIS:], np.ones(3))
        radiance = panorama(strengths[:BASIS])
        lights = [one for one in suns if max(one.irradiance) > 0.0]
        ambient = self._environment(name, radiance) if radiance.max() > 0.0 else None
        return with_skin(replace(self._lit(lights), environment=ambient), point)

    def picture(self, scene: Scene) -> Floats:
        """Return the radiance (h, w, 3) of a frame."""
        return np.asarray(self._draw(scene, "together").linear(), np.float64)

    def _single_light_scenes(self, point: FitPoint) -> list[tuple[Scene, str]]:
        """Return a scene for each light, with the name of its view."""
        base = with_skin(self._lit(()), point)
        scenes = []
        for k in range(BASIS):
            path = self.folder / f"lobe_{k}.exr"
            existing = Environment(name=str(path)) if path.exists() else None
            ambient = existing or self._environment(path.stem, panorama(np.eye(BASIS)[k]))
            scenes.append((replace(base, environment=ambient), f"lobe {k}"))
        for k, sun in enumerate(sun_lights(point.suns, np.ones(len(point.suns)), np.ones(3))):
            scenes.append((replace(base, lights=(sun,)), f"sun {k}"))
        return scenes

    def _environment(self, name: str, radiance: Floats) -> Environment:
        path = self.folder / f"{name}.exr"
        with atomic_file(path) as file:
            file.write_bytes(encode_exr(np.repeat(radiance[..., None], 3, axis=2).astype(np.float32)))
        return Environment(name=str(path))

    def _lit(self, lights: Sequence[object]) -> Scene:
        return replace(self.scene, lights=tuple(lights), environment=None)  # type: ignore[arg-type]

    def _image(self, scene: Scene, view: str) -> Floats:
        return np.asarray(self._draw(scene, view).linear()[self.mask], np.float64)

    def _draw(self, scene: Scene, view: str, outputs: tuple[str, ...] = ()) -> RenderedFrame:
        self.frame_count += 1
        return self.renderer.draw(scene, self.settings, timed=False, view=view, outputs=outputs)


def _eroded(mask: Mask) -> Mask:
    """Return the pixels whose neighbours are in the mask too."""
    padded = np.pad(mask, 1)
    rows = padded[:-2] & padded[1:-1] & padded[2:]
    return np.asarray(rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:])
