"""Tables of the errors of light through slabs, by directions of entry, for docs/accuracy.md.

python tools/accuracy_slabs.py [ADAPTER] prints them alone. Slabs far from their rim; the truth is adding and
doubling (`optics/slabs.py`), which the tests hold against photons.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import dermis
from dermis.apps.truths.slab import ScatteringLayer
from dermis.apps.truths.slab_mc import trace_slab
from dermis.gpu import download
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import wedge
from dermis.optics.diffusion.models import diffusion_profile
from dermis.optics.directions import ROWS, directional_albedo, mean_of_once, refracted
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.forward import forward_directions
from dermis.optics.media import Medium, media
from dermis.optics.profiles import TERMS, write_profile
from dermis.optics.slabs import NODES, leaving_deep, slabs
from dermis.scene import DirectionalLight, Scene, Settings, Skin

Array = np.ndarray
THICK_MM = (0.5, 1.0, 2.0, 3.0, 5.0, 10.0)
DEGREES = (0.0, 40.0, 60.0, 80.0)
PHOTONS = 100_000
FORWARD = 0.8  # mean cosine of real flesh
BODIES = (("skin1", 1.0), ("skin2", 1.0), ("skin1", 1.4), ("skin2", 1.4))


def exact(body: Medium, thickness: float, g: float = 0.0) -> Array:
    """(2, angles, 3) share of what enters that leaves scattered, on the near side and the far one.

    g : mean cosine of scattering; the body's coefficients are reduced
    """
    layer, made = body.layers[0], np.empty((2, len(DEGREES), 3))
    below = refracted(np.cos(np.radians(DEGREES)), body.eta)
    for c in range(3):
        cut = slabs(float(layer.alpha_prime[c]), float(layer.sigma_t_prime[c]) * thickness, body.eta, g=g)
        made[..., c] = [np.interp(below, cut.cosine, part[0]) for part in (cut.back, cut.through)]
    return made


def drawn(renderer: dermis.Renderer, skin: Skin, thickness: float) -> Array:
    """The same of the frame."""
    mesh, made = wedge(60.0, thickness, thickness), np.empty((2, len(DEGREES), 3))
    for k, angle in enumerate(np.radians(DEGREES)):
        way = (float(np.sin(angle)), 0.0, float(np.cos(angle)))
        light = DirectionalLight(direction=way, irradiance=(1.0, 1.0, 1.0), shadows=False)
        scene = Scene(Head("slab", mesh, Maps()), lights=[light], skin=skin)
        settings = Settings(size=(16, 16), atlas=256, samples=1)
        renderer.draw(scene, settings)
        inputs = renderer.prepare(scene, settings)
        texels = download(renderer.device, inputs.layouts[0].atlas.resources["atlas"])
        own = texels[..., 0] > 0
        w = np.stack([texels[own][:, 1] & 0xFFFF, texels[own][:, 1] >> 16], axis=-1) / 65535.0
        w = np.column_stack([1 - w.sum(axis=1), w])
        corners = mesh.triangles[texels[own][:, 0].astype(int) - 1]
        places, normals = (np.einsum("nk,nkc->nc", w, a[corners]) for a in (mesh.positions, mesh.normals))
        leaving = download(renderer.device, inputs.resources.scattered)[own][:, :3].astype(float)
        inner = np.abs(places[:, :2]).max(axis=1) < 8.0
        for side in (0, 1):
            facing = inner & ((2 * side - 1) * normals[:, 2] > 0.9)
            made[side, k] = leaving[facing].mean(axis=0) / np.cos(angle)
    return made


def skins(body: Medium, folder: str) -> dict[str, Skin]:
    """Lambertian skin and half-spaces of a medium, in its own colour."""
    file = Path(folder) / f"{body.name}_{body.eta:g}.toml"
    write_profile(file, fit_gaussians(diffusion_profile(body).rings(), TERMS, name=body.name).profile, {})
    usual = {"profile": str(file), "albedo": "profile", "energy": "none", "rho_s": 0.0}
    usual |= {"specular": "none"} if body.eta == 1.0 else {}
    return {way: Skin(direction=way, **usual) for way in ("lambertian", "half-space")}  # type: ignore[arg-type]


def table(renderer: dermis.Renderer) -> str:
    """Errors, root mean square over directions and channels, over the root mean square of the truth."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, eta in BODIES:
            body = media()[name].with_eta(eta)
            for way, skin in skins(body, folder).items():
                for thickness in THICK_MM:
                    cells = _beside(drawn(renderer, skin, thickness), exact(body, thickness))
                    rows.append(f"| {name}, index {eta:g} | {way} | {thickness:g} mm | {cells} |")
    return "\n".join(rows)


