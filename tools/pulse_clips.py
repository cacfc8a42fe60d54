"""Render clips of people with a pulse for detectors of the heart rate (`tools/pulse_rates.py`)."""

from __future__ import annotations

import bz2
import json
from pathlib import Path

import numpy as np

from dermis.base.command_line import run_script
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.images.colour import encode_srgb
from dermis.scene import Camera, Scene, Settings
from dermis.scene.people import skin_of
from dermis.scene.pulse import Pulse
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

LEVELS = 4095
ITA_RANGE_DEG = 55.0, -45.0
RATE_RANGE_PER_MIN = 52.0, 112.0
CAMERA = Camera(position=(0, 0, 1400), target=(0, -5, 0), frame_mm=250)


def main(
    folder: Path,
    /,
    *,
    people: int = 10,
    first: int = 0,
    step: int = 1,
    seconds: float = 30,
    rate_hz: float = 30,
    side: int = 128,
    amplitude: float = 0.02,
) -> None:
    """Render clips of people with a pulse, from light to dark skin, in the light of a studio.

    Writes NUMBER.json (rate, skin tone, size) and NUMBER.bz2 (sRGB pictures of 12 bits as differences to the
    previous picture, compressed).

    Parameters
    ----------
    folder:
        Folder to write to; it is created.
    people:
        Number of clips, one for each person.
    first:
        Number of the first clip that this process renders.
    step:
        Difference between the numbers of the clips that this process renders.
    seconds:
        Duration of a clip [s].
    rate_hz:
        Pictures in a second.
    side:
        Width and height of the pictures [pixel].
    amplitude:
        Relative change of the blood volume, peak to peak.
    """
    folder.mkdir(parents=True, exist_ok=True)
    renderer = Renderer()
    settings = Settings(size=(side, side), atlas=512, **PHOTOGRAPHIC_SETTINGS)
    for number in range(first, people, step):
        place = number / max(people - 1, 1)
        ita_deg = float(np.interp(place, (0, 1), ITA_RANGE_DEG))
        person = Human.sampled(number + 1, ita=ita_deg, hair={"style": "cropped"})
        other = (3 * number) % people / max(people - 1, 1)  # so that rates do not follow tones
        rate_per_min = float(np.interp(other, (0, 1), RATE_RANGE_PER_MIN))
        scene = Scene(person.head(), lights="studio", camera=CAMERA, skin=skin_of(person))
        pulse = Pulse(rate_per_min=rate_per_min, amplitude=amplitude, variability_ms=20, seed=number)
        count = round(seconds * rate_hz)
        metered = {**dict(settings), "exposure": renderer.draw(scene, settings).exposure}
        packer, before = bz2.BZ2Compressor(), np.zeros((side, side, 3), np.int16)
        with (folder / f"{number}.bz2").open("wb") as file:
            scenes = (pulse.scene_at(scene, k / rate_hz) for k in range(count))
            for picture in renderer.render_many(scenes, linear=True, **metered):
                levels = np.rint(LEVELS * encode_srgb(np.clip(picture, 0, 1))).astype(np.int16)
                file.write(packer.compress((levels - before).tobytes()))
                before = levels
            file.write(packer.flush())
        record = {"rate_per_min": rate_per_min, "ita_deg": ita_deg, "rate_hz": rate_hz}
        shape = {"shape": [count, side, side, 3]}
        (folder / f"{number}.json").write_text(json.dumps(record | shape))


if __name__ == "__main__":
    run_script(main)
