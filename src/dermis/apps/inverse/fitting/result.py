"""Result of a fit: light and skin with their uncertainties, and the files in which it is saved."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.inputs import FitSubject
from dermis.apps.inverse.fitting.light_basis import AMBIENT_LOBE_COUNT, ambient_panorama
from dermis.apps.inverse.fitting.solve import Uncertainty
from dermis.apps.inverse.fitting.unknowns import (
    SKIN_UNKNOWNS,
    SUN_PRIOR_SD,
    WHITE_PRIOR_SD,
    FitUnknowns,
    sun_lights,
    with_skin,
)
from dermis.apps.inverse.unmixing.unknown_skin import FIXED_PARAMETERS
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.base.renamed import renamed_attribute
from dermis.human.person_file import write_person_json
from dermis.images.hdr import encode_exr
from dermis.images.io import write_image
from dermis.optics.media import Floats
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.saving import save_scene
from dermis.scene.settings import Settings

FIT_SUMMARY_FILE = "fit.json"
_ZERO_DIFFERENCE_GREY = 0.5


@dataclass(frozen=True, eq=False)
class FitResult:
    """Light and skin of a photograph, as found by `dermis.fit`.

    subject : head, person, camera and pose
    unknowns : fitted values of the skin parameters, of the directions towards the suns and of the light's
        colour
    strengths : (9 + k,) strengths of the ambient lobes and of the suns
    white : (3,) colour of the light in linear Rec. 709, scaled to green 1
    exposure : ratio of the photograph's linear values to the radiance [-]
    size : width and height of the photograph [pixel]
    uncertainty : standard deviations of the unknowns
    photo : (h, w, 3) photograph at the size of the fit, linear
    picture : (h, w, 3) fitted picture, linear, with the exposure and white balance of the photograph
    mask : (h, w) mask of the fitted pixels
    residual : median relative difference between photograph and fitted picture in the mask [-]
    frames : number of frames that were rendered
    seconds : duration of the fit [s]
    """

    subject: FitSubject
    unknowns: FitUnknowns
    strengths: Floats
    white: Floats
    exposure: float
    size: tuple[int, int]
    uncertainty: Uncertainty
    photo: Floats
    picture: Floats
    mask: NDArray[np.bool_]
    residual: float
    frames: int
    seconds: float
    certainty = renamed_attribute("certainty", "uncertainty")
    point = renamed_attribute("point", "unknowns")
    values = renamed_attribute("values", "skin_values")

    @property
    def skin_values(self) -> dict[str, float]:
        """Return the fitted skin as a dictionary with melanin, blood, roughness and rho_s [-]."""
        return self.unknowns.skin_values()

    @property
    def suns(self) -> list[tuple[Floats, float]]:
        """Return for each sun the unit vector towards it and its irradiance at normal incidence."""
        return list(zip(self.unknowns.suns, map(float, self.strengths[AMBIENT_LOBE_COUNT:]), strict=True))

    def summary(self) -> dict[str, Any]:
        """Return the content of fit.json: the fitted unknowns with their uncertainties and priors.

        Standard deviations are relative for the skin, and in degrees for directions. For melanin and blood,
        they include errors of the renderer and errors due to the assumed oxygen and epidermal thickness.
        """
        uncertainty, sd = self.uncertainty, self.uncertainty.sd
        skin = {}
        for one in SKIN_UNKNOWNS:
            prior = {"usual": one.prior_median, "believed_relative_sd": one.prior_sd}
            skin[one.name] = {"value": self.skin_values[one.name], "relative_sd": sd[one.name], **prior}
        suns = []
        for k, (direction, strength) in enumerate(self.suns):
            sd_degrees = np.degrees([sd[f"sun {k + 1} {name}"] for name in ("across", "along")])
            sun = {"towards": direction.tolist(), "irradiance": strength}
            suns.append(sun | {"sd_degrees": sd_degrees.tolist()})
        return {
            "skin": skin,
            "suns": suns,
            "around": {"mean_radiance": float(ambient_panorama(self.strengths[:AMBIENT_LOBE_COUNT]).mean())},
            "white": self.white.tolist(),
            "white_sd": [sd[name] for name in ("white red", "white blue") if name in sd],
            "exposure": self.exposure,
            "not_determined": list(uncertainty.undetermined),
            "not_told_apart": [{"pair": [a, b], "correlation": c} for a, b, c in uncertainty.correlated],
            "singular_values": list(uncertainty.singular_values),
            "priors": self._prior_descriptions(),
            "residual": self.residual,
            "pixels": int(self.mask.sum()),
            "frames": self.frames,
            "seconds": round(self.seconds, 2),
        }

    def _prior_descriptions(self) -> list[str]:
        """Return lines of text with the priors of the unknowns, and with the values of fixed parameters."""
        skin = self.subject.scene.skin.pigments
        assert skin is not None
        sun = f"directions of suns: within {np.degrees(SUN_PRIOR_SD):.0f} degrees of the initial guess"
        white = f"neutral within {100 * WHITE_PRIOR_SD:.0f} %"
        if "white red" not in self.uncertainty.sd:
            white = f"given, {', '.join(f'{one:.3g}' for one in self.white)}"
        assumed = [name for name in FIXED_PARAMETERS if name not in self.subject.known]
        spread = f"; assumed, with the spread of measured people: {', '.join(assumed)}" if assumed else ""
        fixed = f"eumelanin {skin.eumelanin:g}, oxygen {skin.oxygen:g}, epidermis {skin.epidermis_mm:g} mm"
        return [
            *(
                f"{u.name}: {u.prior_median:.2g} within a factor of {np.exp(u.prior_sd):.2g}"
                for u in SKIN_UNKNOWNS
            ),
            *([sun] if self.suns else []),
            f"colour of the light: {white}",
            f"exposure: given, {self.exposure:g}; the strength of the light is free",
            f"fixed: {fixed}{spread}",
        ]


def save_fit(folder: Path, fit_result: FitResult) -> list[Path]:
    """Write scene.toml with the files that it needs, fit.json, and pictures; return the paths of all files.

    Each file is written atomically.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    person, table = fit_result.subject.person, fit_result.subject.table
    if person is None and not table:
        actual = "got a head without a name or file"
        refuse("head", "a Human or a head with a name, for scene.toml", actual, "Fit the Human itself")
    written = []
    radiance = ambient_panorama(fit_result.strengths[:AMBIENT_LOBE_COUNT])
    if radiance.max() > 0.0:
        written.append(folder / "light.exr")
        with atomic_file(written[-1]) as file:
            file.write_bytes(encode_exr((radiance[..., None] * fit_result.white).astype(np.float32)))
    if person is not None:
        written.append(folder / "person.json")
        look = replace(
            person.look, melanin=fit_result.skin_values["melanin"], blood=fit_result.skin_values["blood"]
        )
        write_person_json(written[-1], replace(person, skin=look))
        table = {"name": "person.json"}
    written.append(folder / "scene.toml")
    settings = Settings(size=fit_result.size, exposure=fit_result.exposure)
    save_scene(written[-1], fitted_scene(fit_result, folder), settings, table)
    for name, image in result_pictures(fit_result).items():
        written.append(folder / f"{name}.png")
        write_image(written[-1], image)
    written.append(folder / FIT_SUMMARY_FILE)
    with atomic_file(written[-1]) as file:
        file.write_text(json.dumps(fit_result.summary(), indent=2) + "\n", encoding="utf-8")
    return written


