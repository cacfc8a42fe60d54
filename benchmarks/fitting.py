"""Measure how accurately the light and skin of path-traced faces and of drawn people are estimated.

Renders the reference pictures that are not cached yet, fits each, and writes the figures after each face;
`unmixing_page.py` writes docs/fit.md from them.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import gettempdir
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.fit import fit
from dermis.apps.inverse.fitting.result import FitResult
from dermis.apps.truths.half_space import diffuse_albedo, reflected_radiance
from dermis.apps.truths.path_traced import MitsubaVariant, PathTraced
from dermis.apps.validation.comparisons.person import path_trace_view
from dermis.apps.validation.comparisons.person_textures import person_textures
from dermis.apps.validation.pages import JsonObject, write_results
from dermis.base.command_line import run_script
from dermis.base.console import print_lines
from dermis.environment.panorama import texel_directions, texel_solid_angles
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.human.skin.painted import PaintedMaps
from dermis.images.hdr import encode_exr
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene
from dermis.scene.people import skin_of
from dermis.scene.settings import Settings
from dermis.scene.skin import DEFAULT_ROUGHNESS, Pigments

FOLDER = Path(gettempdir()) / "dermis-fitting"
"""Folder of the panoramas, which scenes reference as files."""
SCENES = 30
_SEED = 2411  # the settings were chosen on scenes of seed 24
_MELANIN, _BLOOD, _ROUGHNESS = (-2.2, -0.8), (-2.5, -1.5), (0.2, 0.4)  # melanin, blood: log10
LOBE = "torrance-sparrow-smith"
"""Specular lobe of the true skin, with a single slope distribution."""
_PAINT_SIDE = 1024  # side of painted maps [texel]
_SKY_ROWS = 32  # rows of pixels of a panorama
_FACE_MM = 250.0


@dataclass(frozen=True)
class Case:
    """Face with known light and skin.

    towards : (3,) unit vector to the sun
    sun : fraction of the irradiance on a surface facing the sun that comes from the sun, not from the sky [-]
    """

    number: int
    person: Human
    scene: Scene
    melanin: float
    blood: float
    roughness: float
    towards: NDArray[np.float64]
    sun: float


def case(number: int, measured: bool = False) -> Case:
    """Return the case with a number; equal numbers give equal cases.

    measured : whether melanin and blood are those of the drawn person, as in measured people, instead of
        uniformly distributed over their logarithms
    """
    random = np.random.default_rng((_SEED, number))
    melanin, blood = (float(10.0 ** random.uniform(*span)) for span in (_MELANIN, _BLOOD))
    roughness = float(random.uniform(*_ROUGHNESS))
    pigments = {} if measured else {"melanin": melanin, "blood": blood}
    person = Human.sampled(100 + number, skin=pigments, hair={"style": "none", "beard_mm": 0.0})
    melanin, blood = person.look.melanin, person.look.blood
    head = person.head()
    turn, tilt = np.radians(random.uniform(-65.0, 65.0)), np.radians(random.uniform(-10.0, 60.0))
    towards = np.array([np.sin(turn) * np.cos(tilt), np.sin(tilt), np.cos(turn) * np.cos(tilt)])
    radiance = _sky(random)
    strength = float(random.uniform(1.0, 3.0))
    arriving = _sky_irradiance(radiance, towards)
    lights = [DirectionalLight(direction=tuple(-towards), irradiance=strength, angle_degrees=0.53)]  # type: ignore[arg-type]
    yaw = np.radians(random.uniform(-25.0, 25.0))
    eye = 1100.0 * np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    camera = Camera(position=tuple(eye), target=(0.0, -10.0, 30.0), frame_mm=_FACE_MM)
    environment = Environment(name=str(_panorama(number, radiance)))
    surface = {"roughness": roughness, "rho_s": 1.0, "specular": LOBE, "fresnel": "exact"}
    skin = skin_of(person).model_copy(update=surface)
    scene = Scene(head, lights=lights, camera=camera, skin=skin, environment=environment)
    return Case(number, person, scene, melanin, blood, roughness, towards, strength / (strength + arriving))


def _sky(random: np.random.Generator) -> NDArray[np.float64]:
    """Return the (h, w) radiance of a sky: a constant and three wide lobes."""
    towards = texel_directions(_SKY_ROWS, 2 * _SKY_ROWS)
    radiance = np.full(towards.shape[:2], random.uniform(0.05, 0.2))
    for _ in range(3):
        middle = random.standard_normal(3) + np.array([0.0, 0.6, 0.6])
        cosine = towards @ (middle / np.linalg.norm(middle))
        radiance += random.uniform(0.1, 0.5) * (0.5 + 0.5 * cosine) ** random.uniform(1.0, 8.0)
    return radiance


def _sky_irradiance(radiance: NDArray[np.float64], towards: NDArray[np.float64]) -> float:
    """Return the irradiance that the sky casts on a surface facing a direction."""
    cosine = np.maximum(texel_directions(_SKY_ROWS, 2 * _SKY_ROWS) @ towards, 0.0)
    return float((radiance * cosine * texel_solid_angles(_SKY_ROWS, 2 * _SKY_ROWS)).sum())


def _panorama(number: int, radiance: NDArray[np.float64]) -> Path:
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"sky_{number}.exr"
    path.write_bytes(encode_exr(np.repeat(radiance[..., None], 3, axis=2).astype(np.float32)))
    return path


def photograph(
    renderer: Renderer, one: Case, side: int, samples: int, variant: MitsubaVariant = "scalar_rgb"
) -> PathTraced:
    """Return the path-traced picture of a case; the surface is a dielectric of index 1.4.

    A medium without refraction is darker when it is lit and seen from the front than under uniform light. The
    painted colours are as measured by a colorimeter: lit at 45 degrees, seen from the front.
    """
    paint = person_textures(renderer, one.scene, _PAINT_SIDE)
    paint = replace(paint, colour=_under_uniform_light(paint.colour))
    rough = np.clip(paint.roughness * (one.roughness / DEFAULT_ROUGHNESS), 0.05, 1.0).astype(np.float32)
    paint = replace(paint, roughness=rough)
    return path_trace_view(renderer, one.scene, paint, (side, side), samples, variant=variant)


def _under_uniform_light(colour: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return colours of media under uniform light, given their colours lit at 45 and seen at 0 degrees."""
    albedo = 1.0 - np.linspace(1.0, 0.01, 48) ** 2
    seen = [np.pi * float(reflected_radiance(np.sqrt(0.5), 1.0, float(one))) for one in albedo]
    return np.interp(colour, seen, [diffuse_albedo(float(one)) for one in albedo]).astype(np.float32)


