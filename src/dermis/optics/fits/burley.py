"""Burley's diffusion profile of two exponentials: fits to data, and settings for Unity and Unreal Engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dermis.base.errors import refuse
from dermis.optics.fits.targets import RingTarget, ring_error
from dermis.optics.media import Floats

_MEDIAN_RADIUS_FACTOR = 1.58  # s times the radius within which half of the light leaves
_UNITY_LIGHT_FRACTION_IN_RADIUS = 0.997  # for the radius at which Unity cuts profiles off
UNREAL_SHAPE_RATIO = 0.6
_UNREAL_MIN_DISTANCE_CM = 0.1


@dataclass(frozen=True)
class BurleyProfile:
    """Diffusion profile R(r) = A s (exp(-s r) + exp(-s r / 3)) / (8 pi r).

    albedo : (c,) total reflectance A [-]
    shape : (c,) inverse scattering distance s [1/mm]

    Source: [Burley2015], [ChristensenBurley2015].
    """

    albedo: Floats
    shape: Floats

    def radiant_exitance(self, radius_mm: ArrayLike) -> Floats:
        """Return the profile R(r), (..., c), at distances r > 0 from a narrow beam of unit power [1/mm2]."""
        r = np.asarray(radius_mm, dtype=np.float64)[..., None]
        sr = self.shape * r
        return np.asarray(self.albedo * self.shape * (np.exp(-sr) + np.exp(-sr / 3.0)) / (8.0 * np.pi * r))

    def energy_within(self, radius_mm: ArrayLike) -> Floats:
        """Return the light (..., c) that emerges within given distances from a narrow beam of unit power [-].

        radius_mm : distances from the beam [mm]
        """
        sr = self.shape * np.asarray(radius_mm, dtype=np.float64)[..., None]
        return np.asarray(-self.albedo * (np.expm1(-sr) + 3.0 * np.expm1(-sr / 3.0)) / 4.0)

    def hankel(self, frequency: ArrayLike) -> Floats:
        """Return the Hankel transform (..., c) of R(r) at frequencies k [1/mm].

        The transform is the integral of 2 pi r R(r) J0(k r) over r, with the Bessel function J0.
        """
        k = np.asarray(frequency, dtype=np.float64)[..., None]
        s = self.shape
        return np.asarray(self.albedo * s / 4.0 * (1.0 / np.hypot(s, k) + 1.0 / np.hypot(s / 3.0, k)))

    def radius_at_fraction(self, light_fraction: float) -> Floats:
        """Return the radius (c,) within which a given fraction of the emerging light leaves [mm]."""
        # With t = exp(-s r / 3), the fraction outside r is (t^3 + 3 t) / 4; a hyperbolic sine solves this
        # cubic.
        t = 2.0 * np.sinh(np.arcsinh(2.0 * (1.0 - light_fraction)) / 3.0)
        return np.asarray(-3.0 * np.log(t) / self.shape)


def shape_factor(albedo: ArrayLike) -> Floats:
    """Return the ratio of the mean free path to the scattering distance of Burley's profile [-].

    The scattering distance is 1 / `BurleyProfile.shape`. The ratio depends only on the total reflectance, and
    is a fit to light from a narrow beam at normal incidence.

    albedo : total reflectance A [-]

    Source: [ChristensenBurley2015].
    """
    A = np.asarray(albedo, dtype=np.float64)
    return np.asarray(1.85 - A + 7.0 * np.abs(A - 0.8) ** 3)


def shape_factor_diffuse(albedo: ArrayLike) -> Floats:
    """Return the ratio of the diffuse mean free path to the scattering distance of Burley's profile [-].

    The diffuse mean free path is 1 / sigma_tr; the scattering distance is 1 / `BurleyProfile.shape`.

    albedo : total reflectance A [-]

    Source: [ChristensenBurley2015].
    """
    A = np.asarray(albedo, dtype=np.float64)
    return np.asarray(3.5 + 100.0 * (A - 0.33) ** 4)


@dataclass(frozen=True)
class BurleyFit:
    """Burley's profile fitted to the light through concentric rings, with the errors of the fit.

    profile : fitted profile
    error : (c,) relative root-mean-square error of the light through the rings [-]
    energy_error : (c,) relative error of the total reflectance [-]
    """

    profile: BurleyProfile
    error: Floats
    energy_error: Floats


def fit_burley(target: RingTarget) -> BurleyFit:
    """Fit Burley's profile to the light that emerges through concentric rings around a narrow beam.

    The total reflectance of each channel is that of `target`; only the shape is fitted.
    """
    shape = np.array([_fit_shape(target.channel(i)) for i in range(len(target.total))])
    profile = BurleyProfile(target.total, shape)
    return BurleyFit(
        profile=profile,
        error=ring_error(target, np.diff(profile.energy_within(target.edges_mm), axis=0)),
        energy_error=profile.albedo / target.total - 1.0,
    )


def _fit_shape(target: RingTarget) -> float:
    from scipy.optimize import minimize_scalar

    def fit_error(log_shape: float) -> float:
        profile = BurleyProfile(target.total, np.exp(np.array([log_shape])))
        return float(ring_error(target, np.diff(profile.energy_within(target.edges_mm), axis=0))[0])

    guess = float(np.log(_MEDIAN_RADIUS_FACTOR / target.mean_radius_at([0.5])[0]))
    grid = guess + np.linspace(-3.0, 3.0, 25)
    best = int(np.argmin([fit_error(x) for x in grid]))
    bracket = (grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)])
    result = minimize_scalar(fit_error, bounds=bracket, method="bounded", options={"xatol": 1e-10})
    return float(np.exp(result.x))


@dataclass(frozen=True)
class UnityParameters:
    """Diffusion profile settings of Unity's HDRP at world scale 1.

    scattering_colour : scattering distance 1 / s of each channel, divided by the largest of the three
        distances, linear Rec. 709 [-]
    multiplier_mm : largest scattering distance 1 / s [mm]
    max_radius_mm : radius within which 99.7 % of the widest channel's light leaves, as shown in the editor
        [mm]
    """

    scattering_colour: tuple[float, ...]
    multiplier_mm: float
    max_radius_mm: float


def unity_parameters(profile: BurleyProfile) -> UnityParameters:
    """Return the settings of Unity's diffusion profile, to be used with the albedo as Unity's base colour.

    According to Unity's source code (DiffusionProfileSettings.cs), the shape s of Burley's profile is
    1 / (colour times multiplier), where the multiplier is in millimetres at scale 1.
    """
    _check_three_channels(profile)
    distance = 1.0 / profile.shape
    return UnityParameters(
        scattering_colour=tuple((distance / distance.max()).tolist()),
        multiplier_mm=float(distance.max()),
        max_radius_mm=float(profile.radius_at_fraction(_UNITY_LIGHT_FRACTION_IN_RADIUS).max()),
    )


@dataclass(frozen=True)
class UnrealParameters:
    """Subsurface profile settings of Unreal Engine 5 with Burley's kernel, for a scene in centimetres.

    surface_albedo : diffuse albedo, linear Rec. 709 [-]
    mean_free_path_colour : mean free path of each channel divided by `mean_free_path_distance_cm`, linear
        Rec. 709 [-]
    mean_free_path_distance_cm : largest mean free path of the three channels, but at least the smallest value
        that the engine accepts [cm]
    world_unit_scale : scale of the scene; 1 is life-size [-]
    """

    surface_albedo: tuple[float, ...]
    mean_free_path_colour: tuple[float, ...]
    mean_free_path_distance_cm: float
    world_unit_scale: float = 1.0


def unreal_parameters(profile: BurleyProfile) -> UnrealParameters:
    """Return the subsurface profile settings of Unreal Engine that reproduce a fitted Burley profile.

    The engine computes the mean free path l as the product of its settings for colour and distance, and from
    it the shape s = 0.6 `shape_factor` / l. It converts millimetres to scene units by dividing them by ten,
    so a scene in centimetres is life-size at scale 1. All this is taken from public copies of the engine's
    source files SubsurfaceProfile.cpp and BurleyNormalizedSSS.cpp.
    """
    _check_three_channels(profile)
    mean_free_path = 0.1 * UNREAL_SHAPE_RATIO * shape_factor(profile.albedo) / profile.shape
    distance = max(float(mean_free_path.max()), _UNREAL_MIN_DISTANCE_CM)
    return UnrealParameters(
        surface_albedo=tuple(profile.albedo.tolist()),
        mean_free_path_colour=tuple((mean_free_path / distance).tolist()),
        mean_free_path_distance_cm=distance,
    )


def _check_three_channels(profile: BurleyProfile) -> None:
    if profile.shape.shape != (3,):
        actual = f"got {profile.shape.size} channels"
        refuse("engine parameters", "red, green and blue", actual, "Fit three channels")
