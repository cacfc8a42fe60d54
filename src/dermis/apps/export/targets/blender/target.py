"""Export to Blender: formulas and profiles of the subsurface methods of Cycles and EEVEE.

The formulas follow the source of the kernels in the releases 4.5, 5.0 and 5.2 of Blender.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path, PurePath
from typing import ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dermis.apps.export.fitting import fit_length_scale
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, Target, get_numbers
from dermis.apps.export.targets.blender.files import VersionRange, write_scene
from dermis.base.tables import read_rows
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.media import SKIN_ETA

Floats = NDArray[np.float64]
WalkEntry = Literal["straight", "skin"]

BURLEY_CUTOFF, BURLEY_CUTOFF_CDF = 16.0, 0.9963790093708328
"""Radius at which Cycles truncates Burley's profile, in units of the profile's width d, and the fraction of
light within this radius [-]."""
MIN_ALBEDO, MAX_ALBEDO = 0.2, 0.999999
"""Range of single-scattering albedos in random walks. For a smaller albedo, Cycles scales the result of a
walk with `MIN_ALBEDO`."""
_DIPOLE_BISECTION_STEPS = 12
_MIN_BASE_COLOUR, _MAX_BASE_COLOUR = 1e-4, 0.995  # range in which Cycles inverts the dipole
Cdf = Callable[[Floats], Floats]
_RADIUS_NAME, _SCALE_NAME = "Subsurface Radius", "Subsurface Scale"
_METRES_PER_MM = 1e-3
_4_PI = 4.0 * np.pi
JENSEN_DMFP_MM = 3.67, 1.37, 0.68
"""Diffuse mean free paths of skin1 in [Jensen2001], widely used as the radii of skin [mm]."""
_FIRST_SUPPORTED_VERSION = 4, 5
_FIRST_MFP_RADIUS_VERSION = 5, 2  # first version in which the radius of a random walk is a mean free path
_EFFECTIVELY_INFINITE_RADIUS = 1e9


def burley_cdf(radius: ArrayLike) -> Floats:
    """Return the fraction of light within given radii, for Burley's profile as Cycles truncates it [-].

    radius : radii in units of the profile's width d

    Source: [ChristensenBurley2015].
    """
    r = np.minimum(np.asarray(radius, np.float64), BURLEY_CUTOFF)
    return np.asarray((1.0 - 0.25 * np.exp(-r) - 0.75 * np.exp(-r / 3.0)) / BURLEY_CUTOFF_CDF)


def burley_shape_factor(base_colour: ArrayLike) -> Floats:
    """Return Burley's factor s(A) (3,), by which EEVEE divides the subsurface radius to get the width [-].

    base_colour : (3,) base colour; A is the colour divided by its brightest channel

    Source: [ChristensenBurley2015].
    """
    A = np.asarray(base_colour, np.float64)
    A = A / max(float(A.max()), 1e-5)
    return np.asarray(1.9 - A + 3.5 * (A - 0.8) ** 2)


def legacy_albedo(base_colour: ArrayLike) -> Floats:
    """Return the single-scattering albedo for a base colour by the formula of Cycles before 5.2 [-]."""
    A = np.asarray(base_colour, np.float64)
    blend = A**0.25
    dim = 1.8260523782 * np.arctan(5.112467903288 * A) ** 1.09686102424
    bright = 0.496310210422 * np.arctan(4.2350090365 * A) ** 2.40602999408
    return np.asarray(np.clip((1.0 - blend) * dim + blend * bright, 0.0, MAX_ALBEDO))


def hulst_albedo(base_colour: ArrayLike) -> Floats:
    """Return the single-scattering albedo for a base colour by van de Hulst's formula, as in Cycles 5.2."""
    C = np.asarray(base_colour, np.float64)
    s = 4.20863 * C - np.sqrt(9.59217 + 41.6808 * C + 17.7126 * C**2) + 4.09712
    return np.asarray(np.clip(1.0 - s**2, 0.0, MAX_ALBEDO))


