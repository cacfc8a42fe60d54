"""Inputs of a frame: cached resources, and values for the camera, the lights and the pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.diffusion.pyramid import Blur
from dermis.frame.features.hair.swing import Swing
from dermis.frame.features.occlusion.moving import SkyViews
from dermis.frame.features.outputs.stage_inputs import PreviousScene
from dermis.frame.features.shape.shape import PoseBytes
from dermis.frame.projection import Triple, Views
from dermis.frame.resources import AtlasLayout, Resources
from dermis.gpu import Bindings, Constants, UniformRecord
from dermis.scene.camera import ImageRectangle
from dermis.scene.living import SkinState
from dermis.scene.settings import Settings


@dataclass(frozen=True, eq=False)
class FrameInputs:
    """Inputs of a frame: cached resources, and values that may differ between frames with equal resources.

    resources : cached textures, buffers and records of the frame
    pose_bytes : pose of the head, as bytes for the shaders
    face_movements : (9,) strength of the facial movements that change the skin maps; None if the maps are
        constant
    skin_state : state and pulse of the skin, None for skin at rest
    layouts : atlas layouts of `resources`, each with the uniform record of this frame's lights
    blurs : Gaussian blurs of each layout, with a factor that brings this frame's light into the range of the
        texture format
    shadow_views : projections of all shadow maps
    light_constants : pipeline constants of the lights in use
    camera_views : projection of the camera, with the positions of samples in a pixel
    image_rectangle : rectangle of the image plane that the picture shows
    sky_view : views of the head from all directions, with their uniform record, to compute ambient occlusion;
        None if occlusion is not recomputed when the shape changes
    view : uniform record of the shading pass
    constants : pipeline constants of the shading pass
    centre_mm : centre of the head, the origin of positions in the scene [mm]
    previous : pose and camera of the previous scene for motion vectors, None if these are not requested
    swing : simulation of the hair, None if hair does not swing
    """

    resources: Resources
    settings: Settings
    pose_bytes: PoseBytes
    face_movements: NDArray[np.float32] | None
    skin_state: SkinState | None
    layouts: tuple[AtlasLayout, ...]
    blurs: tuple[Blur, ...]
    shadow_views: Views
    light_constants: Constants
    camera_views: Views
    image_rectangle: ImageRectangle
    sky_view: tuple[SkyViews, UniformRecord] | None
    view: UniformRecord
    constants: Constants
    centre_mm: Triple
    previous: PreviousScene | None = None
    swing: Swing | None = None

    @property
    def bindings(self) -> Bindings:
        """Return the shader resources of the first atlas layout.

        Shading reads this layout alone, even if light is also diffused in a second one (the seam method
        "multi-uv" uses two).
        """
        return self.layouts[0].bindings
