"""Known light and skin are recovered from pictures by the renderer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import DermisError, DirectionalLight, Environment, Human, Renderer, Scene, Settings
from dermis.apps.inverse.fitting import light_basis
from dermis.apps.inverse.fitting.fit import CoarseSearch, fit
from dermis.apps.inverse.fitting.inputs import fit_subject, read_photograph
from dermis.apps.inverse.fitting.light_basis import solve_light_strengths
from dermis.apps.inverse.fitting.placement import align_to_landmarks
from dermis.apps.inverse.fitting.result import FitResult, save_fit
from dermis.apps.inverse.fitting.solve import SYSTEMATIC_SD
from dermis.apps.inverse.fitting.unknowns import SKIN_UNKNOWNS, prior_unknowns
from dermis.apps.inverse.unmixing.unknown_skin import sd_from_assumed_parameters
from dermis.human.landmarks.points import landmark_points
from dermis.human.skin.measured import measured_medians
from dermis.images.colour import encode_srgb8
from dermis.mesh.geometry import fibonacci_sphere
from dermis.scene.camera import Camera
from dermis.scene.files import load_scene
from dermis.scene.people import skin_of
from dermis.scene.skin import Pigments, Skin

SIZE = (48, 56)
CAMERA = Camera(position=(150.0, 20.0, 1100.0), target=(0.0, -10.0, 30.0), frame_mm=240.0)
SMALL = {"side": 56, "atlas": 128}


@pytest.fixture(scope="module")
def person() -> Human:
    return Human.sampled(7, skin={"melanin": 0.05, "blood": 0.012}, hair={"style": "none"})


@pytest.fixture(scope="module")
def scene(person: Human) -> Scene:
    """Return a warm sky of one radiance, and a sun from the upper left."""
    skin = skin_of(person).model_copy(update={"roughness": 0.25, "rho_s": 0.6})
    sun = DirectionalLight(direction=(-0.5, -0.4, -0.77), irradiance=2.0)
    return Scene(
        person.head(subdivide=1),
        skin=skin,
        camera=CAMERA,
        lights=[sun],
        environment=Environment(name="uniform", exposure=0.3),
    )


@pytest.fixture(scope="module")
def photo(scene: Scene) -> NDArray[np.float32]:
    settings = Settings(size=SIZE, atlas=128, shadow_size=512, strands=False)
    return Renderer("cpu").draw(scene, settings).linear()


@pytest.fixture(scope="module")
def fitted(person: Human, scene: Scene, photo: NDArray[np.float32]) -> FitResult:
    """Return a fit to bytes at half the exposure, under light with a fifth more red than white."""
    seen = encode_srgb8(np.clip(0.5 * photo * (1.2, 1.0, 0.9), 0.0, 1.0))
    return fit(seen, person, camera=CAMERA, exposure=0.5, white=(1.2, 1.0, 0.9), adapter="cpu", **SMALL)


def test_fit_recovers_skin_and_light(fitted: FitResult) -> None:
    assert fitted.skin_values["melanin"] == pytest.approx(0.05, rel=0.05)
    assert fitted.skin_values["blood"] == pytest.approx(0.012, rel=0.1)
    assert fitted.skin_values["roughness"] == pytest.approx(0.25, abs=0.05)
    ((towards, strength),) = fitted.suns
    true = np.array([0.5, 0.4, 0.77])
    assert towards @ true / np.linalg.norm(true) > np.cos(np.radians(3.0))
    assert strength == pytest.approx(2.0, rel=0.1)
    assert light_basis.ambient_panorama(
        fitted.strengths[: light_basis.AMBIENT_LOBE_COUNT]
    ).mean() == pytest.approx(0.3, rel=0.2)
    assert fitted.residual < 0.02


def test_written_files_form_a_loadable_scene(fitted: FitResult, tmp_path: Path) -> None:
    save_fit(tmp_path, fitted)
    scene, settings = load_scene(tmp_path / "scene.toml")
    assert settings.size == SIZE and settings.exposure == 0.5
    assert scene.head.maps.look.melanin == pytest.approx(fitted.skin_values["melanin"])  # type: ignore[attr-defined]
    red, green, _ = scene.lights[0].irradiance
    assert red / green == pytest.approx(1.2, rel=1e-6)
    message = json.loads((tmp_path / "fit.json").read_text())
    assert any(one.startswith("exposure: given, 0.5") for one in message["priors"])
    names = {"light.exr", "person.json", "scene.toml", "photo.png", "fit.png", "difference.png", "fit.json"}
    assert {one.name for one in tmp_path.iterdir()} == names


def test_head_without_a_path_is_not_written_as_file(person: Human) -> None:
    assert fit_subject(person).person is person
    plain = fit_subject(person.head(subdivide=0))
    assert plain.person is None and not plain.table
    assert fit_subject(Human().head(subdivide=0)).person is not None


def test_light_is_nonnegative_and_recovered() -> None:
    random = np.random.default_rng(3)
    A, light = random.uniform(size=(60, 10)), np.append(light_basis.lobe_mixtures()[0][:, 5], 0.7)
    assert solve_light_strengths(A, A @ light) == pytest.approx(light, abs=1e-4)
    dark = solve_light_strengths(A, -(A @ light))
    assert np.abs(dark).max() < 1e-9


def test_lobes_span_second_order_harmonics() -> None:
    positions = fibonacci_sphere(200)
    x, y, z = positions.T
    wanted = np.stack([np.ones(200), x, y, z, x * y, y * z, z * x, x * x - y * y, 3 * z * z - 1], axis=-1)
    lobes = light_basis.lobe_radiance(light_basis.lobe_directions(), positions)
    made = lobes @ np.linalg.lstsq(lobes, wanted, rcond=None)[0]
    assert np.abs(made - wanted).max() < 1e-9


def test_clipped_pixels_are_excluded() -> None:
    image = np.full((32, 32, 3), 100, np.uint8)
    image[:16, :16, 0] = 255
    small = read_photograph(image).reduced_to(16)
    assert (
        small.size == (16, 16) and small.unclipped[:8, :8].max() == 0.0 and small.unclipped[8:].min() == 1.0
    )


def test_landmarks_determine_camera_and_shape(person: Human, tmp_path: Path) -> None:
    head, size = person.head(subdivide=0), (300, 400)
    points = landmark_points(head, "ibug-68")
    positions = np.einsum("nk,nkc->nc", points.weight, head.positions_mm[points.point]) - head.centre_mm
    camera = CAMERA.to_opencv(size)
    seen = (positions @ camera.R.T + camera.t) @ camera.K.T
    pixels = seen[:, :2] / seen[:, 2:]
    rows = [f"{name},{x},{y}" for name, (x, y) in zip(points.names, pixels.tolist(), strict=True)]
    (tmp_path / "face.csv").write_text("\n".join(["name,x,y", *rows]))
    made = align_to_landmarks(fit_subject(Human()), tmp_path / "face.csv", size)
    assert made.person is not None
    other = made.scene.camera
    towards, true = (np.subtract(one.position, one.target) for one in (other, CAMERA))
    cosine = towards @ true / np.linalg.norm(towards) / np.linalg.norm(true)
    assert cosine > np.cos(np.radians(3.0))
    again = made.person.head(subdivide=0)
    there = np.einsum("nk,nkc->nc", points.weight, again.positions_mm[points.point]) - again.centre_mm
    fitted = other.to_opencv(size)
    back = (there @ fitted.R.T + fitted.t) @ fitted.K.T
    off = np.linalg.norm(back[:, :2] / back[:, 2:] - pixels, axis=1)
    assert np.median(off) < 1.5


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"suns": 3}, "suns: expected"),
        ({"exposure": 0.0}, "exposure: expected"),
        ({"white": "grey"}, "white: expected"),
        ({"camera": 3}, "camera: expected"),
    ],
)
def test_invalid_arguments_are_refused(
    person: Human, photo: NDArray[np.float32], given: dict[str, Any], message: str
) -> None:
    with pytest.raises(DermisError, match=message):
        fit(photo, person, **given)


def test_deviations_include_errors_of_the_renderer_and_what_is_assumed(fitted: FitResult) -> None:
    """Oxygen and thickness of the person are not stated, and differ between people."""
    assumed = sd_from_assumed_parameters(fitted.skin_values["melanin"], fitted.skin_values["blood"])
    for name in ("melanin", "blood"):
        least = np.hypot(SYSTEMATIC_SD[name], assumed[name])
        assert 0.9 * least < fitted.uncertainty.sd[name] < 2.0 * least, name
    assert fitted.subject.known == ()
    assert any("spread of measured people: oxygen, epidermis_mm" in one for one in fitted.summary()["priors"])


def test_stated_pigments_are_known() -> None:
    skin = Skin(profile="spectral", pigments=Pigments(oxygen=0.9, epidermis_mm=0.06))
    subject = fit_subject(Scene(Human().head(subdivide=0), skin=skin))
    assert subject.known == ("oxygen", "epidermis_mm")


def test_priors_of_pigments_are_those_of_measured_people() -> None:
    """Medians of groups and sites differ less than people: nearly all are within two deviations."""
    cells = [one for one in measured_medians() if not one.sex + one.age_group and one.people >= 50]
    for unknown in SKIN_UNKNOWNS[:2]:
        values = np.log([getattr(one.pigments, unknown.name) for one in cells])
        score = (values - np.log(unknown.prior_median)) / unknown.prior_sd
        assert abs(np.median(score)) < 0.5 and np.abs(score).max() < 2.5, unknown.name
        assert (np.abs(score) < 1.0).mean() > 0.68, unknown.name


class TwoWells(CoarseSearch):
    """Coarse search whose squared residual has minima at melanin fractions of 0.4 and 0.05.

    ratio : squared residual of the second minimum relative to that of the first
    """

    def __init__(self, ratio: float) -> None:
        self.unknowns, self.ratio = prior_unknowns(np.array([[0.0, 0.0, 1.0]])), ratio

    def _squared_residual(self, logs: NDArray[np.float64], suns: list[int]) -> float:
        dark, pale = (abs(logs[0] - np.log(melanin)) for melanin in (0.4, 0.05))
        return float(min(1.0 + dark, self.ratio + pale) + abs(logs[1] - np.log(0.01)))


def test_fits_start_from_dark_and_from_pale_skin_that_look_alike() -> None:
    dark, pale = TwoWells(1.3).melanin_ranges(TwoWells(1.3).best_unknowns(1))
    assert dark[0] > 0.1 and dark[-1] == pytest.approx(0.4)
    assert pale[0] < 0.05 < pale[-1] < 0.2
    assert np.exp(TwoWells(1.3).best_unknowns(1, pale).logs[0]) == pytest.approx(0.05, rel=0.2)
    (everything,) = TwoWells(3.0).melanin_ranges(TwoWells(3.0).best_unknowns(1))
    assert (everything[0], everything[-1]) == pytest.approx((0.002, 0.4))