def skin_mfp_per_radius(base_colour: ArrayLike, eta: float) -> Floats:
    """Return the ratio of mean free path to subsurface radius in Cycles' method RANDOM_WALK_SKIN [-].

    Cycles interprets the radius as a diffuse mean free path. From the base colour, Cycles derives the
    single-scattering albedo at which the diffuse reflectance of a dipole equals this colour.

    base_colour : base colour [-]
    eta : value of Subsurface IOR

    Source: [Jensen2001].
    """
    inverse = 1.0 / eta
    internal_reflectance = inverse * (0.710 - 1.440 * inverse) + 0.668 + 0.0636 * eta
    A = (1.0 + internal_reflectance) / (1.0 - internal_reflectance)
    colours = np.asarray(base_colour, np.float64)
    low, high = np.zeros_like(colours), np.ones_like(colours)
    for _ in range(_DIPOLE_BISECTION_STEPS):
        middle = 0.5 * (low + high)
        too_dark = _dipole_reflectance(middle, A) < colours
        low, high = np.where(too_dark, middle, low), np.where(too_dark, high, middle)
    albedo = np.where(
        colours < _MIN_BASE_COLOUR, 0.0, np.where(colours >= _MAX_BASE_COLOUR, MAX_ALBEDO, middle)
    )
    return np.asarray(np.sqrt(3.0 * (1.0 - albedo)))


def _dipole_reflectance(albedo: Floats, internal_reflection_factor: float) -> Floats:
    root = np.sqrt(3.0 * (1.0 - albedo))
    return np.asarray(
        0.5 * albedo * (1.0 + np.exp(-4.0 / 3.0 * internal_reflection_factor * root)) * np.exp(-root)
    )


def random_walk_cdf(radius: ArrayLike, albedo: float, walk_entry: WalkEntry) -> Floats:
    """Return the fraction of the incident light that Cycles' random walk returns within given radii [-].

    radius : radii [mean free paths]
    albedo : single-scattering albedo [-]
    walk_entry : distribution of the directions in which walks enter the medium: "straight" (along the
        normal, as in RANDOM_WALK), or "skin" (diffuse or refracted at a rough surface, as in
        RANDOM_WALK_SKIN)
    """
    walk_albedo = max(albedo, MIN_ALBEDO)
    radii, fraction_within = _interpolate_random_walk_table(round(walk_albedo, 7), walk_entry)
    r = np.asarray(radius, np.float64)
    fraction = np.interp(np.log(np.maximum(r, 1e-12)), np.log(radii), fraction_within)
    near = np.minimum(r / radii[0], 1.0)  # linear in the radius below the first tabulated one
    return np.asarray(albedo / walk_albedo * fraction * near)


@cache
def _interpolate_random_walk_table(albedo: float, walk_entry: WalkEntry) -> tuple[Floats, Floats]:
    """Return radii [mean free paths] and the fraction of light within each radius [-], for one albedo.

    The table has an eighth of the returned number of radii; values at the other radii are interpolated.
    """
    from scipy.interpolate import PchipInterpolator

    roots, radii, fraction_within = _load_random_walk_tables()[walk_entry]
    fraction = PchipInterpolator(roots, fraction_within, axis=0)(
        np.clip(np.sqrt(1.0 - albedo), roots[0], roots[-1])
    )
    fine = np.geomspace(radii[0], radii[-1], 8 * len(radii))
    return fine, np.asarray(PchipInterpolator(np.log(radii), fraction)(np.log(fine)))


@cache
def _load_random_walk_tables() -> dict[WalkEntry, tuple[Floats, Floats, Floats]]:
    """Return tabulated results of Cycles' random walks for each value of `WalkEntry`.

    The results are three arrays: values of sqrt(1 - albedo) (n,) [-], radii (m,) [mean free paths], and
    the fraction of light (n, m) that leaves the medium within each radius [-].
    """
    by_entry: dict[str, list[list[float]]] = {}
    for row in read_rows(__package__, "cycles_walk"):
        numbers = [float(row[name]) for name in ("root", "radius", "within")]
        by_entry.setdefault(row["entry"], []).append(numbers)
    table = {}
    for entry, rows in by_entry.items():
        columns = np.array(rows)
        roots, radii = np.unique(columns[:, 0]), np.unique(columns[:, 1])
        table[entry] = roots, radii, columns[:, 2].reshape(len(roots), len(radii))
    return table  # type: ignore[return-value]  # the keys are values of `WalkEntry`


