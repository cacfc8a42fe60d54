"""Export to a web page with Babylon.js, which diffuses light in screen space.

The formulas follow the shader subSurfaceScattering of babylonjs 9.28.0 and 9.34.0. A diffusion profile is set
as a colour c: in each channel, it is a Burley profile of width 1/c. The shader takes samples on a spiral, and
weights the samples by these profiles. The radii of the samples are distributed like a Burley profile as well,
but the width of that profile is max(c). A bug in the shader doubles all widths.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.export.fitting import fit_burley_width
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Parameter, Parameters, flat_tuple, get_numbers
from dermis.apps.export.targets.pages.engine_page import EnginePage, LibraryFile, material_parameters
from dermis.apps.export.targets.pages.html import csp_hash, escape_script
from dermis.optics.cumulative_profile import CumulativeProfile
from dermis.optics.media import Floats

SHADER_SAMPLE_COUNT = 40
"""Number of samples that the shader takes for a pixel if the profile covers at least 160 pixels."""
RENDERED_WIDTH_RATIO = 2.0
"""Ratio of the rendered width of the profile to the width given by metersPerUnit [-]."""
_GOLDEN_RATIO = 1.618033988749895
_DIFFUSION_PROFILE_NAME = "subSurface.scatteringDiffusionProfile"
_METERS_PER_UNIT_NAME = "subSurfaceConfiguration.metersPerUnit"
_CORE_SHA384 = "4Kbm3nj4VMzMufY0FYM9DactmO8CluLjEAe0W1BzVo7hlKEswOLkl46FLI6mxZmx"
_LOADERS_SHA384 = "4FQhr/DrxLfjm5tCJq7Cs1uJIC29544DNb4rVCt4qVzXM7rw07KsDYgdH8/ayoss"


class Babylon(EnginePage):
    """Export to a web page that draws the head with Babylon.js."""

    name = "babylon"
    title = "Babylon.js"
    versions = ("9.28.0",)
    licence = "Apache-2.0"
    drawing_script = Path(__file__).with_name("babylon.js")
    limitations = (
        "Every pixel uses the same 40 samples of one profile per channel, so shadow edges have steps of "
        "1/40, and narrow channels have fewer samples. Light is diffused in screen space, not through thin "
        "parts. Depth differences on slopes count twice, diffuse light above 1 is clipped, and all lights "
        "are parallel."
    )
    library_files: ClassVar = {
        "9.28.0": (
            LibraryFile("babylonjs", "9.28.0", "babylon.js", _CORE_SHA384),
            LibraryFile("babylonjs-loaders", "9.28.0", "babylonjs.loaders.min.js", _LOADERS_SHA384),
        )
    }

    def parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the diffusion profile's colour c, and metersPerUnit, for the fitted Burley widths d [mm].

        With k = sqrt(d_min d_max), the colour is c = k/d and metersPerUnit is 2/k, where d_min and d_max are
        the smallest and the largest of the three widths. The shader then renders the width d in each channel,
        and the radii of its samples are distributed like a Burley profile of width d_max.
        """
        d = fit_burley_width(subject.curve)
        k = float(np.sqrt(d.min() * d.max()))
        return _profile_parameters(subject, k / d, RENDERED_WIDTH_RATIO / k)

    def naive_parameters(self, subject: Subject, version: str) -> Parameters:
        """Return the parameters of a user who mistakes the colour c of the diffusion profile for its widths.

        The colour is then the Burley widths [mm] and not their inverse, and metersPerUnit is 1.
        """
        return _profile_parameters(subject, fit_burley_width(subject.curve), 1.0)

    def predicted_profile(self, parameters: Parameters, subject: Subject, version: str) -> CumulativeProfile:
        """Return the cumulative profile of the discrete samples that the shader takes."""
        profile, (metres,) = (
            get_numbers(parameters, _DIFFUSION_PROFILE_NAME),
            get_numbers(parameters, _METERS_PER_UNIT_NAME),
        )
        return spiral_profile(profile, metres, subject.curve.energy)

    def library_script_tags(self, version: str) -> tuple[str, list[str]]:
        """Return the script elements of Babylon.js, and the values to add to script-src.

        script-src is the part of the page's Content-Security-Policy that lists the permitted scripts. The
        values are URLs or hashes of scripts.
        """
        files = self.library_files[version]
        if self.library_folder is None:
            return "\n".join(file.html_element for file in files), [file.url for file in files]
        texts = [escape_script(file.read(self.library_folder)) for file in files]
        return "\n".join(f"<script>{text}</script>" for text in texts), [csp_hash(text) for text in texts]


