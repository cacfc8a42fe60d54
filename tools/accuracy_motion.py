"""Heads that move against heads built anew in the same shape: writes docs/motion.md from docs/motion.in.md.

Needs DERMIS_DATA with heads/makehuman; takes some minutes on two cores.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import accuracy_occlusion as occlusion
import accuracy_surface as surface
import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.frame.renderer import Renderer
from dermis.human.person import Human
from dermis.mesh.geometry import build_mesh
from dermis.mesh.head import Head
from dermis.mesh.maps import load_maps
from dermis.scene import Pose, Scene, Settings
from dermis.scene.files import load_camera, load_lights

Points = NDArray[np.float32]
PAGE = Path(__file__).parent.parent / "docs" / "motion.md"
DATA = Path(os.environ.get("DERMIS_DATA", "../shared"))
SKIN = DATA / "heads" / "makehuman" / "skins" / "young_lightskinned_male_diffuse.png"
PEOPLE = {
    "old man": Human(1, 0, 0, sex=1, age=90),
    "young woman": Human(0, 1, 0, age=25),
    "heavy man": Human(0, 0, 1, sex=1, age=25, weight=1),
}
EXPRESSIONS: dict[str, dict[str, float]] = {
    "open jaw": {"jawOpen": 0.8},
    "smile": {"mouthSmileLeft": 1, "mouthSmileRight": 1, "cheekSquintLeft": 0.7, "cheekSquintRight": 0.7},
    "blink": {"eyeBlinkLeft": 1, "eyeBlinkRight": 1},
    "pucker": {"mouthPucker": 1, "mouthFunnel": 0.3},
    "frown": {"mouthFrownLeft": 1, "mouthFrownRight": 1, "browDownLeft": 1, "browDownRight": 1},
    "surprise": {"browInnerUp": 1, "eyeWideLeft": 1, "eyeWideRight": 1, "jawOpen": 0.4},
    "sneer": {"noseSneerLeft": 1, "noseSneerRight": 1, "mouthUpperUpLeft": 0.8, "mouthUpperUpRight": 0.8},
    "puffed cheeks": {"cheekPuff": 1, "mouthClose": 0.2},
    "jaw aside": {"jawLeft": 0.8, "jawOpen": 0.2, "mouthLeft": 0.5},
    "wink": {"eyeBlinkLeft": 1, "mouthSmileLeft": 0.6, "cheekSquintLeft": 1},
}
VIEWS = {"front": ("studio", "portrait"), "back": ("rim", "ear")}
SETTINGS = Settings(size=(384, 384), atlas=1024, samples=4)


def anew(head: Head, points: Points) -> Head:
    """A head as if a file had it in this shape."""
    mesh = head.mesh
    places, kinds = points[mesh.point], (mesh.material, mesh.materials)
    made = build_mesh(places, mesh.uv, mesh.triangles, *kinds, point=mesh.point, quads=mesh.quads)
    return Head("anew", made, head.maps)


def moved(head: Head, person: Points, weights: Mapping[str, float]) -> Points:
    """The points of a person with an expression."""
    motion = Pose(weights, positions_mm=person).motion(head.control)
    return head.control.points_mm(motion).astype(np.float32)


def error(renderer: Renderer, head: Head, person: Points, weights: Mapping[str, float], view: str) -> float:
    """Relative RMSE of the posed head's picture from that of the head built anew."""
    other = anew(head, moved(head, person, weights))
    lights, camera = VIEWS[view]
    scene = Scene(other, load_lights(lights), load_camera(camera, other))
    here = replace(head)
    vars(here)["centre_mm"] = other.centre_mm  # which lights and cameras stand around
    pose = Pose(weights, positions_mm=person)
    posed = renderer.draw(replace(scene, head=here, pose=pose), SETTINGS).linear()
    truth = renderer.draw(scene, SETTINGS).linear()
    return float(np.sqrt(((posed - truth) ** 2).mean() / (truth**2).mean()))


def expressions(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
    """Lines of the table of expressions: the worst person from the front and from behind."""
    worst = dict.fromkeys(VIEWS, 0.0)
    for name, weights in EXPRESSIONS.items():
        found = {
            view: max(error(renderer, head, person, weights, view) for person in people.values())
            for view in VIEWS
        }
        worst = {view: max(worst[view], found[view]) for view in VIEWS}
        yield f"| {name} | {100 * found['front']:.2f} | {100 * found['back']:.2f} |"
    yield f"| **worst** | **{100 * worst['front']:.2f}** | **{100 * worst['back']:.2f}** |"


def seams(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
    """Lines of the table of seams: at rest, in expressions, and other people beside themselves built anew."""
    resting = head.positions_mm
    yield _jumps(renderer, "at rest", head, head, None)
    for name in ("open jaw", "smile", "puffed cheeks"):
        shape = anew(head, moved(head, resting, EXPRESSIONS[name]))
        yield _jumps(renderer, name, head, shape, Pose(EXPRESSIONS[name]))
    for name, person in people.items():
        shape = anew(head, person)
        yield _jumps(renderer, f"{name}, by positions", head, shape, Pose(positions_mm=person))
        yield _jumps(renderer, f"{name}, built anew", shape, shape, None)


def _jumps(renderer: Renderer, name: str, head: Head, shape: Head, pose: Pose | None) -> str:
    """Jump of the light across seams of a head in a pose; `shape` has the places of its seams."""
    cells = []
    for where in (surface.at_neck, surface.behind):
        sides = surface.judged(shape, where)
        scene = replace(surface.banded(head), pose=pose)
        vars(scene.head)["centre_mm"] = shape.centre_mm  # which the bands of light stand around
        found = surface.jumps(renderer, scene, "stitch", surface.HEAD_SIDE, *sides)
        cells.append(f"{100 * found.mean():.1f} / {100 * np.percentile(found, 95):.1f}")
    return f"| {name} | {' | '.join(cells)} |"


def occlusions(renderer: Renderer, head: Head) -> Iterator[str]:
    """Lines of the table of ambient occlusion."""
    neck = dict.fromkeys(("neck01", "neck02", "neck03", "head"), (0.0, 15.0, 0.0))
    poses = {name: Pose(EXPRESSIONS[name]) for name in ("open jaw", "smile", "blink", "pucker", "surprise")}
    poses["head turned by 60 degrees"] = Pose(bones=neck)
    shapes = {
        name: (pose, anew(head, head.control.points_mm(pose.motion(head.control)).astype(np.float32)))
        for name, pose in poses.items()
    }
    yield from occlusion.lines(renderer, head, shapes)


def main() -> None:
    """Measure and write the page."""
    renderer = dermis.Renderer(sys.argv[1] if len(sys.argv) > 1 else "auto")
    head = Human(age=25).head(load_maps(colour=SKIN), "hm08", 0)
    people = {name: person.positions_mm for name, person in PEOPLE.items()}
    text = PAGE.with_suffix(".in.md").read_text(encoding="utf-8")
    tables = {
        "expressions": "\n".join(expressions(renderer, head, people)),
        "seams": "\n".join(seams(renderer, head, people)),
        "occlusions": "\n".join(occlusions(renderer, head)),
    }
    PAGE.write_text(text.format(adapter=renderer.device.adapter.name, **tables), encoding="utf-8")


if __name__ == "__main__":
    main()
