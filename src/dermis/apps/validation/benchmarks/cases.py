"""Benchmark cases: a base frame, others that each vary one parameter, and their scenes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.mesh.rig import MorphTargets, Skeleton
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.camera import portrait
from dermis.scene.environment import Environment
from dermis.scene.lights import PointLight, studio
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

GPU_GEMS_3 = "gpu-gems-3"
FRAGMENT_TECHNIQUE = "published-fragments"
"""Passes of GPU Gems 3 in the graphics pipeline; `GPU_GEMS_3` has the same as compute passes."""
_SHIFT_MM = 2.0
_MIN_WEIGHT = 1e-3
_RIG_ROTATION_DEGREES = 25.0  # between two copies of the studio's lights


@dataclass(frozen=True)
class Case:
    """Frame to measure.

    image : (width, height) [pixel]
    atlas : side of the irradiance map [texel]
    gaussians : number of Gaussians of the profile
    lights : number of spot lights with shadows
    environment : name of a panorama, "" for none
    subdivide : subdivision level of the head, each with four times the triangles
    targets : morph targets that all move in each frame, with four bones; 0 for a static head
    samples : samples per pixel
    technique : of `Settings`, or `FRAGMENT_TECHNIQUE`
    varies : parameter that differs from the base frame, "" for the base frame
    """

    image: tuple[int, int] = (1920, 1080)
    atlas: int = 2048
    gaussians: int = 6
    lights: int = 3
    environment: str = ""
    subdivide: int = 0
    targets: int = 0
    samples: int = 4
    technique: str = "texture-space"
    varies: str = ""


@dataclass(frozen=True)
class Preset:
    """Base frame, and the values that each of its parameters takes in turn."""

    usual: Case
    image: tuple[tuple[int, int], ...]
    atlas: tuple[int, ...]
    gaussians: tuple[int, ...]
    lights: tuple[int, ...]
    subdivide: tuple[int, ...]
    targets: tuple[int, ...] = (52,)
    environment: tuple[str, ...] = ("uniform",)
    technique: tuple[str, ...] = (GPU_GEMS_3, FRAGMENT_TECHNIQUE)

    def cases(self) -> list[Case]:
        """Return the base frame, then the others."""
        cases = [self.usual]
        sizes = "image", "atlas", "gaussians", "lights", "environment", "targets", "subdivide"
        for name in ("technique", *sizes):
            for value in getattr(self, name):
                if value != getattr(self.usual, name):
                    cases.append(replace(self.usual, varies=name, **{name: value}))
        return cases


PRESETS: dict[str, Preset] = {
    "film": Preset(
        Case((3840, 2160), atlas=4096, gaussians=8, lights=5, subdivide=2, samples=16),
        image=((1920, 1080), (2048, 2048), (3840, 2160)),
        atlas=(1024, 2048, 4096),
        gaussians=(1, 4, 6, 8),
        lights=(1, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "interactive": Preset(
        Case(),
        image=((512, 512), (1024, 1024), (1920, 1080), (3840, 2160)),
        atlas=(512, 1024, 2048, 4096),
        gaussians=(1, 2, 4, 6, 8),
        lights=(1, 2, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "cpu": Preset(
        Case((1024, 1024), atlas=1024),
        image=((256, 256), (512, 512), (1024, 1024)),
        atlas=(256, 512, 1024),
        gaussians=(1, 3, 6, 8),
        lights=(1, 3, 8),
        subdivide=(0, 1),
    ),
}


def case_settings(case: Case) -> Settings:
    """Return the settings of a case."""
    return Settings(size=case.image, atlas=case.atlas, samples=case.samples, technique=case.technique)


def case_scenes(case: Case, head: Head, folder: Path, count: int) -> list[Scene]:
    """Return `count` scenes of a case, in which camera, lights and a moving head change each time.

    folder : for the profile's file
    """
    skin, camera = Skin(profile=str(_profile_file(case.gaussians, folder))), portrait(head)
    lights = _lights(case.lights)
    environment = Environment(name=case.environment) if case.environment else None
    head = with_test_rig(head, case.targets) if case.targets else head
    scenes = []
    for k in range(count):
        shift = _SHIFT_MM * math.sin(1.0 + k)
        moved = [light.model_copy(update={"position": _shifted(light.position, shift)}) for light in lights]
        moved_camera = camera.model_copy(update={"position": _shifted(camera.position, shift)})
        pose = pose_at_moment(head, k) if case.targets else None
        scenes.append(Scene(head, tuple(moved), moved_camera, skin, environment, pose))
    return scenes


def _shifted(position: tuple[float, float, float], shift: float) -> tuple[float, float, float]:
    return position[0] + shift, *position[1:]


def _lights(count: int) -> list[PointLight]:
    """Return the studio's spot lights, then the same ones rotated about the head."""
    rig = [light for light in studio() if isinstance(light, PointLight)]
    return [_rotated(rig[k % len(rig)], _RIG_ROTATION_DEGREES * (k // len(rig))) for k in range(count)]


def _rotated(light: PointLight, degrees: float) -> PointLight:
    x, y, z = light.position
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return light.model_copy(update={"position": (c * x + s * z, y, c * z - s * x)})


def _profile_file(count: int, folder: Path) -> Path:
    path = folder / f"{count}.csv"
    profile = with_gaussian_count(load_profile("gpu-gems-3"), count)
    rows = np.column_stack([profile.variance_mm2, profile.weight])
    lines = [",".join(repr(float(number)) for number in row) for row in rows]
    path.write_text("\n".join(["variance_mm2,red,green,blue", *lines]) + "\n", encoding="utf-8")
    return path


def with_gaussian_count(profile: GaussianSum, count: int) -> GaussianSum:
    """Return a profile with `count` Gaussians, the same albedo and the same widest Gaussian."""
    if count == len(profile.variance_mm2):
        return profile
    known = np.log(profile.variance_mm2)
    log_variance = np.linspace(known[0], known[-1], count) if count > 1 else known[-1:]
    channels = [np.interp(log_variance, known, channel) + _MIN_WEIGHT for channel in profile.weight.T]
    weight = np.stack(channels, axis=1)
    weight *= profile.albedo / weight.sum(axis=0)
    return GaussianSum(f"{count} Gaussians", np.exp(log_variance), weight)


BONE_COUNT = 4
_TARGET_FRACTION = 1 / 6  # of the points that a target moves, as in targets of faces
_LIFT_MM = 2.0
_BONE_ROTATION_DEGREES = 4.0

Doubles = NDArray[np.float64]


def with_test_rig(head: Head, targets: int) -> Head:
    """Return the head with `targets` morph targets, and a column of bones instead of its skeleton."""
    points = head.positions_mm.astype(np.float64)
    rig = replace(head.control, targets=_targets(points, targets), skeleton=_skeleton(points))
    return replace(head, rig=rig)


def pose_at_moment(head: Head, moment: int) -> Pose:
    """Return a pose in which every target and every bone differs from the moment before."""
    weights = {name: 0.5 + 0.5 * math.sin(k + 0.3 * moment) for k, name in enumerate(head.targets)}
    angles = [_BONE_ROTATION_DEGREES * math.sin(0.2 * moment + k) for k in range(BONE_COUNT)]
    bones = {name: (0.3 * angle, angle, 0.0) for name, angle in zip(head.bones, angles, strict=True)}
    return Pose(weights, bones)


def _targets(points: Doubles, count: int) -> MorphTargets:
    """Return smooth displacements, each of a sixth of the points around one of them."""
    centres = points[np.linspace(0, len(points) - 1, count).astype(int)]
    nearest = max(1, int(_TARGET_FRACTION * len(points)))
    moved, deltas = [], []
    for centre in centres:
        distance = np.linalg.norm(points - centre, axis=1)
        indices = np.sort(np.argpartition(distance, nearest - 1)[:nearest])
        falloff = 1.0 - (distance[indices] / max(float(distance[indices].max()), 1e-9)) ** 2
        moved.append(indices)
        deltas.append(falloff[:, None] * np.array([0.0, 0.0, _LIFT_MM / count]))
    first = nearest * np.arange(count + 1)
    names = tuple(f"target {k}" for k in range(count))
    point = np.concatenate(moved).astype(np.int32)
    return MorphTargets(names, first.astype(np.int32), point, np.concatenate(deltas).astype(np.float32))


def _skeleton(points: Doubles) -> Skeleton:
    """Return a vertical chain of bones; each point is weighted between the two nearest ones."""
    low, high = points[:, 1].min(), points[:, 1].max()
    step = (high - low) / BONE_COUNT
    local, bind = np.tile(np.eye(4), (2, BONE_COUNT, 1, 1))
    local[:, 1, 3] = [low, *([step] * (BONE_COUNT - 1))]
    bind[:, 1, 3] = -(low + step * np.arange(BONE_COUNT))
    position = np.clip((points[:, 1] - low) / step, 0.0, BONE_COUNT - 1.001)
    below = position.astype(np.int32)
    bone, weight = np.zeros((len(points), 4), np.int32), np.zeros((len(points), 4), np.float32)
    bone[:, 0], bone[:, 1] = below, below + 1
    weight[:, 1] = position - below
    weight[:, 0] = 1.0 - weight[:, 1]
    parent = np.arange(-1, BONE_COUNT - 1, dtype=np.int32)
    names = tuple(f"bone {k}" for k in range(BONE_COUNT))
    return Skeleton(names, parent, local, bind, np.eye(4), bone, weight)
