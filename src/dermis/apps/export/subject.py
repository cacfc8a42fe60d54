"""Skins and heads to export, with the reference profile of the skin."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from dermis.base.errors import format_value, refuse
from dermis.base.reading import checked_path
from dermis.formats.gltf.materials import encode_skin_maps
from dermis.formats.mesh_formats import find_format
from dermis.formats.part_pictures import PartPictures
from dermis.formats.samples import SAMPLES
from dermis.human.person import Human
from dermis.human.person_file import relief_slopes
from dermis.human.wear.look import ITEM_TYPES
from dermis.mesh.eye_look import EyeLook
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.half_space import tabulated_cumulative
from dermis.optics.media import Floats
from dermis.optics.profiles import find_gaussians
from dermis.optics.radial import RadialProfile, gaussian_radial_profile
from dermis.optics.tissue import Tissue
from dermis.scene.heads import is_person_name, load_head, load_person
from dermis.scene.living import SkinState
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.skin import Skin
from dermis.scene.tissue import skin_tissue

BALL_DIAMETER_MM = 100.0
"""Diameter of the ball that is exported with a skin that has no head [mm]."""

ModelName = Literal["montecarlo", "layered", "multipole", "dipole", "better-dipole"]
PROFILE_MODELS: tuple[ModelName, ...] = get_args(ModelName)
_PHOTON_COUNT = 1_000_000
_MAP_ROLES = "colour", "normal", "roughness", "specular", "height"
_MIN_ALBEDO = 1e-9
_MAX_IDENTIFIER_LENGTH = 40


@dataclass(frozen=True)
class Subject:
    """Skin to export, optionally with a head.

    name : name given by the user; it can be any text, so it must be escaped in written files
    curve : cumulative reference profile; its energy is the emerging light per incident light
    albedo : (3,) base colour: mean of the head's colour map or, without such a map, the energy of the
        profile; linear Rec. 709 [-]
    model : model of the profile, such as "montecarlo" or "layered"; "table" for a table of Gaussians
    tissue : tissue of the skin; None for a table of Gaussians
    scene : scene with the head and its skin; None for a skin without a head
    person : parametric person to whom the head belongs; None for other heads
    adapter : graphics adapter on which the textures of the eyes are painted
    """

    name: str
    curve: CumulativeProfile
    albedo: Floats
    model: str
    tissue: Tissue | None = None
    scene: Scene | None = None
    person: Human | None = None
    adapter: str = "auto"

    @property
    def head(self) -> Head | None:
        """Return the head to export, or None for a skin without a head."""
        return None if self.scene is None else self.scene.head

    @cached_property
    def head_or_ball(self) -> Head:
        """Return the head, or a ball of diameter `BALL_DIAMETER_MM` if there is no head."""
        return self.head or Head("ball", uv_sphere(0.5 * BALL_DIAMETER_MM), Maps())

    @cached_property
    def part_pictures(self) -> PartPictures | None:
        """Return the texture images of the parts of the head that are not skin; None if there are none."""
        return None if self.head is None else PartPictures.from_head(self.head)

    @property
    def identifier(self) -> str:
        """Return the subject's name in ASCII letters, digits and underscores, for files and materials."""
        name = re.sub(r"[^A-Za-z0-9]+", "_", Path(self.name).stem or self.name).strip("_")[
            :_MAX_IDENTIFIER_LENGTH
        ]
        return f"skin_{name}" if not name or name[0].isdigit() else name

    @property
    def skin(self) -> Skin:
        """Return the skin of the scene, or the default skin if there is no scene."""
        return Skin() if self.scene is None else self.scene.skin

    def clipped_albedo(self, min_albedo: float = 0.0) -> Floats:
        """Return the albedo (3,) clipped to the interval from `min_albedo` to 1."""
        return np.clip(self.albedo, min_albedo, 1.0)

    def rescale_energy(self, rendered_profile: CumulativeProfile) -> CumulativeProfile:
        """Return a rendered profile with its energy scaled for comparison with the reference profile.

        The subject's albedo may differ from the energy of its reference profile. The energy of the rendered
        profile is therefore multiplied by (energy of the reference profile) / albedo.

        rendered_profile : cumulative profile that the program renders for the subject's albedo
        """
        return rendered_profile.with_energy(
            self.curve.energy * rendered_profile.energy / np.maximum(self.albedo, _MIN_ALBEDO)
        )

    def eye_pictures(self) -> EyeTextures | None:
        """Return the painted textures of the eyes, or None if there are no eyes."""
        from dermis.frame.features.surface.painting.painted_head import reddened

        eyes = self.head_or_ball.eyes
        if eyes is None:
            return None
        return _painted_eye(reddened(eyes.look, self.scene.state if self.scene else None), self.adapter)

    def with_painted_maps(self, map_side: int, adapter: str) -> Subject:
        """Return a copy of the subject with the head's procedural maps replaced by arrays of texels.

        The maps and the look of the eyes then show the state of the skin, which the scene no longer has.

        If the head has no procedural maps, the subject itself is returned.

        map_side : side of the maps, a power of two from 256 to 4096 [texel]
        adapter : graphics adapter on which the maps are computed
        """
        head, state = self.head, self.scene.state if self.scene else None
        if self.scene is None or head is None or not head.maps.is_painted:
            return self
        from dermis.frame.features.surface.painting.painted_head import reddened, with_painted_maps
        from dermis.gpu.failures import run_on_device

        painted = run_on_device(adapter, lambda device: with_painted_maps(device, head, map_side, state))
        if painted.eyes is not None:
            eyes = replace(painted.eyes, look=reddened(painted.eyes.look, state))
            painted = replace(painted, eyes=eyes)
        return replace(self, scene=replace(self.scene, head=painted, state=None))

    def encode_maps(self) -> dict[str, bytes]:
        """Return the maps of the head as PNG files, by role.

        The roles are colour, normal, roughness, specular and height. Colours are sRGB, and the green channel
        of the normal map points up. Roughness (Beckmann's m) and specular strength are linear. Heights have
        16 bits: 0 is the lowest height of the map, and 65535 the highest.
        """
        if self.head is None:
            return {}
        pictures, _ = encode_skin_maps(self.head.maps, relief_slopes(self.head))
        return {role: pictures[role] for role in _MAP_ROLES if role in pictures}


