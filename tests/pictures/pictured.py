"""The frames of the stored pictures; python tests/pictures/pictured.py draws them again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import dermis
from dermis.mesh.maps import Maps

STORED = Path(__file__).parent
SETTINGS = {"size": (256, 256), "atlas": 512, "shadow_size": 1024}


def pictured() -> Iterator[tuple[str, dermis.Scene, dict[str, str]]]:
    """Name, scene and settings of each."""
    head = dermis.Human(sex=0.8, age=50).head(patterned())
    places = head.mesh.positions - head.centre_mm
    x, y, z = (float(part) for part in max(places[abs(places[:, 1]) < 60], key=lambda place: place[0]))
    lamp = dermis.PointLight(position=(x + 150, y + 60, z - 600), target=(x, y, z), irradiance=(9, 9, 9))
    window = dermis.RectangleLight(
        position=(-800, 500, 700), irradiance=(3, 3, 3), width_mm=400, height_mm=400
    )
    near = dermis.Camera(position=(x + 420, y + 20, z + 420), target=(x - 12, y, z), frame_mm=110)
    yield "studio", dermis.Scene(head), {"tone": "filmic"}
    yield "dry", dermis.Scene(head, camera=dermis.three_quarter(head)), {"technique": "none"}
    oily = dermis.Skin(oiliness=0.5, specular="two-lobe")
    yield "window", dermis.Scene(head, [window], dermis.three_quarter(head), oily), {}
    yield "ear", dermis.Scene(head, [lamp], near, dermis.Skin(profile="skin1")), {}


def patterned() -> Maps:
    """Every kind of map, by waves over uv: what paints the human's own skin may change."""
    v, u = (np.mgrid[:512, :512] + 0.5) / 512

    def waves(across: float, down: float) -> NDArray[np.float64]:
        return np.sin(2 * np.pi * across * u) * np.sin(2 * np.pi * down * v)

    red = (1 + 0.25 * waves(7, 5))[..., None] * (0.48, 0.3, 0.22) - 0.04 * waves(31, 23)[..., None]
    return Maps(
        colour=red.astype(np.float32),
        normal=0.2 * np.stack([waves(90, 60), waves(50, 80)], axis=-1).astype(np.float32),
        height=(0.04 * waves(120, 110)).astype(np.float32),
        specular=(0.5 + 0.3 * waves(6, 9)).astype(np.float32),
        roughness=(0.3 + 0.08 * waves(4, 3)).astype(np.float32),
    )


def drawn(renderer: dermis.Renderer, scene: dermis.Scene, chosen: dict[str, str]) -> NDArray[np.uint8]:
    """(256, 256, 3) sRGB bytes of one of them."""
    return renderer.draw(scene, dermis.Settings(**(SETTINGS | chosen))).srgb8()  # type: ignore[arg-type]


if __name__ == "__main__":
    from dermis.images.io import write_png

    drawer = dermis.Renderer("cpu")
    for name, scene, chosen in pictured():
        write_png(STORED / f"{name}.png", drawn(drawer, scene, chosen))