def forward_table(renderer: dermis.Renderer) -> str:
    """The same of half-space skin beside slabs that scatter forward, without and with `anisotropy`."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, eta in BODIES:
            body = media()[name].with_eta(eta)
            plain = skins(body, folder)["half-space"]
            for g in (0.0, FORWARD):
                skin = plain.model_copy(update={"anisotropy": g})
                for thickness in THICK_MM:
                    cells = _beside(drawn(renderer, skin, thickness), exact(body, thickness, FORWARD))
                    rows.append(f"| {name}, index {eta:g} | {g:g} | {thickness:g} mm | {cells} |")
    return "\n".join(rows)


def forward_directions_table() -> str:
    """Radiance below skin1's surface over all pairs of directions, beside a forward half-space."""
    rows = []
    for g in (0.0, FORWARD):
        cells = []
        for eta in (1.0, 1.4):
            albedos = media()["skin1"].layers[0].alpha_prime
            cells.append(" ".join(f"{_pairs_error(float(one), eta, g):.3f}" for one in albedos))
        rows.append(f"| anisotropy {g:g} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _pairs_error(albedo: float, eta: float, g: float) -> float:
    a, share, exact = leaving_deep(albedo, eta, NODES, FORWARD)
    air = np.sqrt(np.maximum(1.0 - eta**2 * (1.0 - a**2), 0.0))
    law = forward_directions(float(directional_albedo(1.0, albedo, eta)), eta, g)
    table = np.interp(np.sqrt(air), np.linspace(0.0, 1.0, ROWS), law.returned[:, 0])
    made = table + law.once[0] * (1.0 / (a[:, None] + a) - mean_of_once(air, eta))
    made *= (share @ exact @ share) / (table @ share)
    weight = np.outer(share, share)
    return float(np.sqrt((weight * (made - exact) ** 2).sum() / (weight * exact**2).sum()))


def _beside(made: Array, truth: Array) -> str:
    """Error and red light by direction, of the far side and of the near one."""
    flux, cells = np.sqrt(np.cos(np.radians(DEGREES)))[:, None], []
    for side in (1, 0):
        error = np.linalg.norm(flux * (made[side] - truth[side])) / np.linalg.norm(flux * truth[side])
        red = made[side][:, 0] / truth[side][:, 0]
        cells.append(f"{error:.3f} | {' '.join(f'{one:.2f}' for one in red)}")
    return " | ".join(cells)


def forward() -> str:
    """Photons that scatter forward, and slabs that scatter alike in all directions: light from above, red."""
    rows = []
    for eta in (1.0, 1.4):
        layer = media()["skin1"].layers[0]
        absorbed, scattered = float(layer.sigma_a[0]), float(layer.sigma_s_prime[0])
        for thickness in THICK_MM:
            cells = []
            for g in (0.0, FORWARD):
                flesh = ScatteringLayer(absorbed, scattered / (1.0 - g), thickness, g, eta)
                run = trace_slab([flesh], PHOTONS).per_entering
                cells += [f"{run.total_transmittance:.3f}", f"{run.unscattered_transmittance:.3f}"]
                cells.append(f"{run.total_reflectance:.3f}")
            rows.append(f"| {eta:g} | {thickness:g} mm | {' | '.join(cells)} |")
    return "\n".join(rows)


def tables(adapter: str = "auto") -> dict[str, str]:
    """The tables of slabs, by their names in the page's template."""
    renderer = dermis.Renderer(adapter)
    return {
        "slab_errors": table(renderer),
        "slab_forward": forward(),
        "slab_forward_errors": forward_table(renderer),
        "forward_directions": forward_directions_table(),
    }


if __name__ == "__main__":
    for title, text in tables(*sys.argv[1:]).items():
        sys.stdout.write(f"{title}\n{text}\n\n")