RESULTS = Path(__file__).parent / "results" / "fitting.json"
_SMALL_SIDE = 64  # side of pictures of people with measured pigments [pixel]
_NO_LIMIT = 1e9
"""Residual limit so large that it disables the robust loss, which would discard the strong noise of paths."""


def main(
    *,
    output: Annotated[Path, Parameter(name=("--output", "-o"))] = RESULTS,
    adapter: str = "auto",
    side: int = 256,
    samples: int = 8,
    scenes: int = SCENES,
    variant: MitsubaVariant = "scalar_rgb",
    own: int = 3,
    people: int = 20,
    trace_only: Annotated[bool, Parameter(negative="")] = False,
) -> None:
    """Render, fit, and write the figures.

    Parameters
    ----------
    output:
        JSON file with the figures.
    side:
        Side of the pictures [pixel].
    samples:
        Paths per pixel.
    scenes:
        Number of faces.
    variant:
        Variant of Mitsuba, such as cuda_ad_rgb.
    own:
        Number of scenes that are also rendered by dermis.
    people:
        Number of people with measured pigments, rendered by dermis, whose oxygen and epidermal thickness the
        fit does not know.
    trace_only:
        Render the pictures that are not cached yet, and fit none.
    """
    renderer = Renderer(adapter)
    figures: JsonObject = {"side": side, "samples": samples}
    figures |= {"adapter": renderer.device.adapter.name, "traced": [], "own": [], "people": []}
    for number in range(0 if trace_only else people):
        one = case(number, measured=True)
        settings = Settings(size=(_SMALL_SIDE, _SMALL_SIDE), atlas=2 * _SMALL_SIDE, strands=False)
        figures["people"].append(fitted_stranger(one, renderer.draw(one.scene, settings).linear(), adapter))
        print_lines(str(figures["people"][-1]))
        write_results(output, figures, 4)
    for number in range(scenes):
        one, began = case(number), time.perf_counter()
        image = photograph(renderer, one, side, samples, variant).image
        if trace_only:
            print_lines(f"{number} {time.perf_counter() - began:.0f} s")
            continue
        if number < own:
            settings = Settings(size=(side, side), atlas=512, strands=False)
            figures["own"].append(fitted(one, renderer.draw(one.scene, settings).linear(), adapter))
        figures["traced"].append(fitted(one, image, adapter))
        print_lines(str(figures["traced"][-1]))
        write_results(output, figures, 4)