@lru_cache(maxsize=1)  # levels of detail share the textures
def _painted_eye(look: EyeLook, adapter: str) -> EyeTextures:
    from dermis.frame.features.surface.painting.painted_head import paint_eye
    from dermis.gpu.failures import run_on_device

    return run_on_device(adapter, lambda device: paint_eye(device, look))


def load_subject(
    name_or_file: str | Path,
    *,
    profile: str | Path | None = None,
    model: ModelName | None = None,
    state: SkinState | Mapping[str, float] | None = None,
    **head: Any,
) -> Subject:
    """Load a skin or a head, given by name or file, and return it with the reference profile of its skin.

    name_or_file : name ("skin1", "dj3", "light", "gpu-gems-3") or file (.toml, .csv) of a profile, or a head:
        "human", "human:7", a person's .json file, the name of a sample, or a mesh file (.glb, .obj, .usdz,
        ...)
    profile : name or file of the profile of a head's skin; by default, the skin of a parametric person has
        the pigments of that person, and other heads have the default skin
    model : model of the reference profile, see `reference_profile`
    state : state of the skin of a person, or its weights; None for skin at rest
    head : options of `load_head`

    Raises DermisError for an unknown name, and for options and states of heads if `name_or_file` is a skin.
    """
    path = checked_path(name_or_file, "a skin or a head")
    name = str(name_or_file)
    if not (is_person_name(name) or name in SAMPLES or find_format(path)):
        given = dict(head) if profile is None else {"profile": profile}
        return _load_skin(name, model, given | ({} if state is None else {"state": state}))
    loaded = load_head(name_or_file, **head)
    person = _person_with_options(name, loaded, head) if is_person_name(name) else None
    if profile is not None:
        skin = Skin(profile=str(profile))
    else:
        skin = Skin() if person is None else skin_of(person)
    curve, used_model, tissue = reference_profile(skin, model)
    albedo = curve.energy if loaded.maps.mean_colour is None else loaded.maps.mean_colour
    scene = Scene(loaded, skin=skin, state=state)
    return Subject(path.name, curve, albedo, used_model, tissue, scene, person)


def _person_with_options(name: str, loaded: Head, head_options: Mapping[str, Any]) -> Human:
    """Return the person of a loaded head, with the eyes and worn items of the head's options."""
    changed = {item: head_options[item] for item in ITEM_TYPES if head_options.get(item)}
    if head_options.get("eye") and loaded.eyes is not None:
        changed["eyes"] = loaded.eyes.look
    return replace(load_person(name), **changed)


def _load_skin(skin_name: str, profile_model: ModelName | None, head_options: Iterable[str]) -> Subject:
    for option in head_options:
        refuse(option, "a head", f"got the skin {skin_name}", "Omit this option, or name a head")
    curve, used_model, tissue = reference_profile(Skin(profile=skin_name), profile_model)
    return Subject(Path(skin_name).name, curve, curve.energy, used_model, tissue)


def reference_profile(
    skin: Skin, profile_model: ModelName | None = None
) -> tuple[CumulativeProfile, str, Tissue | None]:
    """Return the cumulative reference profile of a skin, the name of its model, and its tissue.

    profile_model : by default, tabulated Monte Carlo for the built-in homogeneous media, and layered
        diffusion for other tissue; a profile that is given as a table of Gaussians needs no model

    Raises DermisError for an unknown model, and for a model requested for a table of Gaussians.
    """
    if profile_model is not None and profile_model not in PROFILE_MODELS:
        refuse(
            "model",
            f"one of {', '.join(PROFILE_MODELS)}",
            f"got {format_value(profile_model)}",
            "Choose one of them",
        )
    table = None if skin.overrides_tissue else find_gaussians(skin.profile)
    if table is not None:
        if profile_model is not None:
            refuse("model", "a tissue", f"{skin.profile} is a table of Gaussians", "Omit this option")
        return CumulativeProfile.from_radial_profile(gaussian_radial_profile(table)), "table", None
    tissue = skin_tissue(skin)
    may_be_tabulated = tissue.rgb is None and profile_model in (None, "montecarlo")
    if may_be_tabulated and (tabulated := tabulated_cumulative(tissue.medium)) is not None:
        return tabulated, "montecarlo", tissue
    used_model: ModelName = profile_model or "layered"
    transmitted = 1.0 if tissue.rgb is None else 1.0 - normal_reflectance(tissue.medium.eta)
    return (
        CumulativeProfile.from_radial_profile(_model_profile(tissue, used_model), transmitted),
        used_model,
        tissue,
    )


def _model_profile(tissue: Tissue, profile_model: ModelName) -> RadialProfile:
    if profile_model != "montecarlo":
        return tissue.profile(profile_model)
    from dermis.apps.truths.slab_mc import monte_carlo_profile

    return monte_carlo_profile(tissue.medium, tissue.rgb, _PHOTON_COUNT)
