"""Measures the approximations of the frame, writes docs/accuracy.md: python tools/accuracy.py [ADAPTER]."""

from __future__ import annotations

import sys
from pathlib import Path

import accuracy_highlight as highlight
import accuracy_light as light
import accuracy_look as look
import accuracy_optics as optics
import accuracy_slabs as slabs
import accuracy_specular as specular
import accuracy_surface as surface
import accuracy_thin as thin
import numpy as np

from dermis.atlas.build import build_atlas
from dermis.gpu import Device, open_device
from dermis.gpu.probe import half_store_rounding
from dermis.mesh.geometry import build_mesh
from dermis.mesh.mesh import Mesh
from dermis.mesh.primitives import plane, uv_sphere
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile

PAGE = Path(__file__).parent.parent / "docs" / "accuracy.md"
SIZE = 256


def spread(device: Device, mesh: Mesh, light: np.ndarray, stretch: str = "full") -> list[np.ndarray]:
    """The blurred levels of light (n, n) on a mesh's atlas."""
    levels, blur = surface.spread(device, mesh, build_atlas(mesh, len(light)), light[..., None], stretch)
    return [surface.level(device, levels, blur, k + 1) for k in range(len(blur.variance_mm2))]


def point_of_light(device: Device, texels_per_mm: float) -> str:
    """Errors of a point of light on a flat patch against the analytic sum of Gaussians."""
    profile = load_profile("gpu-gems-3")
    light = np.zeros((SIZE, SIZE), np.float32)
    middle = SIZE // 2
    light[middle, middle] = 1.0
    levels = spread(device, plane(SIZE / texels_per_mm), light)
    y, x = np.mgrid[:SIZE, :SIZE] - middle
    r2 = (x**2 + y**2) / texels_per_mm**2
    blurred = GaussianSum("blurred levels", profile.variance_mm2[1:], profile.weight[1:])
    exact = blurred.radiant_exitance(np.sqrt(r2))[..., 0] / texels_per_mm**2
    total = np.tensordot(blurred.weight[:, 0], levels, axes=1)
    beyond = x**2 + y**2 > 1.5**2
    shape = np.abs(total - exact)[beyond].max() / exact.max()
    energy = total.sum() / blurred.albedo[0] - 1
    return f"| {texels_per_mm:g} | {100 * shape:.2f} % | {100 * energy:+.4f} % |"


def sheared(device: Device, degrees: float) -> str:
    """Principal widths of a point of light where uv axes meet at `degrees`, over the width wanted."""
    flat = plane(SIZE / 3.0)
    lean = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    positions = flat.positions.copy()
    positions[:, 0] += lean[0] * positions[:, 1]
    positions[:, 1] *= lean[1]
    mesh = build_mesh(positions, flat.uv, flat.triangles, flat.material, flat.materials)
    light = np.zeros((SIZE, SIZE), np.float32)
    light[SIZE // 2, SIZE // 2] = 1.0
    y, x = np.mgrid[:SIZE, :SIZE] - SIZE // 2
    place = np.stack([x - lean[0] * y, -lean[1] * y]) / 3.0  # v points down
    wanted = load_profile("gpu-gems-3").variance_mm2[-1]
    cells = []
    for stretch in ("axes", "full"):
        spot = spread(device, mesh, light, stretch)[-1].astype(float)
        covariance = np.einsum("iyx,jyx,yx->ij", place, place, spot) / spot.sum()
        cells += [f"{width:.3f}" for width in np.sqrt(np.linalg.eigvalsh(covariance) / wanted)]
    return f"| {degrees:g}° | {' | '.join(cells)} |"


def constant_light(device: Device) -> float:
    """Largest deviation of a constant light on a sphere's atlas after all levels."""
    atlas = build_atlas(uv_sphere(100.0), SIZE)
    levels = spread(device, uv_sphere(100.0), atlas.coverage.astype(np.float32))
    return max(float(np.abs(level[atlas.coverage] - 1).max()) for level in levels)


def main() -> None:
    """Measure and write the page."""
    device = open_device(sys.argv[1] if len(sys.argv) > 1 else "auto")
    text = (PAGE.parent / "accuracy.in.md").read_text(encoding="utf-8")
    rows = "\n".join(point_of_light(device, density) for density in (0.75, 1.0, 1.5, 3.0, 6.0, 12.0))
    leaning = "\n".join(sheared(device, degrees) for degrees in (90, 80, 60, 45))
    PAGE.write_text(
        text.format(
            adapter=f"{device.adapter.name}, {device.adapter.backend}",
            rows=rows,
            leaning=leaning,
            constant=f"{constant_light(device):.1e}",
            rounding=half_store_rounding(device),
            highlights=highlight.table(),
            highlight_paths=highlight.PATHS,
            looks=look.table(),
            look_paths=look.PATHS,
            **specular.tables(),
            **light.tables(*sys.argv[1:2]),
            **optics.tables(),
            **slabs.tables(*sys.argv[1:2]),
            **thin.tables(*sys.argv[1:2]),
        ),
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
