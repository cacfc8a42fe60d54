"""Tissue by name: media in three channels, and skins of pigments by wavelength."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import DermisError, refuse, shown_value
from dermis.base.reading import named_path, read_toml
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.models import Model, diffusion_profile, diffusion_rings, through_slab
from dermis.optics.diffusion.multipole import Clamp
from dermis.optics.fits.targets import Rings
from dermis.optics.half_space import ALBEDOS, COUNTED, is_counted, tabulated_profile
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium, media, medium_from_toml
from dermis.optics.pigments.parameters import DEFAULT_STRUCTURE, SKINS, SkinParameters, Structure
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.radial import RadialProfile

ProfileModel = Model | Literal["counted"]
"""A diffusion model, or photons counted beforehand for half-spaces of one medium."""


@dataclass(frozen=True)
class Tissue:
    """A medium, and how its channels become red, green and blue.

    medium : layers with three channels, or with one for each wavelength
    rgb : (3, c) weights of the wavelengths, None when the channels are colours already [-]
    parameters : of the skin, when it is made of pigments
    """

    medium: Medium
    rgb: Floats | None = None
    parameters: SkinParameters | None = None

    def __repr__(self) -> str:
        """What it is, its layers and its coefficients, on three lines."""
        layers = self.medium.layers
        a = np.array([layer.sigma_a for layer in layers])
        s = np.array([layer.sigma_s_prime for layer in layers])
        kind = "red, green, blue" if self.rgb is None else f"{a.shape[1]} wavelengths"
        thick = ", ".join(
            f"{layer.name} {layer.thickness_mm:.3g} mm"
            if np.isfinite(layer.thickness_mm)
            else f"{layer.name} (semi-infinite)"
            for layer in layers
        )
        both = {"mu_a": a, "mu_s'": s}
        ranges = (f"{name} {one.min():.3g} to {one.max():.3g} /mm" for name, one in both.items())
        first = f"Tissue {self.medium.name}: {kind}, index of refraction {self.medium.eta:g}"
        return "\n".join([first, f"  {thick}", f"  {', '.join(ranges)}"])

    def spectrum(self, model: Model = "layered", clamp: Clamp = "layer") -> Floats | None:
        """Total diffuse reflectance R at `WAVELENGTHS_NM`, (31,), per incident light [-].

        None for a medium that has colours, not wavelengths. What the surface mirrors is not in it.
        """
        if self.rgb is None:
            return None
        entering = 1.0 - normal_reflectance(self.medium.eta)
        return np.asarray(entering * diffusion_profile(self.medium, model, clamp).total)

    def with_layers(self, layers: Sequence[Layer]) -> Tissue:
        """A medium of other layers under the same surface.

        Raises DermisError for a skin of pigments, and for layers that no medium can have.
        """
        if self.rgb is not None:
            came = f"{self.medium.name} is a skin made of pigments"
            refuse("layers", "a medium with a name (skin1, dj3 ...) or of a file", came, "Leave them out")
        return replace(self, medium=replace(self.medium, layers=tuple(layers)))

    @property
    def usual_model(self) -> ProfileModel:
        """Of its profile: counted photons for a half-space of one medium that they were counted for."""
        return COUNTED if self.rgb is None and is_counted(self.medium) else "layered"

    def profile(self, model: ProfileModel | None = None, clamp: Clamp = "layer") -> RadialProfile:
        """R(r) in linear Rec. 709: per power that enters, or per incident power for wavelengths.

        model : by default `usual_model`

        Raises DermisError when the model cannot take the medium.
        """
        used = model or self.usual_model
        if used != COUNTED:
            return diffusion_profile(self.medium, used, clamp, self.rgb)
        found = tabulated_profile(self.medium) if self.rgb is None else None
        if found is None:
            least, most = ALBEDOS
            expected = f"one layer without end of index 1 or {SKIN_ETA} and reduced albedo {least} to {most}"
            refuse(f"model {COUNTED}", expected, f"{self.medium.name} is none", "Take the model layered")
        return found

    def rings(self) -> Rings:
        """Those of `profile`, of diffusion without the rest of it."""
        used = self.usual_model
        return self.profile().rings() if used == COUNTED else diffusion_rings(self.medium, used, rgb=self.rgb)

    def through(self, thickness_mm: ArrayLike) -> Floats:
        """Light that comes through the tissue cut at each thickness, (n, 3), per the same power [-]."""
        slab = through_slab(self.medium, thickness_mm)
        if self.rgb is None:
            return slab
        return (1.0 - normal_reflectance(self.medium.eta)) * slab @ self.rgb.T


def names() -> tuple[str, ...]:
    """Names that `load_tissue` knows without a file."""
    return (*media(), *SKINS)


def load_tissue(
    name: str | Path, structure: Structure | None = None, pigments: Mapping[str, Any] | None = None
) -> Tissue:
    """The tissue of a name or of a TOML file with layers or with a table [skin].

    structure : layers of a skin of pigments; by default the file's own, or else "dj2006"
    pigments : fields of `SkinParameters` that replace those of the name

    Raises DermisError for any other name, and when pigments are given to a medium that has none.
    """
    named_path(name, "a tissue")
    given = _known(pigments or {})
    if str(name) in SKINS:
        return _spectral(str(name), structure or DEFAULT_STRUCTURE, SKINS[str(name)], given)
    if str(name) not in media() and Path(name).suffix.lower() != ".toml":
        known = ", ".join(names())
        refuse(f"tissue {name}", f"one of {known}, or a .toml file", "it is none of these", "Check the name")
    document = {} if str(name) in media() else read_toml(Path(name))
    if "skin" in document:
        return _from_skin_table(Path(name), document, structure, given)
    if given:
        option = "--" + next(iter(given)).replace("_", "-")
        skins = ", ".join(SKINS)
        refuse(option, f"a skin made of pigments ({skins})", f"{name} came", "Leave it out, or take a skin")
    medium = media()[str(name)] if str(name) in media() else medium_from_toml(Path(name), document)
    return Tissue(medium)


def _known(pigments: Mapping[str, Any]) -> dict[str, Any]:
    """Pigments by names that a skin has."""
    names = SkinParameters.__dataclass_fields__
    if not isinstance(pigments, Mapping) or not pigments.keys() <= names.keys():
        refuse("pigments", f"some of {', '.join(names)}", f"{shown_value(pigments)} came", "Correct them")
    return dict(pigments)


def _spectral(name: str, structure: Structure, example: SkinParameters, given: dict[str, Any]) -> Tissue:
    parameters = replace(example, **given)
    medium = replace(spectral_medium(structure, parameters), name=name)
    return Tissue(medium, rgb_weights(WAVELENGTHS_NM), parameters)


def _from_skin_table(
    path: Path, document: Mapping[str, Any], wanted: Structure | None, given: dict[str, Any]
) -> Tissue:
    table = document["skin"]
    fields = set(SkinParameters.__dataclass_fields__)
    if not isinstance(table, dict) or set(document) - {"skin", "name"}:
        refuse(path, "a table [skin] and a name only", "it holds something else", "Take the rest out")
    own = dict(table)
    structure = own.pop("structure", DEFAULT_STRUCTURE)
    unknown = sorted(set(own) - fields)
    if unknown:
        known = ", ".join(sorted({"structure", *fields}))
        refuse(path, f"in [skin]: {known}", f"{', '.join(unknown)} came", "Correct the names")
    if structure not in get_args(Structure):
        expected = f"a structure of {', '.join(get_args(Structure))}"
        refuse(path, expected, f"{shown_value(structure)} came", "Correct it")
    try:
        parameters = SkinParameters(**own)
    except DermisError as fault:
        raise DermisError(f"{path}: {fault}") from None
    return _spectral(str(document.get("name", path.stem)), wanted or structure, parameters, given)
