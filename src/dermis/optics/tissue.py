"""Tissues from presets and files: media given in red, green and blue, and skins defined by their pigments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import DermisError, format_value, refuse
from dermis.base.reading import checked_path, read_toml
from dermis.base.renamed import renamed_attribute
from dermis.optics.bands import Bands
from dermis.optics.diffusion.boundary import normal_reflectance
from dermis.optics.diffusion.models import (
    DiffusionModel,
    diffusion_profile,
    diffusion_rings,
    slab_transmittance,
)
from dermis.optics.diffusion.multipole import SourceDepthClamp
from dermis.optics.fits.targets import RingTarget
from dermis.optics.half_space import (
    PHOTON_TABLE_MODEL,
    TABULATED_ALBEDO_RANGE,
    has_photon_table,
    tabulated_profile,
)
from dermis.optics.media import SKIN_ETA, Floats, Layer, Medium, medium_from_toml, published_media
from dermis.optics.pigments.parameters import DEFAULT_STRUCTURE, SKINS, SkinParameters, Structure
from dermis.optics.pigments.skin import spectral_medium
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.radial import RadialProfile
from dermis.optics.reduced_scattering import MCML_SUFFIXES, refuse_mcml

ProfileModel = DiffusionModel | Literal["counted"]
"""Diffusion model, or "counted": tabulated Monte Carlo results for half-spaces of one medium."""


@dataclass(frozen=True)
class Tissue:
    """Medium with the conversion of its channels to red, green and blue.

    Parameters
    ----------
    medium : Medium
        Layers with three channels, or with one channel for each wavelength.
    rgb : numpy.ndarray, optional
        (3, c) weights that convert wavelengths to red, green and blue [-]; None if the channels are colours.
    parameters : SkinParameters, optional
        Parameters of a skin that is defined by its pigments; None for other media.
    structure : {"dj2006", "donner2008", "biospec"}, optional
        Layer structure of a skin that is defined by its pigments.

    Examples
    --------
    >>> from dermis import load_tissue
    >>> tissue = load_tissue("skin1")
    >>> tissue.medium.channels, tissue.default_profile_model
    (3, 'counted')
    """

    medium: Medium
    rgb: Floats | None = None
    parameters: SkinParameters | None = None
    structure: Structure = DEFAULT_STRUCTURE
    default_model = renamed_attribute("default_model", "default_profile_model")
    rings = renamed_attribute("rings", "ring_target")

    def __repr__(self) -> str:
        """Return a text of three lines with the name, the layers and the ranges of the coefficients."""
        layers = self.medium.layers
        a = np.array([layer.sigma_a for layer in layers])
        s = np.array([layer.sigma_s_prime for layer in layers])
        kind = "red, green, blue" if self.rgb is None else f"{a.shape[1]} wavelengths"
        thicknesses = ", ".join(
            f"{layer.name} {layer.thickness_mm:.3g} mm"
            if np.isfinite(layer.thickness_mm)
            else f"{layer.name} (semi-infinite)"
            for layer in layers
        )
        coefficients = {"mu_a": a, "mu_s'": s}
        ranges = (f"{name} {v.min():.3g} to {v.max():.3g} /mm" for name, v in coefficients.items())
        heading = f"Tissue {self.medium.name}: {kind}, index of refraction {self.medium.eta:g}"
        return "\n".join([heading, f"  {thicknesses}", f"  {', '.join(ranges)}"])

    def spectrum(self, model: DiffusionModel = "layered", clamp: SourceDepthClamp = "layer") -> Floats | None:
        """Return the total diffuse reflectance (31,) at `WAVELENGTHS_NM` [-].

        It is relative to the incident light and excludes surface reflection. The result is None for a medium
        whose channels are colours.

        model, clamp : diffusion model and an option of the multipole, see `diffusion_profile`
        """
        if self.rgb is None:
            return None
        entering = 1.0 - normal_reflectance(self.medium.eta)
        return np.asarray(entering * diffusion_profile(self.medium, model, clamp).total)

    def in_bands(self, bands: Bands) -> Tissue:
        """Return a skin that is defined by its pigments, with three wavelengths as red, green and blue."""
        assert self.parameters is not None
        medium = spectral_medium(self.structure, self.parameters, np.array(bands.wavelengths_nm))
        return replace(self, medium=replace(medium, name=self.medium.name), rgb=np.eye(3))

    def with_layers(self, layers: Sequence[Layer]) -> Tissue:
        """Return a tissue with other layers but the same name and index of refraction.

        Raises DermisError for a skin that is defined by its pigments, and for invalid layers.
        """
        if self.rgb is not None:
            actual = f"{self.medium.name} is a skin made of pigments"
            refuse("layers", "a named medium (skin1, dj3 ...) or one from a file", actual, "Leave them out")
        return replace(self, medium=replace(self.medium, layers=tuple(layers)))

    @property
    def default_profile_model(self) -> ProfileModel:
        """Return the default profile model: "counted" or "layered".

        "counted" uses tables of Monte Carlo results. It is the default for media whose channels are colours
        and which the tables cover, see `half_space.has_photon_table`.
        """
        return PHOTON_TABLE_MODEL if self.rgb is None and has_photon_table(self.medium) else "layered"

    def profile(self, model: ProfileModel | None = None, clamp: SourceDepthClamp = "layer") -> RadialProfile:
        """Return the diffusion profile R(r) of the tissue in linear Rec. 709.

        R(r) is relative to the incident power for a skin that is defined by its pigments, and relative to the
        power that enters for other media.

        model : model that computes the profile; by default `default_profile_model`
        clamp : whether the multipole's source stays inside thin layers ("layer") or not ("none"), see `Slab`

        Raises DermisError when the model is not valid for the medium.
        """
        model = model or self.default_profile_model
        if model != PHOTON_TABLE_MODEL:
            return diffusion_profile(self.medium, model, clamp, self.rgb)
        profile = tabulated_profile(self.medium) if self.rgb is None else None
        if profile is None:
            low, high = TABULATED_ALBEDO_RANGE
            expected = f"one semi-infinite layer of index 1 or {SKIN_ETA} and reduced albedo {low} to {high}"
            refuse(
                f"model {PHOTON_TABLE_MODEL}", expected, f"got {self.medium.name}", "Use the model layered"
            )
        return profile

    def ring_target(self) -> RingTarget:
        """Return the light through concentric rings by the default model, as the target of a fit."""
        model = self.default_profile_model
        if model == PHOTON_TABLE_MODEL:
            return self.profile().ring_target()
        return diffusion_rings(self.medium, model, rgb_weights=self.rgb)

    def transmittance(self, thickness_mm: ArrayLike) -> Floats:
        """Return the transmittance (n, 3) of slabs of the tissue [-].

        The transmittance is relative to the incident power for a skin that is defined by its pigments, and
        relative to the power that enters for other media.

        thickness_mm : (n,) thicknesses of the slabs [mm]
        """
        slab = slab_transmittance(self.medium, thickness_mm)
        if self.rgb is None:
            return slab
        return (1.0 - normal_reflectance(self.medium.eta)) * slab @ self.rgb.T


def tissue_names() -> tuple[str, ...]:
    """Return the names of the presets that `load_tissue` accepts."""
    return (*published_media(), *SKINS)


def load_tissue(
    name: str | Path, structure: Structure | None = None, pigments: Mapping[str, Any] | None = None
) -> Tissue:
    """Return the tissue of a preset, or of a TOML file with layers or with a table [skin].

    Parameters
    ----------
    name : str or Path
        Preset ("skin1", "dj3", "spectral" ...), or a .toml file.
    structure : {"dj2006", "donner2008", "biospec"}, optional
        Layer structure of a skin defined by pigments; by default the structure that the file states, or else
        "dj2006".
    pigments : Mapping of str to float, optional
        For a skin that is defined by its pigments, values that replace fields of its `SkinParameters`.

    Returns
    -------
    Tissue
        Medium and the conversion of its channels to colours.

    Raises
    ------
    DermisError
        There is no such preset or file, or `pigments` is passed for a medium without pigments.

    References
    ----------
    [Jensen2001], [DonnerJensen2005], [DonnerJensen2006].

    Examples
    --------
    >>> from dermis import load_tissue
    >>> skin = load_tissue("spectral", pigments={"melanin": 0.1})
    >>> skin.parameters.melanin, skin.spectrum().shape
    (0.1, (31,))
    """
    if checked_path(name, "a tissue").suffix.lower() in MCML_SUFFIXES:
        refuse_mcml(Path(name))
    overrides = _checked_pigments(pigments or {})
    if str(name) in SKINS:
        return _spectral_tissue(str(name), structure or DEFAULT_STRUCTURE, SKINS[str(name)], overrides)
    if str(name) not in published_media() and Path(name).suffix.lower() != ".toml":
        known = ", ".join(tissue_names())
        refuse(f"tissue {name}", f"one of {known}, or a .toml file", "it is none of these", "Check the name")
    document = {} if str(name) in published_media() else read_toml(Path(name))
    if "skin" in document:
        return _tissue_from_skin_table(Path(name), document, structure, overrides)
    if overrides:
        option = "--" + next(iter(overrides)).replace("_", "-")
        skins = ", ".join(SKINS)
        refuse(option, f"a skin made of pigments ({skins})", f"got {name}", "Leave it out, or use a skin")
    medium = (
        published_media()[str(name)]
        if str(name) in published_media()
        else medium_from_toml(Path(name), document)
    )
    return Tissue(medium)


def _checked_pigments(pigments: Mapping[str, Any]) -> dict[str, Any]:
    """Check the names of pigment parameters, and return the parameters as a dictionary.

    Raises DermisError unless all keys are fields of `SkinParameters`.
    """
    names = SkinParameters.__dataclass_fields__
    if not isinstance(pigments, Mapping) or not pigments.keys() <= names.keys():
        refuse("pigments", f"some of {', '.join(names)}", f"got {format_value(pigments)}", "Correct them")
    return dict(pigments)


def _spectral_tissue(
    name: str, structure: Structure, default_parameters: SkinParameters, pigment_overrides: dict[str, Any]
) -> Tissue:
    parameters = replace(default_parameters, **pigment_overrides)
    medium = replace(spectral_medium(structure, parameters), name=name)
    return Tissue(medium, rgb_weights(WAVELENGTHS_NM), parameters, structure)


def _tissue_from_skin_table(
    path: Path, document: Mapping[str, Any], structure: Structure | None, pigment_overrides: dict[str, Any]
) -> Tissue:
    table = document["skin"]
    fields = set(SkinParameters.__dataclass_fields__)
    if not isinstance(table, dict) or set(document) - {"skin", "name"}:
        refuse(path, "only a table [skin] and a name", "it has other entries", "Remove them")
    values = dict(table)
    table_structure = values.pop("structure", DEFAULT_STRUCTURE)
    unknown = sorted(set(values) - fields)
    if unknown:
        known = ", ".join(sorted({"structure", *fields}))
        refuse(path, f"in [skin]: {known}", f"got {', '.join(unknown)}", "Correct the names")
    if table_structure not in get_args(Structure):
        expected = f"a structure of {', '.join(get_args(Structure))}"
        refuse(path, expected, f"got {format_value(table_structure)}", "Correct it")
    try:
        parameters = SkinParameters(**values)
    except DermisError as fault:
        raise DermisError(f"{path}: {fault}") from None
    name, structure = str(document.get("name", path.stem)), structure or table_structure
    return _spectral_tissue(name, structure, parameters, pigment_overrides)
