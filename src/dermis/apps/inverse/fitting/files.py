"""A fit as files in a folder: the scene, its light, the table and pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting import sky
from dermis.apps.inverse.fitting.fitted import Fitted
from dermis.apps.inverse.fitting.unknowns import skinned, suns_of
from dermis.base.atomic_write import replacing
from dermis.base.errors import refuse
from dermis.human.person_file import write_numbers
from dermis.images.hdr import encode_exr
from dermis.images.io import write_image
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.saving import save_scene
from dermis.scene.settings import Settings

SUMMARY = "fit.json"
_GREY = 0.5


def save(folder: Path, found: Fitted) -> list[Path]:
    """Write scene.toml with what it needs, fit.json, and pictures; each file whole or not at all.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    table = found.subject.table
    if found.subject.person is None and not table:
        came = "it came as a head that only its maker knows"
        refuse("head", "a person by name, or a Human, for a file to name", came, "Fit the Human itself")
    written = []
    if _has_sky(found):
        written.append(folder / "light.exr")
        _write_light(written[-1], found)
    if found.subject.person is not None:
        written.append(folder / "person.json")
        look = found.subject.person.look
        look = replace(look, melanin=found.values["melanin"], blood=found.values["blood"])
        write_numbers(written[-1], replace(found.subject.person, skin=look))
        table = {"name": "person.json"}
    written.append(folder / "scene.toml")
    settings = Settings(size=found.size, exposure=found.exposure)
    save_scene(written[-1], scene_of(found, folder), settings, table)
    for name, image in pictures(found).items():
        written.append(folder / f"{name}.png")
        write_image(written[-1], image)
    written.append(folder / SUMMARY)
    with replacing(written[-1]) as trial:
        trial.write_text(json.dumps(found.summary(), indent=2) + "\n", encoding="utf-8")
    return written


def scene_of(found: Fitted, folder: Path) -> Scene:
    """The scene as found; its light from around is a file of the folder."""
    lights = suns_of(found.point.suns, found.strengths[sky.BASIS :], found.white)
    lights = [one for one in lights if max(one.irradiance) > 0.0]
    path = folder / "light.exr"
    around = Environment(name=str(path)) if _has_sky(found) else None
    return skinned(replace(found.subject.scene, lights=lights, environment=around), found.point)


def pictures(found: Fitted) -> dict[str, NDArray[np.float64]]:
    """Linear pictures: photograph, fit, and their difference on grey where skin counted."""
    peak = max(float(np.percentile(found.photo[found.mask], 99.5)), 1e-9)
    off = np.where(found.mask[..., None], (found.photo - found.picture) / peak, 0.0)
    shown = {"photo": found.photo / max(peak, 1.0), "fit": found.picture / max(peak, 1.0)}
    return {name: np.clip(image, 0.0, 1.0) for name, image in shown.items()} | {
        "difference": np.clip(_GREY + off, 0.0, 1.0) ** 2.2
    }


def _has_sky(found: Fitted) -> bool:
    return bool(sky.panorama(found.strengths[: sky.BASIS]).max() > 0.0)


def _write_light(path: Path, found: Fitted) -> None:
    radiance = sky.panorama(found.strengths[: sky.BASIS])[..., None] * found.white
    with replacing(path) as trial:
        trial.write_bytes(encode_exr(radiance.astype(np.float32)))