def fitted(one: Case, image: NDArray[np.float32], adapter: str) -> JsonObject:
    """Return the estimates of a case together with the true values.

    The fit knows only the true eumelanin, oxygenation, epidermal thickness and kind of surface.
    """
    began = time.process_time()
    look = one.person.look
    held = Pigments(eumelanin=look.eumelanin, oxygen=look.oxygen, epidermis_mm=look.epidermis_mm)
    found = fit(image, _given(one.scene, held), robust=_NO_LIMIT, adapter=adapter)
    return {"scene": one.number, **_compared_with_truth(one, found)} | {
        "seconds": found.seconds,
        "processor_seconds": time.process_time() - began,
        "frames": found.frames,
        "residual": found.residual,
        "not_determined": list(found.uncertainty.undetermined),
    }


def fitted_stranger(one: Case, image: NDArray[np.float32], adapter: str) -> JsonObject:
    """Return the estimates of a case whose oxygenation and epidermal thickness the fit assumes."""
    oxygen, epidermis_mm = DEFAULT_SKIN.oxygen, DEFAULT_SKIN.epidermis_mm
    look = replace(one.person.look, oxygen=oxygen, epidermis_mm=epidermis_mm)
    scene = replace(one.scene, head=replace(one.scene.head, maps=PaintedMaps(look=look)))
    given = _given(scene, Pigments(eumelanin=look.eumelanin))
    found = fit(image, given, side=_SMALL_SIDE, atlas=2 * _SMALL_SIDE, adapter=adapter)
    return {"scene": one.number, **_compared_with_truth(one, found)}


def _given(scene: Scene, pigments: Pigments) -> Scene:
    """Return what a fit is given of a scene: no light, and a usual surface with the given pigments."""
    skin = scene.skin.model_copy(update={"pigments": pigments, "roughness": 0.3, "rho_s": 0.5})
    return replace(scene, skin=skin, lights=(), environment=None)


def _compared_with_truth(one: Case, found: FitResult) -> JsonObject:
    figures: JsonObject = {}
    for name in ("melanin", "blood", "roughness"):
        true = float(getattr(one, name))
        figures[name] = {
            "true": true,
            "found": found.skin_values[name],
            "relative_sd": found.uncertainty.sd[name],
        }
    sun_direction = found.suns[0][0]
    figures["rho_s"] = found.skin_values["rho_s"]
    figures["sun_degrees"] = float(np.degrees(np.arccos(np.clip(sun_direction @ one.towards, -1.0, 1.0))))
    figures["sun_share"] = one.sun
    return figures


if __name__ == "__main__":
    run_script(main)