class RandomWalk(NamedTuple):
    """Random walk of Cycles for one channel of a base colour.

    albedo : single-scattering albedo [-]
    entry : distribution of the directions in which walks enter the medium, see `random_walk_cdf`
    """

    albedo: float
    entry: WalkEntry

    def cdf(self, radius: Floats) -> Floats:
        """Return the fraction of the emerging light within given radii [-].

        radius : radii [mean free paths]
        """
        return random_walk_cdf(radius, self.albedo, self.entry) / self.emerging_fraction

    @property
    def emerging_fraction(self) -> float:
        """Return the reflectance that the random walk gives for skin seen along its normal [-]."""
        return float(random_walk_cdf(np.array([_EFFECTIVELY_INFINITE_RADIUS]), self.albedo, self.entry)[0])


class Blender(Target):
    """Export to the Principled BSDF of Blender, with a subsurface method of Cycles or EEVEE."""

    name = "blender"
    title = "Blender"
    suffixes = ("", ".py", ".blend")
    versions = ("4.5", "5.0", "5.1", "5.2")
    variants = ("random-walk-skin", "random-walk", "burley", "eevee")
    needs_maps = True
    file_meanings: ClassVar[Mapping[str, str]] = {
        "*.py": "script that builds the scene",
        "*.glb": "all parts of the head except scalp hair, which the script imports",
        "*.npz": "scalp hair, from which the script makes hair curves",
        "*.npy": "panorama of the environment, which the script reads",
        "*.blend": "scene with all pictures",
    }
    limitations = (
        "Random walks return less light than the base colour along the normal, and more at grazing angles;"
        " Burley's profile ignores thin parts. All methods use one layer, so the red of layered skin is lost."
        " EEVEE was not tested."
    )
    part_limitations = ""

    def steps(self, subject: Subject, files: Sequence[PurePath]) -> tuple[str, ...]:
        """Return the steps for a script or a .blend file, and how to move the head, if it has a rig."""
        name, head = shlex.quote(files[0].name), subject.head_or_ball
        command = f"blender {'' if files[0].suffix == '.blend' else '--python '}{name}"
        first = f"Open the scene: `{command}`."
        if files[0].suffix != ".blend":
            first = f"Keep the files together, and run `{command}`, or run the script in the text editor."
        moves = ["expressions with the shape keys of the meshes"] if head.targets else []
        moves += ["poses with the bones"] if head.bones else []
        third = f"Set {', and '.join(moves)}." if moves else "Render the picture (F12)."
        return first, "Choose the camera view (numpad 0) and rendered shading.", third

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return parameters with the subsurface radius whose profile is closest to the reference profile."""
        units = self._unit_cdf_by_channel(subject, version)
        fitted = np.array([fit_length_scale(subject.curve, k, unit) for k, unit in enumerate(units)])
        radius = fitted / self._lengths_per_unit_radius(subject, version)
        return self._material_parameters(tuple(round(float(x), 5) for x in radius), version)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of a user who enters published diffuse mean free paths as the radius."""
        return self._material_parameters(JENSEN_DMFP_MM, version)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile that is predicted by the formulas of Cycles or EEVEE."""
        metres = np.array(get_numbers(parameters, _RADIUS_NAME)) * get_numbers(parameters, _SCALE_NAME)[0]
        lengths = np.maximum(metres / _METRES_PER_MM * self._lengths_per_unit_radius(subject, version), 1e-9)
        units = self._unit_cdf_by_channel(subject, version)

        def fraction_within(radius_mm: Floats) -> Floats:
            return np.stack(
                [unit(radius_mm / length) for unit, length in zip(units, lengths, strict=True)], axis=-1
            )

        energy = subject.curve.energy * self._energy_per_base_colour(subject, version)
        return CumulativeProfile.from_function(fraction_within, energy)

    def write(self, subject: Subject, parameters: Parameters, output: Path, version: str) -> list[Path]:
        """Write the Python script with the files that it reads, or run the script to write a .blend file.

        Raises DermisError for a .blend file if DERMIS_BLENDER_PYTHON is not the path of a Python interpreter
        with the module bpy.
        """
        method = self.variant.replace("-", "_").upper()
        return write_scene(subject, parameters, output, method, self._valid_versions(version))

    def _valid_versions(self, version: str) -> VersionRange:
        """Return the range of versions for which the parameters are valid, see `VersionRange`."""
        if self.variant != "random-walk":
            return list(_FIRST_SUPPORTED_VERSION), None
        return (
            (list(_FIRST_MFP_RADIUS_VERSION), None)
            if _radius_is_mfp(version)
            else (list(_FIRST_SUPPORTED_VERSION), list(_FIRST_MFP_RADIUS_VERSION))
        )

    def _material_parameters(self, subsurface_radius: tuple[float, ...], version: str) -> Parameters:
        method = self.variant.replace("-", "_").upper()
        parameters = [
            Parameter("Subsurface Method", method, "-", "of the Principled BSDF"),
            Parameter("Subsurface Weight", 1.0, "-", "fraction of the diffuse light that is scattered"),
            Parameter(
                _RADIUS_NAME, subsurface_radius, "mm, times the scale", self._radius_description(version)
            ),
            Parameter(_SCALE_NAME, _METRES_PER_MM, "m", "metres per millimetre"),
            Parameter("IOR", SKIN_ETA, "-", "of the surface, for reflection and the start of random walks"),
        ]
        if self.variant.startswith("random"):
            parameters.append(Parameter("Subsurface Anisotropy", 0.0, "-", "mean cosine of scattering"))
        if self.variant == "random-walk-skin":
            parameters.append(Parameter("Subsurface IOR", SKIN_ETA, "-", "determines the mean free path"))
        return tuple(parameters)

    def _radius_description(self, version: str) -> str:
        walk = "the mean free path" if _radius_is_mfp(version) else "4 pi mean free paths"
        return {
            "random-walk": walk,
            "random-walk-skin": "the diffuse mean free path",
            "burley": "4 pi d, independent of the colour",
            "eevee": "4 pi d s(A), where A is the colour divided by its brightest channel",
        }[self.variant]

    def _lengths_per_unit_radius(self, subject: Subject, version: str) -> Floats:
        """Return the Burley width or mean free path (3,) that results from a subsurface radius of 1."""
        if self.variant == "random-walk":
            return np.full(3, 1.0 if _radius_is_mfp(version) else 1.0 / _4_PI)
        if self.variant == "random-walk-skin":
            return skin_mfp_per_radius(subject.clipped_albedo(), SKIN_ETA)
        factor = burley_shape_factor(subject.clipped_albedo()) if self.variant == "eevee" else 1.0
        return np.full(3, 1.0 / _4_PI) / factor

    def _random_walks(self, subject: Subject, version: str) -> list[RandomWalk]:
        plain = self.variant == "random-walk"
        albedo = hulst_albedo if plain and _radius_is_mfp(version) else legacy_albedo
        albedos = albedo(subject.clipped_albedo())
        return [RandomWalk(float(one), "straight" if plain else "skin") for one in albedos]

    def _unit_cdf_by_channel(self, subject: Subject, version: str) -> list[Cdf]:
        """Return each channel's cumulative profile as a function of the radius.

        The unit of the radius is the width of the Burley profile in the variants "burley" and "eevee", and
        the mean free path in the variants with random walks.
        """
        if self.variant in ("burley", "eevee"):
            return [burley_cdf] * 3
        return [walk.cdf for walk in self._random_walks(subject, version)]

    def _energy_per_base_colour(self, subject: Subject, version: str) -> Floats:
        """Return the reflectance (3,) of the skin, as seen along its normal, relative to the base colour."""
        if self.variant in ("burley", "eevee"):
            return np.ones(3)
        total = np.array([walk.emerging_fraction for walk in self._random_walks(subject, version)])
        return total / np.maximum(subject.albedo, 1e-6)


def _radius_is_mfp(version: str) -> bool:
    """Return whether a version of Blender interprets the radius of a random walk as a mean free path."""
    return tuple(map(int, version.split("."))) >= _FIRST_MFP_RADIUS_VERSION


TARGET = Blender()
