"""What is exported: a skin by itself, or a head with its skin."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from dermis.base.errors import refuse, shown_value
from dermis.base.reading import named_path
from dermis.formats.gltf.materials import skin_pictures
from dermis.formats.samples import SAMPLES
from dermis.human.head_file import relief_slopes
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.counted import counted_curve
from dermis.optics.curve import Curve
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.media import Floats
from dermis.optics.profiles import find_table
from dermis.optics.radial import RadialProfile, profile_of_table
from dermis.optics.tissue import Tissue
from dermis.scene.heads import is_person, load_head, person_of
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.skin import Skin
from dermis.scene.tissue import tissue_of

if TYPE_CHECKING:
    from dermis.human.person import Human

BALL_MM = 100.0
"""Diameter of the ball that stands for a head where there is none."""

_MESHES = ".glb", ".gltf", ".obj", ".ply"
_LONGEST_NAME = 40


@dataclass(frozen=True)
class Subject:
    """A skin to export.

    name : as it was asked for: words of a user, to be escaped wherever they are written
    curve : the true profile, and what all light together is of that which enters
    albedo : (3,) diffuse reflectance that the target's base colour should have: the mean of the head's
        colour map, or the profile's own energy without one; linear Rec. 709 [-]
    model : where the curve comes from: "montecarlo", "layered", "table" ...
    tissue : None for a table of Gaussians
    scene : the head with its skin, None for a skin by itself
    """

    name: str
    curve: Curve
    albedo: Floats
    model: str
    tissue: Tissue | None = None
    scene: Scene | None = None

    @property
    def head(self) -> Head | None:
        """The head that it is the skin of, None for a skin by itself."""
        return None if self.scene is None else self.scene.head

    @cached_property
    def shape(self) -> Head:
        """The head, or a ball of `BALL_MM` where a target needs geometry."""
        return self.head or Head("ball", uv_sphere(0.5 * BALL_MM), Maps())

    @property
    def identifier(self) -> str:
        """The name with nothing but letters, digits and underscores of ASCII in it, for names in files."""
        words = re.sub(r"[^A-Za-z0-9]+", "_", Path(self.name).stem or self.name).strip("_")[:_LONGEST_NAME]
        return f"skin_{words}" if not words or words[0].isdigit() else words

    def with_head(self, head: Head) -> Subject:
        """The same with another head, one whose maps are painted, say."""
        return self if self.scene is None else replace(self, scene=replace(self.scene, head=head))


def subject_of(
    word: str | Path, *, profile: str | Path | None = None, model: ModelName | None = None, **head: Any
) -> Subject:
    """What a word stands for.

    word : a profile by name ("skin1", "dj3", "light", "gpu-gems-3"), its file (.toml, .csv), or a head:
        "human", "human:7", a person's .json, a sample, or a file (.glb, .gltf, .obj, .ply)
    profile : skin of a head; by default a person's own pigments, or else the default skin
    model : of the profile, see `true_curve`
    head : options of `load_head`

    DermisError : there is no such thing, or an option that it has no use for
    """
    path = named_path(word, "a skin or a head")
    name = str(word)
    if not (is_person(name) or name in SAMPLES or path.suffix.lower() in _MESHES):
        return _skin(name, profile, model, head)
    made = load_head(word, **head)
    skin = _skin_of(name, profile)
    curve, used, tissue = true_curve(skin, model)
    mean = made.maps.mean_colour
    return Subject(
        path.name, curve, curve.energy if mean is None else mean, used, tissue, Scene(made, skin=skin)
    )


def _skin(name: str, profile: str | Path | None, model: ModelName | None, head: dict[str, Any]) -> Subject:
    from dermis.base.errors import refuse

    for option in ("profile",) if profile is not None else tuple(head):
        refuse(option, "a head that it is for", f"the skin {name} came", "Leave it out, or name a head")
    curve, used, tissue = true_curve(Skin(profile=name), model)
    return Subject(Path(name).name, curve, curve.energy, used, tissue)


def _skin_of(name: str, profile: str | Path | None) -> Skin:
    if profile is not None:
        return Skin(profile=str(profile))
    person: Human | None = person_of(name) if is_person(name) else None
    return Skin() if person is None else skin_of(person)


ModelName = Literal["montecarlo", "layered", "multipole", "dipole", "better-dipole"]
MODELS: tuple[ModelName, ...] = get_args(ModelName)
_PHOTONS = 1_000_000


def true_curve(skin: Skin, model: ModelName | None = None) -> tuple[Curve, str, Tissue | None]:
    """The curve of a skin's profile, the model that it is by, and its tissue.

    model : by default Monte Carlo for homogeneous media by name, which the package has tables of, layered
        diffusion for other tissue, and for a table of Gaussians the table

    DermisError : an unknown model, or one for a table of Gaussians
    """
    if model is not None and model not in MODELS:
        refuse("model", f"one of {', '.join(MODELS)}", f"{shown_value(model)} came", "Choose one of them")
    table = None if skin.has_own_tissue else find_table(skin.profile)
    if table is not None:
        if model is not None:
            refuse("model", "a tissue", f"{skin.profile} is a table of Gaussians", "Leave it out")
        return Curve.of_profile(profile_of_table(table)), "table", None
    tissue = tissue_of(skin)
    if model in (None, "montecarlo") and (counted := _counted(tissue)) is not None:
        return counted, "montecarlo", tissue
    used: ModelName = model or "layered"
    entering = 1.0 if tissue.rgb is None else 1.0 - normal_reflectance(tissue.medium.eta)
    return Curve.of_profile(_profile(tissue, used), entering), used, tissue


def _counted(tissue: Tissue) -> Curve | None:
    return counted_curve(tissue.medium) if tissue.rgb is None else None


def _profile(tissue: Tissue, model: ModelName) -> RadialProfile:
    if model != "montecarlo":
        return tissue.profile(model)
    from dermis.apps.truths.slab_mc import counted_profile

    return counted_profile(tissue.medium, tissue.rgb, _PHOTONS)


ROLES = "colour", "normal", "roughness", "specular", "height"


def painted(subject: Subject, side: int, adapter: str) -> Subject:
    """The subject with all maps of its head as arrays; it is itself where nothing has to be painted.

    side : of maps that are painted, a power of two from 256 to 4096 [texels]
    adapter : that paints
    """
    if subject.head is None or not subject.head.maps.painted:
        return subject
    from dermis.frame.painted import with_painted_maps
    from dermis.gpu.failures import on_device

    head = subject.head
    return subject.with_head(on_device(adapter, lambda device: with_painted_maps(device, head, side)))


def write_maps(subject: Subject, folder: Path, stem: str = "") -> dict[str, Path]:
    """The maps that a head has, as PNG, by role: colour (sRGB), normal (green up), and grey ones.

    Roughness is Beckmann's m, specular the strength of the reflection, both plain; height is from its lowest
    to its highest in 16 bits.

    stem : what their names begin with, such as "skin_"
    """
    head = subject.head
    if head is None:
        return {}
    pictures, _ = skin_pictures(head.maps, relief_slopes(head))
    written = {role: folder / f"{stem}{role}.png" for role in ROLES if role in pictures}
    for role, path in written.items():
        path.write_bytes(pictures[role])
    return written
