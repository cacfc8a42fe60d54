"""What is exported: a skin by itself, or a head with its skin."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dermis.apps.export.truth import ModelName, true_curve
from dermis.base.reading import named_path
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.mesh.samples import SAMPLES
from dermis.optics.curve import Curve
from dermis.optics.media import Floats
from dermis.optics.tissue import Tissue
from dermis.scene.heads import is_person, load_head, person_of
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.skin import Skin

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
