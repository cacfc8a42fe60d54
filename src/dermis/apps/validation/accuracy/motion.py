"""Posed heads against heads loaded in the same shape: docs/motion.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.validation.accuracy import blur
from dermis.apps.validation.pages import DOCS, data_file, fill_page, in_checkout, use_tests_folder
from dermis.atlas.build import cached_atlas
from dermis.formats.maps import load_maps
from dermis.frame.features.occlusion.baked import bake_occlusion
from dermis.frame.renderer import Renderer
from dermis.gpu import Texture, download
from dermis.human.expressions import expression
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.mesh import build_mesh
from dermis.mesh.pose import Pose
from dermis.scene import Environment, Scene, Settings
from dermis.scene.files import load_camera, load_lights

Points = NDArray[np.float32]
Open = NDArray[np.float64]
PAGE = DOCS / "motion.md"
SKIN = "heads/makehuman/skins/young_lightskinned_male_diffuse.png"
PEOPLE = {
    "old man": Human(1, 0, 0, sex=1, age=90),
    "young woman": Human(0, 1, 0, age=25),
    "heavy man": Human(0, 0, 1, sex=1, age=25, weight=1),
}
EXPRESSIONS: dict[str, dict[str, float]] = {
    "open jaw": expression("open-jaw"),
    "smile": expression("full-smile"),
    "blink": expression("closed-eyes"),
    "pucker": expression("full-pucker"),
    "frown": expression("full-frown"),
    "surprise": expression("full-surprise"),
    "sneer": expression("full-sneer"),
    "puffed cheeks": expression("full-puff"),
    "jaw aside": expression("jaw-aside"),
    "wink": expression("wink"),
}
VIEWS = {"front": ("studio", "portrait"), "back": ("rim", "ear")}
SETTINGS = Settings(size=(384, 384), atlas=1024, samples=4)
SIDE = 512
BAKED = Settings(size=(16, 16), atlas=SIDE, samples=1)
_TRUTH = 1024  # directions, and texels along the side of their depth maps
_CHANGED = 0.02


def motion(adapter: str = "auto") -> None:
    """Compare posed heads with heads loaded in the same shape and write docs/motion.md, in some minutes.

    Needs the published heads of MakeHuman in DERMIS_DATA, and the folder tests of a checkout.
    """
    in_checkout(PAGE)
    use_tests_folder()
    renderer = dermis.Renderer(adapter)
    head = Human(age=25).head(load_maps(colour=data_file(SKIN)), "hm08", 0)
    people = {name: person.positions_mm for name, person in PEOPLE.items()}
    fill_page(
        PAGE,
        expressions="\n".join(expressions(renderer, head, people)),
        seams="\n".join(seams(renderer, head, people)),
        occlusions="\n".join(occlusions(renderer, head)),
        adapter=renderer.device.adapter.name,
    )


def rebuilt(head: Head, points: Points) -> Head:
    """Return the head as if it had been loaded in this shape."""
    mesh = head.mesh
    places, kinds = points[mesh.point], (mesh.material, mesh.materials)
    made = build_mesh(places, mesh.uv, mesh.triangles, *kinds, point=mesh.point, quads=mesh.quads)
    return Head("rebuilt", made, head.maps)


def moved(head: Head, person: Points, weights: Mapping[str, float]) -> Points:
    """Return the points of a person with an expression."""
    motion = Pose(weights, positions_mm=person).motion(head.control)
    return head.control.points_mm(motion).astype(np.float32)


def picture_error(
    renderer: Renderer, head: Head, person: Points, weights: Mapping[str, float], view: str
) -> float:
    """Return the relative RMSE of the posed head's picture from that of the rebuilt head."""
    other = rebuilt(head, moved(head, person, weights))
    lights, camera = VIEWS[view]
    scene = Scene(other, load_lights(lights), load_camera(camera, other))
    here = replace(head)
    vars(here)["centre_mm"] = other.centre_mm  # which lights and cameras stand around
    pose = Pose(weights, positions_mm=person)
    posed = renderer.draw(replace(scene, head=here, pose=pose), SETTINGS).linear()
    truth = renderer.draw(scene, SETTINGS).linear()
    return float(np.sqrt(((posed - truth) ** 2).mean() / (truth**2).mean()))


