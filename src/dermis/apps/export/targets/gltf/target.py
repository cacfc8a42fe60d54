"""Export to glTF: a .glb file whose skin uses core glTF, or extensions for scattering or transmission."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import ClassVar

import numpy as np

from dermis.apps.export.fitting import fit_burley_width
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import (
    Parameter,
    Parameters,
    ParameterValue,
    Target,
    flat_tuple,
    get_numbers,
    replace_values,
)
from dermis.apps.export.targets.gltf.file import encode_glb
from dermis.apps.export.targets.gltf.volume import Volume, fit_volume, volume_profile
from dermis.formats.gltf.write import skin_part_names
from dermis.human.regions.average import is_human
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.media import SKIN_ETA, Floats

CORE_VARIANT, SCATTER_VARIANT, TRANSMISSION_VARIANT = "core", "scatter", "diffuse-transmission"
DRAFT_NOTICE = (
    "KHR_materials_scatter: draft of 2026-06-22 (KhronosGroup/glTF pull request 2579), not ratified"
)
_ATTENUATION_DISTANCE_NAME = "KHR_materials_volume.attenuationDistance"
_ATTENUATION_COLOUR_NAME = "KHR_materials_volume.attenuationColor"
_MULTISCATTER_NAME = "KHR_materials_scatter.multiscatterColorFactor"
_TRANSMISSION_FACTOR_NAME = "KHR_materials_diffuse_transmission.diffuseTransmissionFactor"
_TRANSMISSION_COLOUR_NAME = "KHR_materials_diffuse_transmission.diffuseTransmissionColorFactor"
_BASE_COLOUR_NAME = "pbrMetallicRoughness.baseColorFactor"
_DEFAULT_IOR = 1.5
_IOR_PARAMETER = Parameter("KHR_materials_ior.ior", SKIN_ETA, "-", "reflectance 0.028 at normal incidence")
_HEAD_THICKNESS_M = 0.1  # of a head; programs that trace no rays use it as path length
_EAR_THICKNESS_MM = 4.0  # thickness at which the transmitted light is computed
_NAIVE_TRANSMISSION_FACTOR = 0.5  # middle of the slider


class Gltf(Target):
    """Export to a .glb file whose skin uses core glTF, or extensions for scattering or transmission."""

    name = "gltf"
    title = "glTF"
    suffixes = (".glb",)
    versions = ("2.0",)
    variants = (CORE_VARIANT, TRANSMISSION_VARIANT, SCATTER_VARIANT)
    needs_maps = True
    import_steps = ("Open or import the .glb file: in Blender with File > Import > glTF, or in any viewer.",)
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.glb": "all parts of the head with their pictures; metres, Y up",
    }
    limitations = (
        f"The variants {CORE_VARIANT} and {TRANSMISSION_VARIANT} look like skin in all programs, but light is"
        f" not diffused: shadow edges stay sharp. The variant {SCATTER_VARIANT} uses {DRAFT_NOTICE}: ray"
        " tracers that support it show the errors of its table; programs that support only transmission and"
        " volume show dark glass; rasterisers use the multiscatter colour as base colour, which is too light."
    )
    part_limitations = ""

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return `import_steps`, and how to use morph targets and bones, if there are any."""
        head, second = subject.head_or_ball, "Keep the unit at metres."
        third = "Add lights: the file contains none."
        is_person = subject.head is not None and is_human(subject.head)
        if head.targets:
            origin = ", which have the names of ARKit" if is_person else ""
            names = " and ".join(f"`{name}`" for name in skin_part_names(head))
            second = (
                f"Set expressions with the {len(head.targets)} morph targets of the mesh {names}{origin}."
            )
        if head.bones:
            third = "Turn head, neck and eyes with the bones." if is_person else "Set poses with the bones."
        return (*self.import_steps, second, third)

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the material parameters for the variant of this target.

        In the variant "core", they are the base colour and the index of refraction. In the variant "scatter",
        they describe a scattering volume that is fitted to the skin's profile. In the variant
        "diffuse-transmission", they are the fraction and the colour of the light that skin as thick as an ear
        transmits.
        """
        if self.variant == CORE_VARIANT:
            return _core_parameters(subject)
        if self.variant == TRANSMISSION_VARIANT:
            return _diffuse_transmission_parameters(subject, *_ear_transmission(subject))
        return _scatter_parameters(fit_volume(subject.curve, subject.albedo))

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters with the skin's colour for every colour, and with guesses for other values."""
        if self.variant == CORE_VARIANT:
            return replace_values(_core_parameters(subject), {_IOR_PARAMETER.name: _DEFAULT_IOR})
        if self.variant == TRANSMISSION_VARIANT:
            return _diffuse_transmission_parameters(subject, _NAIVE_TRANSMISSION_FACTOR, subject.albedo)
        radius_m = 1e-3 * float(2.5 * fit_burley_width(subject.curve).max())
        colour = np.clip(subject.albedo, 1e-3, 1.0 - 1e-3)
        return _scatter_parameters(Volume(radius_m, colour, colour))

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of the light that the skin returns.

        In the variants "core" and "diffuse-transmission", all returned light leaves where it enters, so the
        cumulative profile is 1 at all radii above 0.
        """
        if self.variant != SCATTER_VARIANT:
            reflected = subject.curve.energy
            if self.variant == TRANSMISSION_VARIANT:
                reflected = (1.0 - get_numbers(parameters, _TRANSMISSION_FACTOR_NAME)[0]) * reflected
            return CumulativeProfile.from_function(lambda r: np.tile(r[:, None] > 0.0, 3), reflected)
        return subject.rescale_energy(volume_profile(_volume_from_parameters(parameters)))

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write a .glb file whose skin material has glTF extensions with the parameters."""
        extensions: dict[str, dict[str, ParameterValue | list[float]]] = {
            "KHR_materials_ior": {"ior": SKIN_ETA}
        }
        for one in parameters:
            extension, _, member = one.name.partition(".")
            if extension.startswith("KHR_"):
                value = list(one.value) if isinstance(one.value, tuple) else one.value
                extensions.setdefault(extension, {})[member] = value
        output.write_bytes(
            encode_glb(subject, extensions, DRAFT_NOTICE if self.variant == SCATTER_VARIANT else "")
        )
        return [output]


