"""Benchmark cases and their scenes: a base case, and cases that each differ from it in one parameter."""

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
"""Technique with the passes of GPU Gems 3 in the graphics pipeline; `GPU_GEMS_3` has compute passes."""
_MAX_MOVEMENT_MM = 2.0  # largest movement of camera and lights
_MIN_GAUSSIAN_WEIGHT = 1e-3
_LIGHT_ROTATION_DEGREES = 25.0  # between two copies of the studio's lights


@dataclass(frozen=True)
class BenchmarkCase:
    """Parameters of a frame to measure.

    image : (width, height) of the picture [pixel]
    atlas : side of the atlas [texel]
    gaussians : number of Gaussians of the diffusion profile
    lights : number of spot lights with shadows
    environment : name of a panorama, or "" for no environment
    subdivide : subdivision level of the head; each level has four times the triangles of the previous level
    targets : number of morph targets that move in each frame, together with four bones; 0 for a static head
    samples : samples per pixel
    technique : scattering technique of `Settings`; or `FRAGMENT_TECHNIQUE`, for the passes of GPU Gems 3 in
        the graphics pipeline
    varies : name of the only parameter that differs from the base case; "" for the base case itself
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
class BenchmarkPreset:
    """Set of benchmark cases: a base case, and other values to measure for each of its parameters."""

    base_case: BenchmarkCase
    image: tuple[tuple[int, int], ...]
    atlas: tuple[int, ...]
    gaussians: tuple[int, ...]
    lights: tuple[int, ...]
    subdivide: tuple[int, ...]
    targets: tuple[int, ...] = (52,)
    environment: tuple[str, ...] = ("uniform",)
    technique: tuple[str, ...] = (GPU_GEMS_3, FRAGMENT_TECHNIQUE)

    def cases(self) -> list[BenchmarkCase]:
        """Return the base case, then the cases that each differ from it in one parameter."""
        cases = [self.base_case]
        sizes = "image", "atlas", "gaussians", "lights", "environment", "targets", "subdivide"
        for name in ("technique", *sizes):
            for value in getattr(self, name):
                if value != getattr(self.base_case, name):
                    cases.append(replace(self.base_case, varies=name, **{name: value}))
        return cases


BENCHMARK_PRESETS: dict[str, BenchmarkPreset] = {
    "film": BenchmarkPreset(
        BenchmarkCase((3840, 2160), atlas=4096, gaussians=8, lights=5, subdivide=2, samples=16),
        image=((1920, 1080), (2048, 2048), (3840, 2160)),
        atlas=(1024, 2048, 4096),
        gaussians=(1, 4, 6, 8),
        lights=(1, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "interactive": BenchmarkPreset(
        BenchmarkCase(),
        image=((512, 512), (1024, 1024), (1920, 1080), (3840, 2160)),
        atlas=(512, 1024, 2048, 4096),
        gaussians=(1, 2, 4, 6, 8),
        lights=(1, 2, 3, 5, 8),
        subdivide=(0, 1, 2, 3),
    ),
    "cpu": BenchmarkPreset(
        BenchmarkCase((1024, 1024), atlas=1024),
        image=((256, 256), (512, 512), (1024, 1024)),
        atlas=(256, 512, 1024),
        gaussians=(1, 3, 6, 8),
        lights=(1, 3, 8),
        subdivide=(0, 1),
    ),
}


def case_settings(case: BenchmarkCase) -> Settings:
    """Return the frame settings of a benchmark case."""
    return Settings(size=case.image, atlas=case.atlas, samples=case.samples, technique=case.technique)


def case_scenes(case: BenchmarkCase, head: Head, folder: Path, scene_count: int) -> list[Scene]:
    """Return consecutive scenes of a case that all differ, so no frame can reuse results of another frame.

    Camera and lights move in each scene, and so does the head if the case has morph targets.

    folder : folder in which the file of the diffusion profile is written
    scene_count : number of scenes
    """
    skin, camera = Skin(profile=str(_profile_file(case.gaussians, folder))), portrait(head)
    lights = _spot_lights(case.lights)
    environment = Environment(name=case.environment) if case.environment else None
    head = with_test_rig(head, case.targets) if case.targets else head
    scenes = []
    for k in range(scene_count):
        shift = _MAX_MOVEMENT_MM * math.sin(1.0 + k)
        moved = [
            light.model_copy(update={"position": _shift_along_x(light.position, shift)}) for light in lights
        ]
        moved_camera = camera.model_copy(update={"position": _shift_along_x(camera.position, shift)})
        pose = pose_at_moment(head, k) if case.targets else None
        scenes.append(Scene(head, tuple(moved), moved_camera, skin, environment, pose))
    return scenes


def _shift_along_x(position: tuple[float, float, float], shift_mm: float) -> tuple[float, float, float]:
    return position[0] + shift_mm, *position[1:]


def _spot_lights(light_count: int) -> list[PointLight]:
    """Return the spot lights of the studio preset, then copies that are rotated about the head.

    light_count : number of lights to return
    """
    studio_lights = [light for light in studio() if isinstance(light, PointLight)]
    return [
        _rotate_light(
            studio_lights[k % len(studio_lights)], _LIGHT_ROTATION_DEGREES * (k // len(studio_lights))
        )
        for k in range(light_count)
    ]


def _rotate_light(light: PointLight, turn_degrees: float) -> PointLight:
    x, y, z = light.position
    c, s = math.cos(math.radians(turn_degrees)), math.sin(math.radians(turn_degrees))
    return light.model_copy(update={"position": (c * x + s * z, y, c * z - s * x)})


def _profile_file(gaussian_count: int, folder: Path) -> Path:
    path = folder / f"{gaussian_count}.csv"
    profile = with_gaussian_count(load_profile("gpu-gems-3"), gaussian_count)
    rows = np.column_stack([profile.variance_mm2, profile.weight])
    lines = [",".join(repr(float(number)) for number in row) for row in rows]
    path.write_text("\n".join(["variance_mm2,red,green,blue", *lines]) + "\n", encoding="utf-8")
    return path


def with_gaussian_count(profile: GaussianSum, gaussian_count: int) -> GaussianSum:
    """Return a profile with `gaussian_count` Gaussians, but the same albedo and the same widest Gaussian."""
    if gaussian_count == len(profile.variance_mm2):
        return profile
    known = np.log(profile.variance_mm2)
    log_variance = np.linspace(known[0], known[-1], gaussian_count) if gaussian_count > 1 else known[-1:]
    channels = [
        np.interp(log_variance, known, channel) + _MIN_GAUSSIAN_WEIGHT for channel in profile.weight.T
    ]
    weight = np.stack(channels, axis=1)
    weight *= profile.albedo / weight.sum(axis=0)
    return GaussianSum(f"{gaussian_count} Gaussians", np.exp(log_variance), weight)


BONE_COUNT = 4
_MORPH_POINT_FRACTION = 1 / 6  # of the points that a target moves, as in targets of faces
_MORPH_DISPLACEMENT_MM = 2.0
_BONE_ROTATION_DEGREES = 4.0

Doubles = NDArray[np.float64]


def with_test_rig(head: Head, target_count: int) -> Head:
    """Return the head with synthetic morph targets and bones in place of its own rig.

    target_count : number of morph targets
    """
    points = head.positions_mm.astype(np.float64)
    rig = replace(
        head.control_rig, targets=_synthetic_targets(points, target_count), skeleton=_bone_chain(points)
    )
    return replace(head, rig=rig)


def pose_at_moment(head: Head, moment_index: int) -> Pose:
    """Return a pose of the synthetic rig; all its targets and bones move from each frame to the next.

    moment_index : index of the frame
    """
    weights = {name: 0.5 + 0.5 * math.sin(k + 0.3 * moment_index) for k, name in enumerate(head.targets)}
    angles = [_BONE_ROTATION_DEGREES * math.sin(0.2 * moment_index + k) for k in range(BONE_COUNT)]
    bones = {name: (0.3 * angle, angle, 0.0) for name, angle in zip(head.bones, angles, strict=True)}
    return Pose(weights, bones)


def _synthetic_targets(point_positions: Doubles, target_count: int) -> MorphTargets:
    """Return synthetic morph targets: smooth bumps that each displace a sixth of the points.

    point_positions : (p, 3) positions of the points in the rest pose [mm]
    """
    centres = point_positions[np.linspace(0, len(point_positions) - 1, target_count).astype(int)]
    nearest = max(1, int(_MORPH_POINT_FRACTION * len(point_positions)))
    moved, deltas = [], []
    for centre in centres:
        distance = np.linalg.norm(point_positions - centre, axis=1)
        indices = np.sort(np.argpartition(distance, nearest - 1)[:nearest])
        falloff = 1.0 - (distance[indices] / max(float(distance[indices].max()), 1e-9)) ** 2
        moved.append(indices)
        deltas.append(falloff[:, None] * np.array([0.0, 0.0, _MORPH_DISPLACEMENT_MM / target_count]))
    first = nearest * np.arange(target_count + 1)
    names = tuple(f"target {k}" for k in range(target_count))
    point = np.concatenate(moved).astype(np.int32)
    return MorphTargets(names, first.astype(np.int32), point, np.concatenate(deltas).astype(np.float32))


def _bone_chain(point_positions: Doubles) -> Skeleton:
    """Return a vertical chain of bones; each point is moved by the two bones that are nearest in height.

    point_positions : (p, 3) positions of the points in the rest pose [mm]
    """
    low, high = point_positions[:, 1].min(), point_positions[:, 1].max()
    step = (high - low) / BONE_COUNT
    local, bind = np.tile(np.eye(4), (2, BONE_COUNT, 1, 1))
    local[:, 1, 3] = [low, *([step] * (BONE_COUNT - 1))]
    bind[:, 1, 3] = -(low + step * np.arange(BONE_COUNT))
    position = np.clip((point_positions[:, 1] - low) / step, 0.0, BONE_COUNT - 1.001)
    below = position.astype(np.int32)
    bone, weight = (
        np.zeros((len(point_positions), 4), np.int32),
        np.zeros((len(point_positions), 4), np.float32),
    )
    bone[:, 0], bone[:, 1] = below, below + 1
    weight[:, 1] = position - below
    weight[:, 0] = 1.0 - weight[:, 1]
    parent = np.arange(-1, BONE_COUNT - 1, dtype=np.int32)
    names = tuple(f"bone {k}" for k in range(BONE_COUNT))
    return Skeleton(names, parent, local, bind, np.eye(4), bone, weight)
