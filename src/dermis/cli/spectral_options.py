"""Options of spectra and lamps, and the pictures that they describe."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from dermis.base.console import print_note
from dermis.base.errors import refuse

if TYPE_CHECKING:
    from dermis.base.arrays import Floats
    from dermis.frame.renderer import Renderer
    from dermis.frame.spectral import SpectralPicture
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings

_DEFAULT_LAMP = "D65"
_LAST_NM_OF_31_BANDS = 720.0  # spectra are constant beyond 700 nm, at which eyes hardly see
_SKIN_CLASSES = ("skin", "nose", "neck", "right_ear", "left_ear")


@Parameter(name="*")
@dataclass(frozen=True)
class SpectralOptions:
    """Options of spectra and lamps on the command line; None for options that are not given."""

    spectral: Annotated[
        str | None,
        Parameter(
            metavar="COUNT|NM,NM,...",
            help="Write the spectrum of each pixel to an .exr file: 31 bands of 10 nm from 400 to 700 nm, up "
            "to 61 bands to 1,000 nm, or wavelengths in nm, such as 660,940.",
        ),
    ] = None
    light_spectrum: Annotated[
        str | None,
        Parameter(
            metavar="LAMP",
            help="Spectrum of all lights: D65, A, FL11, LED-B3, E (equal energy), or a CSV file of "
            "wavelength in nm and relative power. Colours are computed from spectra, for an eye adapted to "
            "the light.",
        ),
    ] = None
    camera_sensitivity: Annotated[
        Path | None,
        Parameter(
            metavar="FILE",
            help="CSV file of wavelength in nm and the sensitivities of a camera's red, green and blue: the "
            "colours of the picture are its white-balanced signals.",
        ),
    ] = None

    @property
    def are_given(self) -> bool:
        """Return whether any of the options is given."""
        return (
            self.spectral is not None
            or self.light_spectrum is not None
            or self.camera_sensitivity is not None
        )

    def check(self, output: Path, settings: Mapping[str, Any], has_outputs: bool, as_json: bool) -> None:
        """Raise DermisError for options that do not go together, before anything is rendered.

        settings : options of `Settings` that are given
        has_outputs, as_json : whether --outputs and --json are given
        """
        if not self.are_given:
            return
        is_exr = output.suffix.lower() == ".exr"
        if self.spectral is not None and not is_exr:
            refuse(output, "an .exr file with --spectral", f"got {output.suffix}", "Name it .exr")
        if self.spectral is not None and self.camera_sensitivity is not None:
            actual = "--camera-sensitivity is given too"
            refuse("--spectral", "spectra, or the colours of a camera", actual, "Leave one of them out")
        if has_outputs:
            refuse(
                "--outputs", "a picture without spectra", "it is given", "Render the outputs by themselves"
            )
        if as_json:
            refuse("--json", "a picture without spectra", "it is given", "Leave it out")
        _check_tone(output, settings.get("tone", "none"), "Leave it out, or write .exr")
        from dermis.frame.spectral import band_wavelengths
        from dermis.optics.lamps import band_power, read_sensitivities

        band_power(self.lamp, band_wavelengths(self.bands))
        if self.camera_sensitivity is not None:
            read_sensitivities(self.camera_sensitivity, self.lamp)

    @property
    def lamp(self) -> str:
        """Return the lamp of all lights."""
        return self.light_spectrum or _DEFAULT_LAMP

    @property
    def bands(self) -> int | list[float]:
        """Return the number of bands or the wavelengths [nm] to render.

        Raises DermisError for invalid syntax.
        """
        if self.spectral is None:
            from dermis.optics.pigments.spectra import WAVELENGTHS_NM

            return self._camera_bands() or len(WAVELENGTHS_NM)
        try:
            if "," not in self.spectral:
                return int(self.spectral)
            return [float(part) for part in self.spectral.removesuffix(",").split(",")]
        except ValueError:
            expected = "a number of bands, or wavelengths in nm with commas"
            refuse("--spectral", expected, f"got {self.spectral!r}", "Write 31, or 660,940")

    def _camera_bands(self) -> int:
        """Return the number of bands that a camera needs which sees more than 720 nm; 0 for others.

        Light at wavelengths at which the power of the lamp is not known is left out.
        """
        if self.camera_sensitivity is None:
            return 0
        from dermis.frame.spectral import BAND_NM, FIRST_BAND_NM, MAX_BANDS
        from dermis.optics.lamps import power_ends_nm, read_sensitivities, seen_wavelengths

        grid, response = read_sensitivities(self.camera_sensitivity, self.lamp)
        last_nm = float(seen_wavelengths(grid, response)[-1])
        if last_nm <= _LAST_NM_OF_31_BANDS:
            return 0
        longer = math.ceil((last_nm - FIRST_BAND_NM) / BAND_NM)
        is_known = FIRST_BAND_NM + BAND_NM * longer <= power_ends_nm(self.lamp)[1]
        return min(longer + 1 if is_known else longer, MAX_BANDS)

    def render(self, renderer: Renderer, scene: Scene, settings: Settings, output: Path) -> list[str]:
        """Render a spectral picture, write it, and return lines for the report."""
        from dermis.frame.spectral import render_spectrum
        from dermis.images.io import write_image

        _check_tone(output, settings.tone, "Add --tone none, or write .exr")  # of a scene file
        picture = render_spectrum(renderer, scene, settings, self.bands)
        if self.spectral is not None:
            return self._write_cube(picture, output)
        if self.camera_sensitivity is not None:
            colours, lines = picture.camera(self.camera_sensitivity, self.lamp), []
        else:
            colours = picture.linear(self.lamp)
            lines = [_colour_error(renderer, scene, settings, picture, self.lamp)]
        write_image(
            output, colours if picture.backdrop is not None else _with_alpha(colours, picture, output)
        )
        return lines

    def _write_cube(self, picture: SpectralPicture, output: Path) -> list[str]:
        from dermis.images.spectral_exr import write_spectral_exr

        attributes = {"lamp": self.lamp, "exposure": f"{picture.exposure:.9g}"}
        if picture.covers_visible_light:
            preview = replace(picture, backdrop=None).linear(self.lamp)
        else:
            preview = picture.rgb
            print_note("note: channels R, G and B are those of the picture without spectra")
        if picture.backdrop is not None:
            print_note("note: spectra have no background; channel A has the coverage by the head")
        radiance = picture.radiance(self.lamp)
        write_spectral_exr(output, picture.wavelengths_nm, radiance, preview, picture.alpha, attributes)
        first, last = picture.wavelengths_nm[[0, -1]]
        return [f"{len(picture.wavelengths_nm)} wavelengths from {first:g} to {last:g} nm under {self.lamp}"]


NO_SPECTRA = SpectralOptions()


def _check_tone(output: Path, tone: str, advice: str) -> None:
    """Raise DermisError for a tone curve, which colours that are computed from spectra do not have."""
    if output.suffix.lower() != ".exr" and tone != "none":
        refuse("--tone", "none with spectra", f"got {tone}", advice)


def _with_alpha(colours: Floats, picture: SpectralPicture, output: Path) -> Floats:
    """Return colours (h, w, 4) with alpha, by which colours are multiplied in EXR files, but not in PNG."""
    import numpy as np

    alpha = picture.alpha[..., None]
    if output.suffix.lower() == ".png":
        colours = np.asarray(colours / np.maximum(alpha, 1e-6), np.float32)
    return np.concatenate([colours, alpha], axis=-1)


def _colour_error(
    renderer: Renderer, scene: Scene, settings: Settings, picture: SpectralPicture, lamp: str
) -> str:
    """Return a line with the difference between skin from spectra and skin in red, green and blue."""
    import numpy as np

    from dermis.human.labels.classes import class_number
    from dermis.images.colour import delta_e_2000

    numbers = [class_number(name) for name in _SKIN_CLASSES]
    label = renderer.draw(scene, settings, timed=False, outputs=("label",)).output("label")
    skin = np.isin(label, numbers) & (picture.alpha == 1.0)
    if not skin.any():
        return "no pixel shows skin alone"
    error = delta_e_2000(picture.linear(lamp)[skin], picture.rgb[skin])
    median, most = np.percentile(error, [50, 95])
    values = f"{median:.2f} (median), {most:.2f} (95 %)"
    return f"skin here and in a picture in red, green and blue differ by CIEDE2000 {values}"