def _profile_parameters(subject: Subject, profile_colour: Floats, meters_per_unit: float) -> Parameters:
    return (
        Parameter(
            _DIFFUSION_PROFILE_NAME,
            flat_tuple(profile_colour),
            "-",
            "inverse widths: smaller numbers diffuse farther",
        ),
        Parameter(
            _METERS_PER_UNIT_NAME,
            meters_per_unit,
            "m",
            "widths are 2 mm / (metersPerUnit colour), not a length of the scene",
        ),
        *material_parameters(subject),
    )


def spiral_samples(
    profile_colour: ArrayLike, sample_count: int = SHADER_SAMPLE_COUNT
) -> tuple[Floats, Floats, Floats]:
    """Return radii (n,), angles (n,) [rad] and normalised weights (n, 3) of the shader's samples.

    To get the rendered radii in mm, multiply the returned radii by `RENDERED_WIDTH_RATIO` / metersPerUnit.
    The ratio is 2, as a bug in the shader doubles all widths.

    profile_colour : (3,) colour c of the diffusion profile; the width is proportional to 1/c in each channel
    sample_count : number n of samples
    """
    s = np.asarray(profile_colour, np.float64)
    i = np.arange(sample_count)
    radius, area = burley_radii((i + 0.5) / sample_count)
    width = float(s.max())
    r = width * radius[:, None]
    weight = s * (np.exp(-r * s / 3.0) + np.exp(-r * s)) * (area * width)[:, None]
    return r[:, 0], 2.0 * np.pi * ((i / _GOLDEN_RATIO) % 1.0), weight / weight.sum(axis=0)


def burley_radii(enclosed_fraction: ArrayLike) -> tuple[Floats, Floats]:
    """Return the radii r that enclose given fractions of a Burley profile of width 1, and 1 / (r p(r)).

    p(r) is the probability density of r. The shader's weight of a sample at radius r is proportional to
    1 / (r p(r)).
    """
    u = 1.0 - np.asarray(enclosed_fraction, np.float64)
    g = 1.0 + 4.0 * u * (2.0 * u + np.sqrt(1.0 + 4.0 * u * u))
    n = g ** (-1.0 / 3.0)
    c = 1.0 + g * n * n + n
    return 3.0 * np.log(c / (4.0 * u)), c**3 / (4.0 * u * (c * c + 16.0 * u * u))


def spiral_profile(profile_colour: ArrayLike, meters_per_unit: float, energy: ArrayLike) -> CumulativeProfile:
    """Return the cumulative profile that Babylon.js renders with its samples on a spiral.

    The profile is averaged over all rotations of the spiral about the shaded point.

    profile_colour : (3,) colour c of the diffusion profile; the width is proportional to 1/c in each channel
    meters_per_unit : value of the setting metersPerUnit, which is inversely proportional to the radii
    energy : (3,) total energy of the profile [-]
    """
    radii, _, weight = spiral_samples(profile_colour)
    radii_mm = RENDERED_WIDTH_RATIO * radii / meters_per_unit
    return CumulativeProfile.from_function(lambda r: (r[:, None] >= radii_mm).astype(float) @ weight, energy)


TARGET = Babylon()
