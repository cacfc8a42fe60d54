"""Count how often a network recognises the expressions of sampled people, and print the confusion matrix.

NODE_MODULES is the folder filled by `npm install @vladmandic/face-api @tensorflow/tfjs
@tensorflow/tfjs-backend-wasm`; node runs the networks.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.base.command_line import run_script
from dermis.frame.renderer import Renderer
from dermis.human.expressions import expression
from dermis.human.person import Human
from dermis.scene import Camera, Scene, Settings
from dermis.scene.people import skin_of
from dermis.scene.settings import PHOTOGRAPHIC_SETTINGS

EMOTIONS = {
    "neutral": "neutral",
    "joy": "happy",
    "sadness": "sad",
    "anger": "angry",
    "fear": "fearful",
    "disgust": "disgusted",
    "surprise": "surprised",
}
"""Names of expressions in dermis, and the corresponding names in the network."""
SCRIPT = Path(__file__).with_name("face_expressions.mjs")
NO_FACE = "no face"
Picture = NDArray[np.uint8]


def render_portraits(renderer: Renderer, seed: int, names: Iterable[str], side: int) -> list[Picture]:
    """Render pictures (side, side, 3) of a sampled person from the front, one for each named expression."""
    person = Human.sampled(seed)
    head, camera = person.head(), Camera(position=(0, 0, 1400), target=(0, -5, 0), frame_mm=250)
    settings = Settings(size=(side, side), atlas=512, **PHOTOGRAPHIC_SETTINGS)
    scenes = (
        Scene(head, lights="portrait", camera=camera, skin=skin_of(person), pose=expression(name))
        for name in names
    )
    return [renderer.draw(scene, settings).srgb8() for scene in scenes]


def recognised_expressions(node_modules: Path, pictures: Sequence[Picture]) -> list[str]:
    """Return the most probable expression in each picture, as named by the network, or `NO_FACE`."""
    with tempfile.TemporaryDirectory() as folder:
        listed = []
        for number, picture in enumerate(pictures):
            path = Path(folder) / f"{number}.rgb"
            path.write_bytes(np.ascontiguousarray(picture[..., :3]).tobytes())
            listed.append({"path": str(path), "width": picture.shape[1], "height": picture.shape[0]})
        command = ["node", str(SCRIPT), str(node_modules)]
        ran = subprocess.run(command, input=json.dumps(listed), capture_output=True, text=True, check=True)
    found = json.loads(ran.stdout)
    return [NO_FACE if one is None else max(one["expressions"], key=one["expressions"].get) for one in found]


def main(node_modules: Path, *, people: int = 10, side: int = 256, adapter: str = "auto") -> None:
    """Render seven expressions of people, and print the confusion matrix of the network.

    Parameters
    ----------
    node_modules:
        Folder with the npm packages.
    people:
        Number of people, with seeds from 0.
    side:
        Width and height of the pictures [pixel].
    """
    renderer, counts = Renderer(adapter), Counter[tuple[str, str]]()
    for seed in range(people):
        words = recognised_expressions(node_modules, render_portraits(renderer, seed, EMOTIONS, side))
        counts.update(zip(EMOTIONS, words, strict=True))
    columns = [*EMOTIONS.values(), NO_FACE]
    sys.stdout.write(" ".join([f"{'':9}", *(f"{column:>9}" for column in columns)]) + "\n")
    for name in EMOTIONS:
        numbers = (f"{counts[name, column]:9}" for column in columns)
        sys.stdout.write(" ".join([f"{name:9}", *numbers]) + "\n")


if __name__ == "__main__":
    run_script(main)
