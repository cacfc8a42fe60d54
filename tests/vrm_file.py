"""VRM avatars: a ball with a nose, morph targets and expressions, in both versions of the format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gltf_file import GltfFile, add_mesh

from dermis.mesh.primitives import uv_sphere

_NOSE_M = 0.03


class VrmFile:
    """Tree of an avatar whose face has the targets "smile" and "open"; `mesh` is the mesh of its face."""

    def __init__(self, version: int) -> None:
        self.file, self.version = GltfFile(), version
        ball, sign = uv_sphere(0.12, 24, 12), -1.0 if version == 0 else 1.0
        positions = ball.positions.copy()
        tip = np.argmax(sign * positions[:, 2])
        positions[tip, 2] += sign * _NOSE_M
        up, forward = np.zeros((2, *positions.shape))
        up[:40, 1], forward[20:60, 2] = 0.01, 0.02
        targets = {"smile": self.file.sparse(up), "open": self.file.sparse(forward)}
        index = add_mesh(
            self.file, positions, ball.triangles, targets, {"TEXCOORD_0": self.file.numbers(ball.uv)}
        )
        self.mesh = self.file.tree["meshes"][index]
        self.file.add("nodes", mesh=index, name="Face")
        self.file.tree["materials"] = [{"name": "N00_000_00_Face_00_SKIN (Instance)"}]
        self.mesh["primitives"][0]["material"] = 0
        self.avatar: dict[str, Any] = {}
        self.file.tree["extensions"] = {"VRM" if version == 0 else "VRMC_vrm": self.avatar}

    def add_expression(self, name: str, weights: dict[int, float], *, custom: bool = False) -> dict[str, Any]:
        """Add an expression of weights by index of the morph target, and return its tree."""
        if self.version == 0:
            binds = [{"mesh": 0, "index": index, "weight": 100 * weight} for index, weight in weights.items()]
            group = {"name": name, "presetName": "unknown" if custom else name, "binds": binds}
            groups = self.avatar.setdefault("blendShapeMaster", {}).setdefault("blendShapeGroups", [])
            groups.append(group)
            return group
        binds = [{"node": 0, "index": index, "weight": weight} for index, weight in weights.items()]
        kinds = self.avatar.setdefault("expressions", {})
        tree: dict[str, Any] = {"morphTargetBinds": binds}
        kinds.setdefault("custom" if custom else "preset", {})[name] = tree
        return tree

    def write(self, path: Path) -> Path:
        """Write the file."""
        written = self.file.write(path.with_suffix(".glb"), 0)
        return written.rename(path)
