"""How well light and skin of path-traced faces are found: python benchmarks/fitting.py [--side 256]

Traces what is not kept on disk yet, fits each, and writes the figures after each scene; `unmixing_page.py`
puts them into docs/fit.md. With `--own` so many pictures are the renderer's own besides.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from fitting_scenes import SCENES, Case, case, photograph
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.fit import fit
from dermis.apps.inverse.fitting.fitted import Fitted
from dermis.apps.validation.pages import write_figures
from dermis.frame.renderer import Renderer
from dermis.scene.settings import Settings
from dermis.scene.skin import Pigments

RESULTS = Path(__file__).parent / "results" / "fitting.json"
_NO_LIMIT = 1e9
"""Noise of paths has long tails, which a robust loss would take for highlights to be left out."""


def main(words: list[str]) -> int:
    """Trace, fit, and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("-o", "--output", type=Path, default=RESULTS)
    parser.add_argument("--adapter", default="auto")
    parser.add_argument("--side", type=int, default=256)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--scenes", type=int, default=SCENES)
    parser.add_argument("--variant", default="scalar_rgb", help="of Mitsuba, such as cuda_ad_rgb")
    parser.add_argument("--own", type=int, default=3, help="scenes that are rendered by ourselves too")
    asked = parser.parse_args(words)
    renderer = Renderer(asked.adapter)
    told: dict[str, Any] = {"side": asked.side, "samples": asked.samples}
    told |= {"adapter": renderer.device.adapter.name, "traced": [], "own": []}
    for number in range(asked.scenes):
        one = case(number)
        if number < asked.own:
            settings = Settings(size=(asked.side, asked.side), atlas=512, strands=False)
            told["own"].append(fitted(one, renderer.draw(one.scene, settings).linear(), asked.adapter))
        image = photograph(renderer, one, asked.side, asked.samples, asked.variant).image
        told["traced"].append(fitted(one, image, asked.adapter))
        sys.stdout.write(f"{told['traced'][-1]}\n")
        sys.stdout.flush()
        write_figures(asked.output, told, 4)
    return 0


def fitted(one: Case, image: NDArray[np.float32], adapter: str) -> dict[str, Any]:
    """What is found of a case, beside what is true; nothing of the true skin is given but its eumelanin, its
    oxygen and the kind of its surface.
    """
    began = time.process_time()
    held = Pigments(eumelanin=one.person.look.eumelanin, oxygen=one.person.look.oxygen)
    skin = one.scene.skin.model_copy(update={"pigments": held, "roughness": 0.3, "rho_s": 0.5})
    given = replace(one.scene, skin=skin, lights=(), environment=None)
    found = fit(image, given, robust=_NO_LIMIT, adapter=adapter)
    return {"scene": one.number, **_against(one, found)} | {
        "seconds": found.seconds,
        "processor_seconds": time.process_time() - began,
        "frames": found.frames,
        "residual": found.residual,
        "not_determined": list(found.certainty.held),
    }


def _against(one: Case, found: Fitted) -> dict[str, Any]:
    told: dict[str, Any] = {}
    for name in ("melanin", "blood", "roughness"):
        true = float(getattr(one, name))
        told[name] = {"true": true, "found": found.values[name], "relative_sd": found.certainty.sd[name]}
    way = found.suns[0][0]
    told["rho_s"] = found.values["rho_s"]
    told["sun_degrees"] = float(np.degrees(np.arccos(np.clip(way @ one.towards, -1.0, 1.0))))
    told["sun_share"] = one.sun
    return told


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
