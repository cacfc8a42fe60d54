"""Everything a frame reads: resources that persist, and what cameras and lights change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dermis.frame.features.diffusion.pyramid import Blur
from dermis.frame.features.occlusion.moving import Look
from dermis.frame.features.outputs.stage_inputs import PreviousScene
from dermis.frame.features.shape.shape import MotionBytes
from dermis.frame.projection import Triple, Views
from dermis.frame.resources import AtlasLayout, Resources
from dermis.gpu import Bindings, Constants, Record
from dermis.scene.camera import Window
from dermis.scene.settings import Settings


@dataclass(frozen=True, eq=False)
class Inputs:
    """Everything that a frame reads.

    motion : what moves the head's shape
    movements : what changes the painted face, None where nothing does
    layouts, blurs : those of the resources, in the frame's light
    shadow_views : how the shadow maps see the head
    light_constants : pipeline constants of what is lit
    camera : how the picture's samples see the head
    window : what the picture shows of a plane before the eye
    around : how the sky sees the head, and the shader's record of it; None where occlusion does not move
    view, constants : record of the shading pass, and its pipeline constants
    centre_mm : the head's, from which places of the scene are counted
    previous : the scene before, None where nothing reads it
    """

    resources: Resources
    settings: Settings
    motion: MotionBytes
    movements: NDArray[np.float32] | None
    layouts: tuple[AtlasLayout, ...]
    blurs: tuple[Blur, ...]
    shadow_views: Views
    light_constants: Constants
    camera: Views
    window: Window
    around: tuple[Look, Record] | None
    view: Record
    constants: Constants
    centre_mm: Triple
    previous: PreviousScene | None = None

    @property
    def lit(self) -> Bindings:
        """Resources of the layout that is looked at."""
        return self.layouts[0].lit
