"""Errors of posed heads, for docs/motion.md.

The reference for a posed head is a rebuilt head: one whose mesh has the posed shape at rest, without a pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.apps.validation.accuracy import blur
from dermis.apps.validation.pages import DOCS, add_tests_to_path, data_file, fill_page, require_in_checkout
from dermis.atlas.build import cached_atlas
from dermis.formats.maps import load_maps
from dermis.frame.features.occlusion.baked import bake_occlusion
from dermis.frame.features.translucency.pair_shape import StrainGauge
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
SKIN_MAP_FILE = "heads/makehuman/skins/young_lightskinned_male_diffuse.png"
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
DEFORMATIONS: dict[str, Callable[[Points], Points]] = {
    "10 % narrower": lambda points: (points * [0.9, 1.0, 1.0]).astype(np.float32),
    "15 % larger": lambda points: (points * 1.15).astype(np.float32),
    "waves of 1.6 mm": lambda points: (points + 1.6 * np.sin(points[:, [1, 2, 0]] / 8)).astype(np.float32),
    "ears 20 % thinner": lambda points: _with_thinner_ears(points, 0.2),
    "ears 40 % thinner": lambda points: _with_thinner_ears(points, 0.4),
}
"""Functions that deform a head, as a frame of a mesh sequence would.

