"""Posed heads against heads loaded in the same shape: docs/motion.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.validation.accuracy import blur
from dermis.apps.validation.pages import DOCS, data_file, fill_page, require_in_checkout, add_tests_to_path
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
Floats = NDArray[np.float64]
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
BAKE_SETTINGS = Settings(size=(16, 16), atlas=SIDE, samples=1)
_REFERENCE_SIZE = 1024  # directions, and texels along the side of their depth maps
_MIN_CHANGE = 0.02


def motion(adapter: str = "auto") -> None:
    """Compare posed heads with heads loaded in the same shape and write docs/motion.md, in some minutes.

    Needs the published heads of MakeHuman in DERMIS_DATA, and the folder tests of a checkout.
    """
    require_in_checkout(PAGE)
    add_tests_to_path()
    renderer = dermis.Renderer(adapter)
    head = Human(age=25).head(load_maps(colour=data_file(SKIN)), "hm08", 0)
    people = {name: person.positions_mm for name, person in PEOPLE.items()}
    fill_page(
        PAGE,
        expressions="\n".join(expression_rows(renderer, head, people)),
        seams="\n".join(seam_rows(renderer, head, people)),
        occlusions="\n".join(occlusion_table(renderer, head)),
        adapter=renderer.device.adapter.name,
    )


def rebuilt_head(head: Head, points: Points) -> Head:
    """Return the head as if it had been loaded in this shape."""
    mesh = head.mesh
    places, kinds = points[mesh.point], (mesh.material, mesh.materials)
    made = build_mesh(places, mesh.uv, mesh.triangles, *kinds, point=mesh.point, quads=mesh.quads)
    return Head("rebuilt", made, head.maps)


def posed_points(head: Head, person: Points, weights: Mapping[str, float]) -> Points:
    """Return the points of a person with an expression."""
    motion = Pose(weights, positions_mm=person).motion(head.control)
    return head.control.points_mm(motion).astype(np.float32)


def picture_error(
    renderer: Renderer, head: Head, person: Points, weights: Mapping[str, float], view: str
) -> float:
    """Return the relative RMSE of the posed head's picture from that of the rebuilt head."""
    other = rebuilt_head(head, posed_points(head, person, weights))
    lights, camera = VIEWS[view]
    scene = Scene(other, load_lights(lights), load_camera(camera, other))
    here = replace(head)
    vars(here)["centre_mm"] = other.centre_mm  # which lights and cameras stand around
    pose = Pose(weights, positions_mm=person)
    posed = renderer.draw(replace(scene, head=here, pose=pose), SETTINGS).linear()
    truth = renderer.draw(scene, SETTINGS).linear()
    return float(np.sqrt(((posed - truth) ** 2).mean() / (truth**2).mean()))


def expression_rows(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
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


def seam_rows(renderer: Renderer, head: Head, people: Mapping[str, Points]) -> Iterator[str]:
    """Yield lines of the table of seams: at rest, in expressions, and of other people, posed and rebuilt."""
    resting = head.positions_mm
    yield _seam_row(renderer, "at rest", head, head, None)
    for name in ("open jaw", "smile", "puffed cheeks"):
        shape = rebuilt_head(head, posed_points(head, resting, EXPRESSIONS[name]))
        yield _seam_row(renderer, name, head, shape, Pose(EXPRESSIONS[name]))
    for name, person in people.items():
        shape = rebuilt_head(head, person)
        yield _seam_row(renderer, f"{name}, by positions", head, shape, Pose(positions_mm=person))
        yield _seam_row(renderer, f"{name}, built anew", shape, shape, None)


def _seam_row(renderer: Renderer, name: str, head: Head, shape: Head, pose: Pose | None) -> str:
    """Return a line: jumps of light across the seams of a posed head; `shape` has the places of its seams."""
    cells = []
    for where in (blur.neck_points, blur.back_points):
        sides = blur.seam_sides(shape, where)
        scene = replace(blur.striped_scene(head), pose=pose)
        vars(scene.head)["centre_mm"] = shape.centre_mm  # which the bands of light stand around
        found = blur.seam_jumps(renderer, scene, "stitch", blur.HEAD_SIDE, *sides)
        cells.append(f"{100 * found.mean():.1f} / {100 * np.percentile(found, 95):.1f}")
    return f"| {name} | {' | '.join(cells)} |"


def occlusion_table(renderer: Renderer, head: Head) -> Iterator[str]:
    """Yield lines of the table of ambient occlusion."""
    neck = dict.fromkeys(("neck01", "neck02", "neck03", "head"), (0.0, 15.0, 0.0))
    poses = {name: Pose(EXPRESSIONS[name]) for name in ("open jaw", "smile", "blink", "pucker", "surprise")}
    poses["head turned by 60 degrees"] = Pose(bones=neck)
    shapes = {
        name: (pose, rebuilt_head(head, head.control.points_mm(pose.motion(head.control)).astype(np.float32)))
        for name, pose in poses.items()
    }
    yield from occlusion_rows(renderer, head, shapes)


def occlusion_rows(renderer: Renderer, head: Head, shapes: Mapping[str, tuple[Pose, Head]]) -> Iterator[str]:
    """Yield lines of RMS errors: over all texels, and over those whose truth differs from that at rest.

    shapes : poses by name, each with the head rebuilt in it
    """
    scene, fine = Scene(head, environment=Environment(name="uniform")), (_REFERENCE_SIZE, _REFERENCE_SIZE)
    rest = baked_occlusion(renderer, head, head, *fine)
    for name, (pose, shape) in shapes.items():
        truth, posed = baked_occlusion(renderer, head, shape, *fine), replace(scene, pose=pose)
        made = [frame_occlusion(renderer, posed, which) for which in ("rest", "baked")] + [
            baked_occlusion(renderer, head, shape)
        ]
        own = np.isfinite(truth) & np.isfinite(rest)
        changed = own & (np.abs(np.where(own, truth - rest, 0.0)) > _MIN_CHANGE)
        cells = [f"{rms((one - truth)[own]):.3f} / {rms((one - truth)[changed]):.3f}" for one in made]
        yield f"| {name} | {changed.sum() / own.sum():.1%} | {' | '.join(cells)} |"


def baked_occlusion(renderer: Renderer, head: Head, shape: Head, *exactness: int) -> Floats:
    """Return (n, n) open shares of the head in another shape on its atlas, NaN where there is no surface.

    exactness : number of directions and side of depth maps, those of frames when left out
    """
    inputs = renderer.prepare(Scene(head), BAKE_SETTINGS)
    texels, atlas = inputs.layouts[0].atlas.resources["atlas"], cached_atlas(head.mesh, SIDE, "stitched")
    made = bake_occlusion(renderer.device, shape, atlas, inputs.bindings, texels, SIDE, *exactness)
    return made[:SIDE].astype(float)


def frame_occlusion(renderer: Renderer, scene: Scene, which: str) -> Floats:
    """Return (n, n) open shares that a frame of the scene reads."""
    settings = BAKE_SETTINGS.model_copy(update={"occlusion": which})
    renderer.draw(scene, settings)
    made = cast(Texture, renderer.prepare(scene, settings).bindings["occlusion_map"])
    return download(renderer.device, made)[:SIDE].astype(float)


def rms(error: Floats) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(error**2)))
