"""Request from which the resources of a frame are made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.frame.lights.environment import Surroundings
from dermis.frame.seams import LaidOut, Remedy, laid_out, remedy_of
from dermis.frame.technique import ProfileSplit, TechniqueTraits
from dermis.human.skin.painted import LEAST_SIDE, MOST_SIDE, PaintedMaps
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.scene.environment import Environment
from dermis.scene.outputs import OUTPUTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class FrameRequest:
    """Everything that the resources of a frame follow from.

    person : (p, 3) places of the control points where the person rests, None for those of the head's topology
    parts : how many parts each light is shaded as, those of the environment last
    shadow_layers : how many parts of lights cast shadows
    posed : whether the scene has a pose
    view : name of a scene among several that are drawn in turn
    others : profiles that a map mixes into the first one, of the same Gaussians
    share_map : (h, w, 2) their shares, None without any
    outputs, landmarks : names of what is asked of the frame besides its picture
    """

    head: Head
    skin: Skin
    profile: GaussianSum
    person: NDArray[np.float32] | None
    settings: Settings
    environment: Environment | None
    surroundings: Surroundings
    technique: TechniqueTraits
    parts: tuple[int, ...]
    shadow_layers: int
    posed: bool
    view: str
    others: tuple[GaussianSum, ...] = ()
    share_map: NDArray[np.float32] | None = None
    outputs: tuple[str, ...] = ()
    landmarks: tuple[str, ...] = ()

    @property
    def topology(self) -> Head:
        """The bare head that atlas and tables are made for."""
        return self.head.topology

    @property
    def shares(self) -> bool:
        """Whether these are made for other people too."""
        return self.topology is not self.head.bare

    @property
    def searched(self) -> NDArray[np.float32] | None:
        """Where control points rest as thin parts are looked for, None for those of the head's topology.

        All people of a template share its own: what passes through these is weighed for each.
        """
        return None if self.shares else self.person

    @property
    def white(self) -> bool:
        """Whether the colour map alone gives the colour."""
        return self.skin.albedo == "map"

    @property
    def light_of(self) -> str:
        """Whose light it is: each view and each size of shadow maps keeps its own."""
        return f"{self.view} {self.settings.shadow_size}"

    @cached_property
    def split(self) -> ProfileSplit:
        """The profiles as the technique uses them."""
        first, *others = (self.technique.split(one, self.white) for one in (self.profile, *self.others))
        fine = {} if others else first.fine  # where widths vary, a stripe is as fine as texels
        return replace(first, others=tuple(others), fine=fine)

    @property
    def mixed(self) -> bool:
        """Whether a map mixes profiles."""
        return bool(self.others)

    @cached_property
    def occluded(self) -> bool:
        """Whether the head hides some of its environment from itself."""
        return self.environment is not None and self.settings.occlusion != "none"

    @property
    def interreflects(self) -> bool:
        """Whether skin sends light to skin; not where an environment shines through the head."""
        return self.settings.interreflection and (self.occluded or self.environment is None)

    @property
    def occlusion_moves(self) -> bool:
        """Whether that follows the head's shape."""
        elsewhere = self.posed or self.person is not None
        return self.occluded and elsewhere and self.settings.occlusion == "baked"

    @cached_property
    def remedy(self) -> Remedy:
        """What is done at the seams."""
        return remedy_of(self.settings.seams, self.technique.stitches)

    @property
    def painted_side(self) -> int:
        """Of maps that the device paints [texels]; 0 for a head that has all of its own."""
        if not isinstance(self.head.maps, PaintedMaps):
            return 0
        side = 1 << (self.settings.atlas - 1).bit_length()
        return min(max(side, LEAST_SIDE), MOST_SIDE)

    @property
    def finely_painted(self) -> bool:
        """Whether there is relief finer than maps: painted maps of gloss say how much of it is where."""
        maps = self.head.maps
        return self.painted_side > 0 and maps.specular is None and maps.roughness is None

    @property
    def moving(self) -> bool:
        """Whether expressions change the maps."""
        return self.posed and self.painted_side > 0 and bool(self.head.targets)

    @property
    def count(self) -> int:
        """Gaussians that light is blurred by over the atlas."""
        return len(self.split.blurred_mm2)

    @property
    def output_channels(self) -> dict[str, int]:
        """How many numbers each output that is asked has in a pixel."""
        return {name: OUTPUTS[name].channels or len(self.parts) for name in self.outputs}

    @cached_property
    def atlases(self) -> LaidOut:
        """Names and size of the atlases."""
        return laid_out(self.remedy, self.settings, self.count, self.occluded)
