"""Request of a frame: everything that determines its cached resources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dermis.frame.lights.environment import EnvironmentMap
from dermis.frame.seams import AtlasPlan, SeamMethod, plan_atlases, seam_method
from dermis.frame.technique import ProfileSplit, TechniqueTraits
from dermis.human.skin.painted import MAX_SIDE, MIN_SIDE, PaintedMaps
from dermis.mesh.head import Head
from dermis.optics.bands import Bands
from dermis.optics.gaussians import GaussianSum
from dermis.scene.environment import Environment
from dermis.scene.outputs import OUTPUTS
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin


@dataclass(frozen=True)
class FrameRequest:
    """Everything that determines the cached resources of a frame.

    profile : diffusion profile of the skin; the first profile if the skin has several (`other_profiles`)
    rest_positions_mm : (p, 3) positions of the person's control points in the rest pose [mm]; None if they
        are the control points of `topology_head`, the template whose mesh several people can share
    environment : light from all directions around the head, None if there is none
    environment_map : prefiltered panorama of `environment`
    light_part_counts : number of parts into which each light is divided. The last entries are for the lights
        that replace the brightest areas of the panorama, such as the sun
    shadow_layers : number of shadow maps
    posed : whether the scene has a pose
    is_living : whether the scene has a state of the skin or a pulse
    view_name : cache key of the scene, for callers that draw several scenes in turn
    other_profiles : further diffusion profiles of the skin, which `blend_weights` blends with `profile`; all
        profiles have the same variances
    blend_weights : (h, w, 2) weights of the other profiles as a map over the skin [-], None for a single
        profile
    outputs : names of the requested outputs besides the picture
    landmarks : names of the requested landmark sets
    bands : wavelengths in the place of red, green and blue
    """

    head: Head
    skin: Skin
    profile: GaussianSum
    rest_positions_mm: NDArray[np.float32] | None
    settings: Settings
    environment: Environment | None
    environment_map: EnvironmentMap
    technique: TechniqueTraits
    light_part_counts: tuple[int, ...]
    shadow_layers: int
    posed: bool
    view_name: str
    is_living: bool = False
    other_profiles: tuple[GaussianSum, ...] = ()
    blend_weights: NDArray[np.float32] | None = None
    outputs: tuple[str, ...] = ()
    landmarks: tuple[str, ...] = ()
    bands: Bands | None = None

    @property
    def topology_head(self) -> Head:
        """Return the head for which the atlas is computed: the template that people share, or `head`."""
        return self.head.topology_head

    @property
    def has_shared_mesh(self) -> bool:
        """Return whether several people share the mesh, and thus also the atlas and other resources."""
        return self.topology_head is not self.head.without_maps

    @property
    def takes_albedo_from_map(self) -> bool:
        """Return whether the colour map alone determines the albedo."""
        return self.skin.albedo == "map"

    @property
    def light_cache_key(self) -> str:
        """Return the cache key of resources that hold light; it consists of view name and shadow map size."""
        return f"{self.view_name} {self.settings.shadow_size}"

    @cached_property
    def profile_split(self) -> ProfileSplit:
        """Return the profile, split into a narrow Gaussian and the Gaussians that blur light.

        The narrow Gaussian is not blurred: its share of the light leaves the skin where it enters, and is
        computed at each pixel. If the skin has several profiles, the field `others` of the result contains
        the splits of the other profiles.
        """
        profiles = self.profile, *self.other_profiles
        first, *others = (
            self.technique.split_profile(profile, self.takes_albedo_from_map) for profile in profiles
        )
        fine = {} if others else first.fine  # with blends, stripes are as fine as texels
        return replace(first, others=tuple(others), fine=fine)

    @property
    def mixes_profiles(self) -> bool:
        """Return whether the skin has several diffusion profiles, which `blend_weights` blends."""
        return bool(self.other_profiles)

    @cached_property
    def has_occlusion(self) -> bool:
        """Return whether the frame computes which parts of the environment the head hides from its own skin.

        It does if there is an environment and the setting `occlusion` is not "none".
        """
        return self.environment is not None and self.settings.occlusion != "none"

    @property
    def has_interreflection(self) -> bool:
        """Return whether the frame includes light that one part of the skin reflects to another.

        The settings must request it. In a scene with an environment, `has_occlusion` must be true as well.
        """
        return self.settings.interreflection and (self.has_occlusion or self.environment is None)

    @property
    def occlusion_follows_shape(self) -> bool:
        """Return whether occlusion is recomputed when the shape of the head changes."""
        changes = self.posed or self.rest_positions_mm is not None
        return self.has_occlusion and changes and self.settings.occlusion == "baked"

    @cached_property
    def seam_method(self) -> SeamMethod:
        """Return how seams are treated, which depends on the settings and the technique."""
        return seam_method(self.settings.seams, self.technique.stitches_seams)

    @property
    def painted_map_side(self) -> int:
        """Return the side of the maps that are painted on the device [texels]; 0 for maps from files."""
        if not isinstance(self.head.maps, PaintedMaps):
            return 0
        side = 1 << (self.settings.atlas - 1).bit_length()
        return min(max(side, MIN_SIDE), MAX_SIDE)

    @property
    def has_fine_relief(self) -> bool:
        """Return whether the skin has relief finer than its maps.

        The painted gloss maps store the strength of this relief."""
        maps = self.head.maps
        return self.painted_map_side > 0 and maps.specular is None and maps.roughness is None

    @property
    def has_animated_maps(self) -> bool:
        """Return whether expressions or states of the skin change the painted maps."""
        return (self.posed or self.is_living) and self.painted_map_side > 0 and bool(self.head.targets)

    @property
    def blur_count(self) -> int:
        """Return the number of Gaussians that blur light over the atlas."""
        return len(self.profile_split.blurred_mm2)

    @property
    def output_channels(self) -> dict[str, int]:
        """Return a dictionary from the name of each requested output to its number of channels."""
        return {name: OUTPUTS[name].channels or len(self.light_part_counts) for name in self.outputs}

    @cached_property
    def atlas_plan(self) -> AtlasPlan:
        """Return the names of the atlas layouts, and the side of each atlas."""
        return plan_atlases(self.seam_method, self.settings, self.blur_count, self.has_occlusion)