def fitted_scene(fit_result: FitResult, folder: Path) -> Scene:
    """Return the scene with the fitted skin and lights, and with light.exr in `folder` as environment."""
    suns = sun_lights(fit_result.unknowns.suns, fit_result.strengths[AMBIENT_LOBE_COUNT:], fit_result.white)
    has_sky = ambient_panorama(fit_result.strengths[:AMBIENT_LOBE_COUNT]).max() > 0.0
    ambient = Environment(name=str(folder / "light.exr")) if has_sky else None
    lights = [one for one in suns if max(one.irradiance) > 0.0]
    return with_skin(
        replace(fit_result.subject.scene, lights=lights, environment=ambient), fit_result.unknowns
    )


def result_pictures(fit_result: FitResult) -> dict[str, Floats]:
    """Return a dictionary from name to linear picture: photograph, fitted picture, and their difference.

    The difference is grey where both are equal, and outside the mask.
    """
    peak = max(float(np.percentile(fit_result.photo[fit_result.mask], 99.5)), 1e-9)
    difference = np.where(fit_result.mask[..., None], (fit_result.photo - fit_result.picture) / peak, 0.0)
    pictures_by_name = {
        "photo": fit_result.photo / max(peak, 1.0),
        "fit": fit_result.picture / max(peak, 1.0),
    }
    pictures_by_name = {name: np.clip(image, 0.0, 1.0) for name, image in pictures_by_name.items()}
    return pictures_by_name | {"difference": np.clip(_ZERO_DIFFERENCE_GREY + difference, 0.0, 1.0) ** 2.2}