def expressions(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
    """Yield lines of the table of expressions: the worst person from the front and from behind."""
    worst = dict.fromkeys(VIEWS, 0.0)
    for name, weights in EXPRESSIONS.items():
        found = {
            view: max(picture_error(renderer, head, person, weights, view) for person in people.values())
            for view in VIEWS
        }
        worst = {view: max(worst[view], found[view]) for view in VIEWS}
        yield f"| {name} | {100 * found['front']:.2f} | {100 * found['back']:.2f} |"
    yield f"| **worst** | **{100 * worst['front']:.2f}** | **{100 * worst['back']:.2f}** |"


def seams(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
    """Yield lines of the table of seams: at rest, in expressions, and of other people, posed and rebuilt."""
    resting = head.positions_mm
    yield _jumps(renderer, "at rest", head, head, None)
    for name in ("open jaw", "smile", "puffed cheeks"):
        shape = rebuilt(head, moved(head, resting, EXPRESSIONS[name]))
        yield _jumps(renderer, name, head, shape, Pose(EXPRESSIONS[name]))
    for name, person in people.items():
        shape = rebuilt(head, person)
        yield _jumps(renderer, f"{name}, by positions", head, shape, Pose(positions_mm=person))
        yield _jumps(renderer, f"{name}, built anew", shape, shape, None)


def _jumps(renderer: Renderer, name: str, head: Head, shape: Head, pose: Pose | None) -> str:
    """Return a line: jumps of light across the seams of a posed head; `shape` has the places of its seams."""
    cells = []
    for where in (blur.at_neck, blur.behind):
        sides = blur.judged(shape, where)
        scene = replace(blur.banded(head), pose=pose)
        vars(scene.head)["centre_mm"] = shape.centre_mm  # which the bands of light stand around
        found = blur.jumps(renderer, scene, "stitch", blur.HEAD_SIDE, *sides)
        cells.append(f"{100 * found.mean():.1f} / {100 * np.percentile(found, 95):.1f}")
    return f"| {name} | {' | '.join(cells)} |"


def occlusions(renderer: Renderer, head: Head) -> Iterator[str]:
    """Yield lines of the table of ambient occlusion."""
    neck = dict.fromkeys(("neck01", "neck02", "neck03", "head"), (0.0, 15.0, 0.0))
    poses = {name: Pose(EXPRESSIONS[name]) for name in ("open jaw", "smile", "blink", "pucker", "surprise")}
    poses["head turned by 60 degrees"] = Pose(bones=neck)
    shapes = {
        name: (pose, rebuilt(head, head.control.points_mm(pose.motion(head.control)).astype(np.float32)))
        for name, pose in poses.items()
    }
    yield from occlusion_rows(renderer, head, shapes)


def occlusion_rows(renderer: Renderer, head: Head, shapes: Mapping[str, tuple[Pose, Head]]) -> Iterator[str]:
    """Yield lines of RMS errors: over all texels, and over those whose truth differs from that at rest.

    shapes : poses by name, each with the head rebuilt in it
    """
    scene, fine = Scene(head, environment=Environment(name="uniform")), (_TRUTH, _TRUTH)
    rest = baked(renderer, head, head, *fine)
    for name, (pose, shape) in shapes.items():
        truth, posed = baked(renderer, head, shape, *fine), replace(scene, pose=pose)
        made = [followed(renderer, posed, which) for which in ("rest", "baked")] + [
            baked(renderer, head, shape)
        ]
        own = np.isfinite(truth) & np.isfinite(rest)
        changed = own & (np.abs(np.where(own, truth - rest, 0.0)) > _CHANGED)
        cells = [f"{rms((one - truth)[own]):.3f} / {rms((one - truth)[changed]):.3f}" for one in made]
        yield f"| {name} | {changed.sum() / own.sum():.1%} | {' | '.join(cells)} |"


def baked(renderer: Renderer, head: Head, shape: Head, *exactness: int) -> Open:
    """Return (n, n) open shares of the head in another shape on its atlas, NaN where there is no surface.

    exactness : number of directions and side of depth maps, those of frames when left out
    """
    inputs = renderer.prepare(Scene(head), BAKED)
    texels, atlas = inputs.layouts[0].atlas.resources["atlas"], cached_atlas(head.mesh, SIDE, "stitched")
    made = bake_occlusion(renderer.device, shape, atlas, inputs.bindings, texels, SIDE, *exactness)
    return made[:SIDE].astype(float)


def followed(renderer: Renderer, scene: Scene, which: str) -> Open:
    """Return (n, n) open shares that a frame of the scene reads."""
    settings = BAKED.model_copy(update={"occlusion": which})
    renderer.draw(scene, settings)
    made = cast(Texture, renderer.prepare(scene, settings).bindings["occlusion_map"])
    return download(renderer.device, made)[:SIDE].astype(float)


def rms(error: Open) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))
