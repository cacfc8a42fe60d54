"""glTF: a .glb whose skin scatters light by the draft extension, or lets it through by a settled one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import fit_burley_width
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, Value, floats, get_numbers
from dermis.apps.export.targets.gltf.file import encode_glb
from dermis.apps.export.targets.gltf.volume import Volume, fit_volume, volume_curve
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.media import SKIN_ETA, Floats

SCATTER, DIFFUSE = "scatter", "diffuse-transmission"
DRAFT = "KHR_materials_scatter: draft of 2026-06-22 (KhronosGroup/glTF pull request 2579), not ratified"
_DISTANCE = "KHR_materials_volume.attenuationDistance"
_COLOUR = "KHR_materials_volume.attenuationColor"
_MULTISCATTER = "KHR_materials_scatter.multiscatterColorFactor"
_FACTOR = "KHR_materials_diffuse_transmission.diffuseTransmissionFactor"
_TRANSMISSION_COLOUR = "KHR_materials_diffuse_transmission.diffuseTransmissionColorFactor"
_BASE = "pbrMetallicRoughness.baseColorFactor"
_IOR = Parameter("KHR_materials_ior.ior", SKIN_ETA, "-", "of the surface, which reflects 0.028 straight ahead")
_THICKNESS_M = 0.1  # a ball, and about a head: programs that trace no rays take it for the way through
_EAR_MM = 4.0  # where light comes through a head
_NAIVE_FACTOR = 0.5  # share of the light that a user lets through who sees the slider


class Gltf(Target):
    """A .glb file."""

    name = "gltf"
    title = "glTF"
    suffixes = (".glb",)
    versions = ("2.0",)
    variants = (SCATTER, DIFFUSE)
    needs_maps = True
    limitations = (
        f"{DRAFT}. Programs that trace rays and know it show this table's numbers; those that know"
        " transmission and volume alone show dark glass; those that rasterise take the multiscatter colour"
        f" for the one that is seen, and show skin too light. The variant {DIFFUSE} looks like skin"
        " everywhere, but light does not spread in it: edges of shadows stay sharp."
    )

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """The volume whose walk comes nearest, or what an ear lets through."""
        if self.variant == DIFFUSE:
            return _diffuse_parameters(subject, *_transmission(subject))
        return _scatter_parameters(fit_volume(subject.curve, subject.albedo))

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """The skin's colour for every colour, and the mean radius of the light for the distance."""
        if self.variant == DIFFUSE:
            return _diffuse_parameters(subject, _NAIVE_FACTOR, subject.albedo)
        radius_m = 1e-3 * float(2.5 * fit_burley_width(subject.curve).max())
        colour = np.clip(subject.albedo, 1e-3, 1.0 - 1e-3)
        return _scatter_parameters(Volume(radius_m, colour, colour))

    def predicted_curve(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """A walk under a refracting surface; for diffuse transmission all light where it falls."""
        if self.variant == DIFFUSE:
            back = (1.0 - get_numbers(parameters, _FACTOR)[0]) * subject.curve.energy
            return CumulativeProfile.from_function(lambda r: np.repeat((r > 0.0)[:, None], 3, axis=1), back)
        return subject.rescale_energy(volume_curve(_parameter_volume(parameters)))

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """One .glb file; the skin's material has the extensions, none of which is required."""
        extensions: dict[str, dict[str, Value | list[float]]] = {"KHR_materials_ior": {"ior": SKIN_ETA}}
        for row in parameters:
            extension, _, member = row.name.partition(".")
            if extension.startswith("KHR_"):
                value = list(row.value) if isinstance(row.value, tuple) else row.value
                extensions.setdefault(extension, {})[member] = value
        output.write_bytes(encode_glb(subject, extensions, DRAFT if self.variant != DIFFUSE else ""))
        return [output]


def _scatter_parameters(volume: Volume) -> Parameters:
    strength, multiscatter = "KHR_materials_scatter.scatterStrengthFactor", floats(volume.multiscatter)
    return (
        Parameter("KHR_materials_transmission.transmissionFactor", 1.0, "-", "all light goes into the volume"),
        Parameter("KHR_materials_volume.thicknessFactor", _THICKNESS_M, "m", "above 0 for a volume"),
        Parameter(_DISTANCE, volume.distance_m, "m", "the longest mean free path"),
        Parameter(_COLOUR, floats(volume.colour), "-", "of light without an event on that way"),
        Parameter(strength, 1.0, "-", "all of the colour below"),
        Parameter(_MULTISCATTER, multiscatter, "-", "by van de Hulst, of all light; a head has a map"),
        Parameter("KHR_materials_scatter.scatterAnisotropy", 0.0, "-", "mean cosine: the paths are reduced ones"),
        _IOR,
    )


def _diffuse_parameters(subject: Subject, factor: float, colour: Floats) -> Parameters:
    return (
        Parameter(_BASE, floats(subject.albedo), "-", "diffuse reflectance; the mean where it is a map"),
        Parameter(_FACTOR, float(factor), "-", f"share that comes through: of {_EAR_MM:g} mm, as of an ear"),
        Parameter(_TRANSMISSION_COLOUR, floats(colour), "-", "colour of what comes through"),
        _IOR,
    )


def _transmission(subject: Subject) -> tuple[float, Floats]:
    """Return the share of the light that comes through an ear, over that which comes back, and its colour.

    Source: [ChristensenBurley2015], integrated over a plane at a depth.
    """
    d = fit_burley_width(subject.curve)
    through = 0.25 * subject.albedo * (np.exp(-_EAR_MM / d) + 3.0 * np.exp(-_EAR_MM / (3.0 * d)))
    most = float(through.max())
    back = float(subject.albedo[int(through.argmax())])
    return most / max(most + back, 1e-9), through / max(most, 1e-9)


def _parameter_volume(parameters: Parameters) -> Volume:
    colour, multiscatter = (np.array(get_numbers(parameters, name)) for name in (_COLOUR, _MULTISCATTER))
    return Volume(get_numbers(parameters, _DISTANCE)[0], colour, multiscatter)


TARGET = Gltf()
