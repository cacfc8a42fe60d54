"""A small egg-shaped head with pictures, as a glTF file that tests change."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from gltf_file import GltfFile
from numpy.typing import NDArray

from dermis.images.codecs import encode_png
from dermis.mesh.primitives import uv_sphere

Tree = dict[str, Any]
SIDE = 16


def quarters(*colours: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return a picture of four squares: top left, top right, bottom left, bottom right."""
    half = SIDE // 2
    picture = np.zeros((SIDE, SIDE, 3), np.uint8)
    for index, colour in enumerate(colours):
        y, x = divmod(index, 2)
        picture[half * y : half * (y + 1), half * x : half * (x + 1)] = colour
    return picture


SKIN = quarters((220, 160, 130), (200, 140, 120), (180, 120, 90), (230, 180, 150))
CLOTH = quarters((20, 40, 160), (200, 200, 40), (40, 160, 40), (160, 40, 40))
FLAT = np.full((SIDE, SIDE, 3), (128, 128, 255), np.uint8)
BUMPY = quarters((128, 128, 255), (150, 128, 250), (128, 150, 250), (140, 140, 252))


class Egg:
    """Tree of a glTF file with an egg of 240 mm, and a collar below it that is not skin."""

    def __init__(self) -> None:
        self.file = GltfFile()
        self.tree = self.file.tree
        self.tree |= {"materials": [], "textures": [], "images": []}
        ball = uv_sphere(0.12, 12, 8)
        self.file.add("nodes", mesh=self._mesh("Head", ball, 0.0), name="Head")
        self.file.add("nodes", mesh=self._mesh("Collar", ball, -0.2), name="Collar")
        self.skin, self.cloth = self.material("face", SKIN, 0), self.material("shirt", CLOTH, 1)

    def _mesh(self, name: str, ball: Any, y: float) -> int:
        positions = ball.positions + np.float32([0.0, y, 0.0])
        attributes = {
            "POSITION": self.file.numbers(positions),
            "NORMAL": self.file.numbers(ball.normals),
            "TEXCOORD_0": self.file.numbers(ball.uv),
        }
        triangles = self.file.numbers(ball.triangles.reshape(-1, 1), "<u2")
        return self.file.add(
            "meshes", name=name, primitives=[{"attributes": attributes, "indices": triangles}]
        )

    def material(self, name: str, picture: NDArray[np.uint8], mesh: int) -> Tree:
        """Add a material with a picture and give it to a mesh."""
        self.tree["materials"].append(
            {
                "name": name,
                "pbrMetallicRoughness": {"baseColorTexture": self.texture(picture), "metallicFactor": 0.0},
            }
        )
        self.primitive(mesh)["material"] = len(self.tree["materials"]) - 1
        material: Tree = self.tree["materials"][-1]
        return material

    def primitive(self, mesh: int = 0) -> Tree:
        """Return the primitive of a mesh."""
        primitive: Tree = self.tree["meshes"][mesh]["primitives"][0]
        return primitive

    def texture(self, picture: NDArray[np.uint8] | bytes, mime: str = "image/png", **more: Any) -> Tree:
        """Add a picture and return a reference to its texture; `more` are entries of the texture."""
        data = picture if isinstance(picture, bytes) else encode_png(picture)
        view = self.file._view(data)
        self.tree["images"].append({"bufferView": view, "mimeType": mime})
        self.tree["textures"].append({"source": len(self.tree["images"]) - 1} | more)
        return {"index": len(self.tree["textures"]) - 1}

    def write(self, path: Path) -> Path:
        """Write the file as .glb or .gltf."""
        return self.file.write(path, *range(len(self.tree["nodes"])))