def _core_parameters(subject: Subject) -> Parameters:
    return (
        Parameter(
            _BASE_COLOUR_NAME,
            flat_tuple(subject.albedo),
            "-",
            "diffuse reflectance; the mean of a colour map",
        ),
        _IOR_PARAMETER,
    )


def _scatter_parameters(volume: Volume) -> Parameters:
    multiscatter = flat_tuple(volume.multiscatter)
    return (
        Parameter("KHR_materials_transmission.transmissionFactor", 1.0, "-", "all light enters the volume"),
        Parameter(
            "KHR_materials_volume.thicknessFactor", _HEAD_THICKNESS_M, "m", "above 0 enables the volume"
        ),
        Parameter(_ATTENUATION_DISTANCE_NAME, volume.distance_m, "m", "the largest mean free path"),
        Parameter(
            _ATTENUATION_COLOUR_NAME,
            flat_tuple(volume.colour),
            "-",
            "fraction of the light without an event on that path",
        ),
        Parameter("KHR_materials_scatter.scatterStrengthFactor", 1.0, "-", "factor of the colour below"),
        Parameter(_MULTISCATTER_NAME, multiscatter, "-", "by van de Hulst's formula, or a map"),
        Parameter("KHR_materials_scatter.scatterAnisotropy", 0.0, "-", "mean free paths are reduced ones"),
        _IOR_PARAMETER,
    )


def _diffuse_transmission_parameters(
    subject: Subject, transmitted_fraction: float, transmitted_colour: Floats
) -> Parameters:
    """Return the parameters of the variant "diffuse-transmission", which has no subsurface scattering.

    transmitted_fraction : fraction of the diffuse light that leaves through the unlit side [-]
    transmitted_colour : (3,) colour of the transmitted light
    """
    base_colour, ior = _core_parameters(subject)
    return (
        base_colour,
        Parameter(
            _TRANSMISSION_FACTOR_NAME,
            float(transmitted_fraction),
            "-",
            f"transmitted fraction at {_EAR_THICKNESS_MM:g} mm, as of an ear",
        ),
        Parameter(
            _TRANSMISSION_COLOUR_NAME, flat_tuple(transmitted_colour), "-", "colour of the transmitted light"
        ),
        ior,
    )


def _ear_transmission(subject: Subject) -> tuple[float, Floats]:
    """Return the fraction [-] and the colour (3,) of the light that an ear transmits to its unlit side.

    The fraction is computed for the channel with the most transmitted light. It is relative to the light that
    leaves the ear on both sides in this channel. The colour is 1 in this channel.

    Source: [ChristensenBurley2015], integrated over the plane of the unlit side.
    """
    d = fit_burley_width(subject.curve)
    transmitted = (
        0.25
        * subject.albedo
        * (np.exp(-_EAR_THICKNESS_MM / d) + 3.0 * np.exp(-_EAR_THICKNESS_MM / (3.0 * d)))
    )
    largest = float(transmitted.max())
    reflected = float(subject.albedo[int(transmitted.argmax())])
    return largest / max(largest + reflected, 1e-9), transmitted / max(largest, 1e-9)


def _volume_from_parameters(parameters: Parameters) -> Volume:
    colour, multiscatter = (
        np.array(get_numbers(parameters, name)) for name in (_ATTENUATION_COLOUR_NAME, _MULTISCATTER_NAME)
    )
    return Volume(get_numbers(parameters, _ATTENUATION_DISTANCE_NAME)[0], colour, multiscatter)


TARGET = Gltf()
