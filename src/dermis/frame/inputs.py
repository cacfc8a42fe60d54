"""Inputs of a frame: persistent resources, and records of the camera, the lights and the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.diffusion.pyramid import Blur
from dermis.frame.features.occlusion.moving import SkyViews
from dermis.frame.features.outputs.stage_inputs import PreviousScene
from dermis.frame.features.shape.shape import MotionBytes
from dermis.frame.projection import Triple, Views
from dermis.frame.resources import AtlasLayout, Resources
from dermis.gpu import Bindings, Constants, UniformRecord
from dermis.scene.camera import Window
from dermis.scene.settings import Settings


@dataclass(frozen=True, eq=False)
class FrameInputs:
    """Inputs of a frame.

    motion : pose of the head, as bytes for the shaders
    face_movements : (9,) amounts of the expressions that change the painted maps, None for none
    layouts, blurs : layouts and blurs of the resources, with the lights and the light scale of this frame
    shadow_views : view of each shadow map
    light_constants : pipeline constants of the lights in use
    camera_views : view of each sample of a pixel
    window : part of the image plane that the picture shows
    sky_view : views of the head from the sky, and their record; None unless occlusion follows the shape
    view, constants : record of the camera for the shading pass, and its pipeline constants
    centre_mm : centre of the head, the origin of positions in the scene [mm]
    previous : previous scene for motion vectors, None unless requested
    """

    resources: Resources
    settings: Settings
    motion: MotionBytes
    face_movements: NDArray[np.float32] | None
    layouts: tuple[AtlasLayout, ...]
    blurs: tuple[Blur, ...]
    shadow_views: Views
    light_constants: Constants
    camera_views: Views
    window: Window
    sky_view: tuple[SkyViews, UniformRecord] | None
    view: UniformRecord
    constants: Constants
    centre_mm: Triple
    previous: PreviousScene | None = None

    @property
    def bindings(self) -> Bindings:
        """Return the resources of the first layout, by their names in the shaders."""
        return self.layouts[0].bindings
