"""Spectral pictures: against red, green and blue, the layered model, and oxygen maps by two wavelengths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import frontal, head_of, scene_of
from tolerances import OXYGEN, POLARISED, SPECTRAL_COLOUR, SPECTRUM

from dermis import Human, Scene
from dermis.base.errors import DermisError
from dermis.frame.lights.environment import load_environment_map
from dermis.frame.renderer import Renderer
from dermis.frame.spectral import SpectralPicture, band_wavelengths, colour_weights, render_spectrum
from dermis.gpu import Device, download
from dermis.human.hair.look import HairLook
from dermis.human.labels.classes import class_number
from dermis.human.skin.measured import SiteDifferences
from dermis.images.colour import delta_e_2000
from dermis.images.io import read_image, write_image
from dermis.images.spectral_exr import write_spectral_exr
from dermis.mesh.primitives import plane
from dermis.optics.bands import Bands
from dermis.optics.lamps import band_power
from dermis.optics.pigments.spectra import WAVELENGTHS_NM
from dermis.optics.tissue import load_tissue
from dermis.scene.lights import studio
from dermis.scene.settings import Settings

Doubles = NDArray[np.float64]
SMALL = Settings(size=48, atlas=128, samples=1, shadow_size=128)
PERSON = Human(hair=HairLook("none"))
OXYGENATED_NM, ISOSBESTIC_NM = 730.0, 805.0


def scene_with(person: Human) -> Scene:
    head = replace(person.head(subdivide=0), hair=None)
    return Scene(head, lights=[studio()[0]], camera="headshot")


@pytest.fixture(scope="module")
def scene() -> Scene:
    return scene_with(PERSON)


@pytest.fixture(scope="module")
def picture(renderer: Renderer, scene: Scene) -> SpectralPicture:
    settings = SMALL.model_copy(update={"background": (0.2, 0.1, 0.05), "exposure": "skin"})
    return render_spectrum(renderer, scene, settings)


def test_spectra_under_daylight_have_the_colours_of_the_picture(picture: SpectralPicture) -> None:
    assert picture.backdrop is not None
    whole = picture.rgb + picture.backdrop
    error = delta_e_2000(picture.linear("D65"), whole)
    head = picture.alpha == 1.0
    assert head.sum() > 500
    assert np.median(error[head]) < SPECTRAL_COLOUR
    assert error[picture.alpha == 0.0].max() < 0.05  # colours that are upsampled return


def test_lamps_shift_colours_of_skin(picture: SpectralPicture) -> None:
    """Frames in three channels do not have this shift, because white remains white under each lamp."""
    head = picture.alpha == 1.0
    error = {
        lamp: np.median(delta_e_2000(picture.linear(lamp)[head], picture.rgb[head]))
        for lamp in ("FL11", "LED-B3", "A")
    }
    assert 1.0 < error["FL11"] < 3.0 and 0.3 < error["LED-B3"] < 1.5 and 2.0 < error["A"] < 6.0, error
    for lamp in error:
        assert colour_weights(lamp, WAVELENGTHS_NM).sum(axis=1) == pytest.approx(np.ones(3), abs=1e-9)


def test_radiance_is_that_of_the_lamp(picture: SpectralPicture) -> None:
    under = picture.radiance("FL11")
    lit = picture.reflected[..., 0] > 0.0
    ratio = under[lit] / np.maximum(picture.reflected[lit], 1e-9)
    power = band_power("FL11", WAVELENGTHS_NM)
    assert np.allclose(np.median(ratio, axis=0), power, rtol=1e-5)
    assert WAVELENGTHS_NM[power.argmax()] in (540.0, 550.0)  # the green line of the phosphor


def test_a_patch_has_the_spectrum_of_the_layered_model(renderer: Renderer) -> None:
    patch = head_of(plane(100.0))
    scene = scene_of(patch, frontal(np.pi), profile="spectral", albedo="profile", specular="none")
    settings = Settings(size=9, atlas=64, samples=1, transmission="none", exposure=1.0)
    found = render_spectrum(renderer, scene, settings).reflected[4, 4]
    expected = load_tissue("spectral").spectrum()
    assert expected is not None
    assert np.abs(found / expected - 1.0).max() < SPECTRUM


@pytest.mark.parametrize("oxygen", [0.6, 0.85])
def test_oxygen_maps_by_two_wavelengths(renderer: Renderer, oxygen: float, oximeter: Oximeter) -> None:
    """The ratio of optical densities at 730 nm and at an isosbestic point is linear in the saturation."""
    found = oximeter.oxygen_map(renderer, oxygen)
    error = np.abs(found / oxygen - 1.0)
    assert np.median(error) < 0.3 * OXYGEN
    assert np.percentile(error, 95) < OXYGEN


class Oximeter:
    """Two-wavelength oximeter, calibrated with skin of two known saturations and of skin without blood."""

    def __init__(self, renderer: Renderer) -> None:
        self.settings = SMALL.model_copy(update={"polarisation": "cross", "strands": False, "exposure": 1.0})
        self.bloodless = self._spectra(renderer, 0.8, blood=0.0)
        label = renderer.draw(self._scene(0.8), self.settings, outputs=("label",)).output("label")
        names = "skin", "nose", "neck"
        self.skin = np.isin(label, [class_number(name) for name in names]) & (self.bloodless.alpha == 1.0)
        known = 0.5, 0.95
        ratios = [np.median(self._ratio(renderer, one)) for one in known]
        self.line = np.polyfit(ratios, known, 1)

    def oxygen_map(self, renderer: Renderer, oxygen: float) -> Doubles:
        """Return the oxygen saturation that is measured at each pixel of skin."""
        return np.asarray(np.polyval(self.line, self._ratio(renderer, oxygen)))

    def _scene(self, oxygen: float, **pigments: float) -> Scene:
        look = replace(PERSON.look, oxygen=oxygen, sites=SiteDifferences(), stubble=0.0, **pigments)
        scene = scene_with(replace(PERSON, skin=look))
        return scene.replace(lights=[frontal(shadows=False)])  # light beside shadows has longer paths

    def _spectra(self, renderer: Renderer, oxygen: float, **pigments: float) -> SpectralPicture:
        wavelengths = OXYGENATED_NM, ISOSBESTIC_NM
        return render_spectrum(renderer, self._scene(oxygen, **pigments), self.settings, wavelengths)

    def _ratio(self, renderer: Renderer, oxygen: float) -> Doubles:
        reflected = self._spectra(renderer, oxygen).reflected[self.skin].astype(float)
        density = np.log(self.bloodless.reflected[self.skin] / reflected)
        return np.asarray(density[:, 0] / density[:, 1])


@pytest.fixture(scope="module")
def oximeter(renderer: Renderer) -> Oximeter:
    return Oximeter(renderer)


def test_polarisers_separate_reflection_from_scattered_light(renderer: Renderer, scene: Scene) -> None:
    def light(**settings: str) -> NDArray[np.float32]:
        return renderer.render(scene, **(SMALL.model_dump() | settings))

    parallel, cross = light(polarisation="parallel"), light(polarisation="cross")
    surface, below = light(parts="specular"), light(parts="diffuse")
    assert surface.max() > 0.01
    assert np.abs(parallel - cross - surface).max() < POLARISED * surface.mean()
    assert np.abs(2.0 * cross - below).max() < POLARISED * below.mean()


def test_camera_signals_are_spectra_weighted_by_sensitivities(
    picture: SpectralPicture, tmp_path: Path
) -> None:
    """A sensor of a single wavelength has the spectrum there as its signal, balanced for white."""
    file = tmp_path / "narrow.csv"
    rows = [(nm, nm == 650, nm == 550, nm == 450) for nm in range(400, 701)]
    file.write_text(
        "nm,red,green,blue\n" + "".join(f"{','.join(str(float(one)) for one in r)}\n" for r in rows)
    )
    bare = replace(picture, backdrop=None)
    index = [int(np.flatnonzero(nm == WAVELENGTHS_NM)[0]) for nm in (650.0, 550.0, 450.0)]
    assert np.allclose(bare.camera(file, "LED-B3"), picture.reflected[..., index], atol=1e-5)


def test_a_lamp_from_a_file(tmp_path: Path) -> None:
    """A file with the table of an illuminant is that illuminant."""
    file = tmp_path / "lamp.csv"
    power = band_power("A", np.arange(380.0, 781.0, 1.0))
    file.write_text("".join(f"{380 + k},{17.0 * one}\n" for k, one in enumerate(power)))
    assert np.allclose(band_power(str(file), WAVELENGTHS_NM), band_power("A", WAVELENGTHS_NM), rtol=2e-3)
    with pytest.raises(DermisError, match="380 to 780 nm"):
        band_power(str(file), np.array([900.0]))


def test_panoramas_are_upsampled(device: Device, tmp_path: Path) -> None:
    room, bands = tmp_path / "room.exr", Bands((450.0, 550.0, 650.0))
    colour = np.array([0.8, 0.3, 0.1])
    write_image(room, np.broadcast_to(colour, (8, 16, 3)).astype(np.float32))
    panorama = download(device, load_environment_map(device, str(room), bands).panorama, layer=1)
    assert np.allclose(panorama[..., :3], bands.reflectance(colour), rtol=0.01)


def test_a_blush_absorbs_green_light(renderer: Renderer, scene: Scene) -> None:
    settings, bands = SMALL.model_copy(update={"parts": "diffuse", "exposure": 1.0}), (550.0, 650.0)
    pale = render_spectrum(renderer, scene, settings, bands)
    red = render_spectrum(renderer, scene.replace(state={"blush": 1.0}), settings, bands)
    before, after = (one.reflected[pale.alpha == 1.0].mean(axis=0) for one in (pale, red))
    green, deep_red = np.log(after / before)
    assert green < 1.5 * deep_red < 0.0


def test_wavelengths_are_checked() -> None:
    assert band_wavelengths(61)[-1] == 1000.0
    for wrong in (0, 62, [500.0, 400.0], [300.0], [1001.0], []):
        with pytest.raises(DermisError, match="spectral"):
            band_wavelengths(wrong)


def test_spectra_are_written_as_channels(picture: SpectralPicture, tmp_path: Path) -> None:
    import OpenEXR

    path = tmp_path / "cube.exr"
    radiance = picture.radiance("D65")
    write_spectral_exr(path, picture.wavelengths_nm, radiance, picture.rgb, picture.alpha, {"lamp": "D65"})
    file = OpenEXR.File(str(path), separate_channels=True)
    channels = file.channels()
    assert file.header()["spectralLayoutVersion"] == "1.0" and file.header()["lamp"] == "D65"
    assert np.array_equal(channels["S0.550,000000nm"].pixels, radiance[..., 15])
    assert len([name for name in channels if name.startswith("S0.")]) == 31
    assert np.array_equal(read_image(path)[..., :3], picture.rgb)