Their argument is the positions (p, 3) of the head's points at rest; the result is the deformed positions
(p, 3) [mm].
"""
LIGHT_AND_CAMERA = {"front": ("studio", "portrait"), "back": ("rim", "ear")}
SETTINGS = Settings(size=(384, 384), atlas=1024, samples=4)
OCCLUSION_ATLAS_SIDE = 512
BAKE_SETTINGS = Settings(size=(16, 16), atlas=OCCLUSION_ATLAS_SIDE, samples=1)
_REFERENCE_DIRECTION_COUNT = 1024  # number of directions, and side of their depth maps [texels]
_MIN_VISIBILITY_CHANGE = 0.02


def write_motion_page(adapter: str = "auto") -> None:
    """Compare posed heads with heads whose meshes have the posed shape at rest, and write docs/motion.md.

    Takes some minutes. Needs the published heads of MakeHuman in DERMIS_DATA, and a checkout with its folder
    `tests`.
    """
    require_in_checkout(PAGE)
    add_tests_to_path()
    renderer = dermis.Renderer(adapter)
    person = Human(age=25).head(load_maps(colour=data_file(SKIN_MAP_FILE)), "hm08", 0)
    head = replace(person, hair=None, strands=None, eyes=None)
    persons = {name: person.positions_mm for name, person in PEOPLE.items()}
    fill_page(
        PAGE,
        expressions="\n".join(expression_rows(renderer, head, persons)),
        seams="\n".join(seam_rows(renderer, head, persons)),
        occlusions="\n".join(occlusion_table(renderer, head)),
        deformations="\n".join(deformation_rows(renderer, dermis.load_head("lee_perry_smith", subdivide=0))),
        adapter=renderer.device.adapter.name,
    )


def rebuilt_head(head: Head, point_positions: Points) -> Head:
    """Return a head whose points are at given positions at rest, as if it had been loaded in this shape.

    point_positions : (p, 3) positions [mm]
    """
    mesh = head.mesh
    arrays = point_positions[mesh.point], mesh.uv, mesh.triangles, mesh.material, mesh.materials
    return Head("rebuilt", build_mesh(*arrays, point=mesh.point, quads=mesh.quads), head.maps)


def posed_points(head: Head, person_points: Points, target_weights: Mapping[str, float]) -> Points:
    """Return the positions (p, 3) of a person's points in an expression [mm].

    person_points : (p, 3) positions in the rest pose [mm]
    target_weights : morph target weights of the expression
    """
    pose_arrays = Pose(target_weights, positions_mm=person_points).to_arrays(head.control_rig)
    return head.control_rig.posed_points_mm(pose_arrays).astype(np.float32)


def picture_error(
    renderer: Renderer, head: Head, person_points: Points, target_weights: Mapping[str, float], view_name: str
) -> float:
    """Return the relative RMSE between pictures of a posed head and of a head that has this shape at rest.

    person_points : (p, 3) positions in the rest pose [mm]
    target_weights : morph target weights of the expression
    view_name : key of `LIGHT_AND_CAMERA`
    """
    rebuilt = rebuilt_head(head, posed_points(head, person_points, target_weights))
    lights, camera = LIGHT_AND_CAMERA[view_name]
    scene = Scene(rebuilt, load_lights(lights), load_camera(camera, rebuilt))
    posed_head = _with_centre_of(replace(head), rebuilt)
    pose = Pose(target_weights, positions_mm=person_points)
    posed = renderer.draw(replace(scene, head=posed_head, pose=pose), SETTINGS).linear()
    reference = renderer.draw(scene, SETTINGS).linear()
    return float(np.sqrt(((posed - reference) ** 2).mean() / (reference**2).mean()))


def _with_centre_of(head: Head, shaped_head: Head) -> Head:
    """Change the centre of a head in place to the centre of `shaped_head`, and return the head.

    Lights and cameras are relative to the centre.
    """
    for one in (head, head.without_maps):
        vars(one)["centre_mm"] = shaped_head.centre_mm
    return head


def expression_rows(
    renderer: Renderer, head: Head, person_points_by_name: Mapping[str, Points]
) -> Iterator[str]:
    """Yield Markdown rows, one per expression, with the largest picture error over all people.

    Heads are seen from the front and from the back.

    person_points_by_name : dictionary from the name of a person to positions in the rest pose [mm]
    """
    worst = dict.fromkeys(LIGHT_AND_CAMERA, 0.0)
    for name, weights in EXPRESSIONS.items():
        errors = {
            view: max(
                picture_error(renderer, head, person, weights, view)
                for person in person_points_by_name.values()
            )
            for view in LIGHT_AND_CAMERA
        }
        worst = {view: max(worst[view], errors[view]) for view in LIGHT_AND_CAMERA}
        yield f"| {name} | {100 * errors['front']:.2f} | {100 * errors['back']:.2f} |"
    yield f"| **worst** | **{100 * worst['front']:.2f}** | **{100 * worst['back']:.2f}** |"


def deformation_rows(renderer: Renderer, head: Head) -> Iterator[str]:
    """Yield Markdown rows, one per deformation, with its strain and the errors of front and back views."""
    gauge = StrainGauge(head)
    for name, deform in DEFORMATIONS.items():
        points = deform(head.positions_mm)
        front, back = (picture_error(renderer, head, points, {}, view) for view in LIGHT_AND_CAMERA)
        yield f"| {name} | {100 * gauge.strain(points):.0f} | {100 * front:.2f} | {100 * back:.2f} |"


def _with_thinner_ears(point_positions: Points, thickness_fraction: float) -> Points:
    """Return the points (p, 3) of the head "lee_perry_smith" with ears made thinner by scaling them along z.

    thickness_fraction : fraction of the thickness of the ears that is removed
    """
    ear = np.clip((np.abs(point_positions[:, :1]) - 65.0) / 10.0, 0.0, 1.0)
    return (point_positions * (1.0 - ear * [0.0, 0.0, thickness_fraction])).astype(np.float32)


def seam_rows(renderer: Renderer, head: Head, person_points_by_name: Mapping[str, Points]) -> Iterator[str]:
    """Yield Markdown rows with the discontinuity of scattered light across the seams of a head.

    The rows are for the rest pose, for expressions, and for the shapes of other people.

    person_points_by_name : dictionary from the name of a person to positions in the rest pose [mm]
    """
    rest_points = head.positions_mm
    yield _seam_row(renderer, "at rest", head, head, None)
    for name in ("open jaw", "smile", "puffed cheeks"):
        shape = rebuilt_head(head, posed_points(head, rest_points, EXPRESSIONS[name]))
        yield _seam_row(renderer, name, head, shape, Pose(EXPRESSIONS[name]))
    for name, person in person_points_by_name.items():
        shape = rebuilt_head(head, person)
        yield _seam_row(renderer, f"{name}, by positions", head, shape, Pose(positions_mm=person))
        yield _seam_row(renderer, f"{name}, rebuilt", shape, shape, None)


def _seam_row(renderer: Renderer, row_title: str, head: Head, shaped_head: Head, pose: Pose | None) -> str:
    """Return a Markdown row with the discontinuity of scattered light across the seams of a posed head.

    shaped_head : head whose shape at rest is the posed shape of `head`; tells which points lie beside seams
    """
    cells = []
    for where in (blur.neck_mask, blur.back_of_head_mask):
        sides = blur.seam_side_points(shaped_head, where)
        scene = replace(blur.striped_scene(head), pose=pose)
        _with_centre_of(scene.head, shaped_head)
        errors = blur.seam_discontinuities(renderer, scene, "stitch", blur.HEAD_ATLAS_SIDE, *sides)
        cells.append(f"{100 * errors.mean():.1f} / {100 * np.percentile(errors, 95):.1f}")
    return f"| {row_title} | {' | '.join(cells)} |"


def occlusion_table(renderer: Renderer, head: Head) -> Iterator[str]:
    """Yield Markdown rows with errors of ambient occlusion in several poses."""
    neck = dict.fromkeys(("neck01", "neck02", "neck03", "head"), (0.0, 15.0, 0.0))
    poses = {name: Pose(EXPRESSIONS[name]) for name in ("open jaw", "smile", "blink", "pucker", "surprise")}
    poses["head turned by 60 degrees"] = Pose(bones=neck)
    shapes = {
        name: (
            pose,
            rebuilt_head(
                head, head.control_rig.posed_points_mm(pose.to_arrays(head.control_rig)).astype(np.float32)
            ),
        )
        for name, pose in poses.items()
    }
    yield from occlusion_rows(renderer, head, shapes)


def occlusion_rows(
    renderer: Renderer, head: Head, poses_and_shaped_heads: Mapping[str, tuple[Pose, Head]]
) -> Iterator[str]:
    """Yield Markdown rows, one per pose, with RMS errors of the visible sky fraction.

    Each cell has the error over all texels, and over those where the pose changes the fraction.

    poses_and_shaped_heads : dictionary from the name of a pose to the pose and a head whose shape at rest is
        the shape of `head` in this pose
    """
    scene, fine = (
        Scene(head, environment=Environment(name="uniform")),
        (_REFERENCE_DIRECTION_COUNT, _REFERENCE_DIRECTION_COUNT),
    )
    rest = baked_occlusion(renderer, head, head, *fine)
    for name, (pose, shape) in poses_and_shaped_heads.items():
        reference, posed = baked_occlusion(renderer, head, shape, *fine), replace(scene, pose=pose)
        maps = [frame_occlusion(renderer, posed, mode) for mode in ("rest", "baked")]
        errors = [one - reference for one in (*maps, baked_occlusion(renderer, head, shape))]
        surface = np.isfinite(reference) & np.isfinite(rest)
        changed = surface & (np.abs(np.where(surface, reference - rest, 0.0)) > _MIN_VISIBILITY_CHANGE)
        cells = (
            f"{root_mean_square(error[surface]):.3f} / {root_mean_square(error[changed]):.3f}"
            for error in errors
        )
        yield f"| {name} | {changed.sum() / surface.sum():.1%} | {' | '.join(cells)} |"


def baked_occlusion(renderer: Renderer, head: Head, shaped_head: Head, *directions_and_side: int) -> Floats:
    """Return the visible sky fraction of a posed head, baked in an atlas (n, n); NaN outside the charts.

    head : head without a pose, which determines the atlas
    shaped_head : head whose shape at rest is the posed shape of `head`
    directions_and_side : number of directions, and side of the depth maps [texel]; by default, the values
        that frames use
    """
    inputs = renderer.prepare(Scene(head), BAKE_SETTINGS)
    texels, atlas = (
        inputs.layouts[0].atlas.resources["atlas"],
        cached_atlas(head.mesh, OCCLUSION_ATLAS_SIDE, "stitched"),
    )
    occlusion = bake_occlusion(
        renderer.device,
        shaped_head,
        atlas,
        inputs.bindings,
        texels,
        OCCLUSION_ATLAS_SIDE,
        *directions_and_side,
    )
    return occlusion[:OCCLUSION_ATLAS_SIDE].astype(float)


def frame_occlusion(renderer: Renderer, scene: Scene, occlusion_mode: str) -> Floats:
    """Return the visible sky fractions (n, n) that a frame of the scene uses for shading, in its atlas.

    occlusion_mode : occlusion mode of the settings
    """
    settings = BAKE_SETTINGS.model_copy(update={"occlusion": occlusion_mode})
    renderer.draw(scene, settings)
    texture = cast(Texture, renderer.prepare(scene, settings).bindings["occlusion_map"])
    return download(renderer.device, texture)[:OCCLUSION_ATLAS_SIDE].astype(float)


def root_mean_square(errors: Floats) -> float:
    """Return the root mean square of errors."""
    return float(np.sqrt(np.mean(errors**2)))
