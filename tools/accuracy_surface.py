"""What the map does to a blur, apart from any light: curvature and seams, as tables."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

import dermis
from dermis.atlas.atlas import Atlas
from dermis.atlas.build import build_atlas
from dermis.atlas.cached import cached_atlas
from dermis.frame.atlas_textures import upload_atlas
from dermis.frame.geometry import upload_geometry
from dermis.frame.levels import Blur, Levels, halvings_of, make_levels, usual_texel
from dermis.frame.passes import diffuse
from dermis.frame.passes import stretch as stretched
from dermis.frame.passes.shape import rest_shape
from dermis.frame.renderer import Renderer
from dermis.frame.seams import REMEDIES
from dermis.frame.shape import shape_tables
from dermis.gpu import Device, Frame, download, upload
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.mesh import Mesh
from dermis.optics.profiles import load_profile
from dermis.scene import DirectionalLight, Light, Scene, Settings, Skin, StripeLight

sys.path.append(str(Path(__file__).parent.parent / "tests"))  # the surfaces are the tests' own
from atlas_reading import Points, lit_at, seam_points, shown
from cut_meshes import cut_sphere

PROFILE = load_profile("gpu-gems-3")
Choice = Callable[[np.ndarray], np.ndarray]
HUMAN = "heads/makehuman/head_young_male_light.obj"
RADII_MM = (5.0, 10.0, 20.0, 50.0, 100.0)
BALL_SIDE, HEAD_SIDE = 320, 1024
SPACING_MM, WIDTH_MM = 12.0, 6.0  # of bands of light across seams
LEAST_FACING = 0.4  # cosine between a seam and the light


def tables(adapter: str) -> dict[str, str]:
    """Rows for docs/techniques.in.md by their names there."""
    renderer = dermis.Renderer(adapter)
    curved = [first_harmonic(renderer, radius) for radius in RADII_MM]
    return {"curvature": "\n".join(curved), "seams": "\n".join(seams(renderer))}


def first_harmonic(renderer: Renderer, radius_mm: float) -> str:
    """What the widest Gaussian leaves of light in proportion to x on a sphere: by map, heat and chords."""
    mesh = cut_sphere(radius_mm, 20)
    atlas = build_atlas(mesh, BALL_SIDE, "stitched")
    light = np.nan_to_num(shown(atlas, mesh, own=True))[..., :1] / radius_mm
    left = widest(renderer, *spread(renderer.device, mesh, atlas, light))
    density = np.maximum(atlas.stretch.astype(float).prod(axis=-1, keepdims=True), 1e-6)
    area = atlas.own[..., None] / density
    map_share = (area * left * light).sum() / (area * light**2).sum()
    v = PROFILE.variance_mm2[-1] / radius_mm**2
    whole = np.exp(-2 / v)
    chords = (1 - whole) - v * (1 - (1 + 2 / v) * whole)
    return f"| {radius_mm:g} | {map_share:.3f} | {np.exp(-v):.3f} | {chords:.3f} |"


def spread(
    device: Device, mesh: Mesh, atlas: Atlas, light: np.ndarray, stretch: str = "full"
) -> tuple[Levels, Blur]:
    """Grey light (n, n, 1) on a mesh's atlas, blurred by all Gaussians of PROFILE but the narrowest."""
    textures, variance = upload_atlas(device, atlas, stretch), PROFILE.variance_mm2[1:]
    most = len(textures.sheets("repeated")) - 1
    halvings = halvings_of(variance, textures.usual_per_mm, most)
    blur = Blur(variance, PROFILE.weight[1:], halvings)
    levels = make_levels(device, len(light), (halvings,), usual_texel(device))
    upload(device, levels.stacks[0], np.dstack([light, light, light, np.ones_like(light)]))
    frame = Frame(device)
    head = Head("", mesh, Maps())
    shape = rest_shape(device, shape_tables(device, head), head.positions_mm)
    stretched.draw(frame, upload_geometry(device, mesh, atlas, shape), textures)
    diffuse.draw(frame, levels, textures, blur)
    frame.submit()
    return levels, blur


def level(device: Device, levels: Levels, blur: Blur, k: int) -> np.ndarray:
    """(n, n) level k, read between the texels of its own resolution."""
    from scipy.ndimage import zoom

    halvings = blur.halvings[k]
    layer = download(device, levels.stacks[halvings], layer=k - levels.first[halvings])[..., 0]
    return (
        np.asarray(zoom(layer, 2**halvings, order=1, mode="nearest", grid_mode=True)) if halvings else layer
    )


def widest(renderer: Renderer, levels: Levels, blur: Blur) -> np.ndarray:
    """(n, n, 1) the widest level."""
    return level(renderer.device, levels, blur, len(blur.halvings) - 1)[..., None]


def seams(renderer: Renderer) -> list[str]:
    """Jump of the scattered light across seams, of the light there [%]: mean and 95th percentile."""
    ball = cut_sphere(30.0, 20)
    rows = row(renderer, "sphere in six charts", Head("sphere", ball, Maps()), BALL_SIDE, everywhere)
    own = dermis.load_head("human")
    rows += row(renderer, "human, neck and back of the head", own, HEAD_SIDE, seen)
    rows += row(renderer, "human, eye sockets and inside of the mouth", own, HEAD_SIDE, hidden)
    human = dermis.load_head(Path(os.environ["DERMIS_DATA"]) / HUMAN, unit_mm=100, subdivide=0)
    human = replace(human, maps=Maps())
    rows += row(renderer, "MakeHuman, neck", human, HEAD_SIDE, at_neck)
    return rows + row(renderer, "MakeHuman, back of the head", human, HEAD_SIDE, behind)


def everywhere(places: np.ndarray) -> np.ndarray:
    """Which of the places (n, 3) [mm from the head's centre] count: all."""
    return np.ones(len(places), bool)


def at_neck(places: np.ndarray) -> np.ndarray:
    """Places on the neck and below it."""
    return (places[:, 1] < -90.0) & (places[:, 2] < 60.0)


def behind(places: np.ndarray) -> np.ndarray:
    """Places on the back of the head."""
    return (places[:, 1] > -90.0) & (places[:, 2] < -30.0)


def seen(places: np.ndarray) -> np.ndarray:
    """Places of the human's seams that can be seen."""
    return np.asarray(at_neck(places) | behind(places))


def hidden(places: np.ndarray) -> np.ndarray:
    """Places of its other seams."""
    return ~seen(places)


def row(
    renderer: Renderer, name: str, head: Head, side: int, where: Callable[[np.ndarray], np.ndarray]
) -> list[str]:
    """One line of the table, a column for each remedy."""
    one, other = judged(head, where)
    cells = []
    for remedy in REMEDIES:
        found = jumps(renderer, banded(head), remedy, side, one, other)
        cells.append(f"{100 * found.mean():.1f} / {100 * np.percentile(found, 95):.1f}")
    return [f"| {name} | {len(one.triangle)} | {' | '.join(cells)} |"]


def judged(head: Head, where: Choice) -> tuple[Points, Points]:
    """Both sides of the places along seams that face the lights."""
    mesh = head.mesh
    one, other = seam_points(mesh)
    places = one.on(mesh.positions[mesh.triangles]) - head.centre_mm
    kept = where(places) & (np.abs(one.on(mesh.normals[mesh.triangles])[:, 2]) > LEAST_FACING)
    for size in (BALL_SIDE, HEAD_SIDE):
        for layout in ("mesh", "stitched"):
            mapped = cached_atlas(head.topology.mesh, size, layout).mapped
            kept &= mapped[one.triangle] & mapped[other.triangle]
    return Points(one.triangle[kept], one.weights[kept]), Points(other.triangle[kept], other.weights[kept])


def banded(head: Head) -> Scene:
    """Bands of light with hard ends from the front and from behind, and a little light besides."""
    x = head.mesh.positions[:, 0] - head.centre_mm[0]
    places = np.arange(max(x.min(), -90.0), min(x.max(), 90.0), SPACING_MM)
    stripe = partial(StripeLight, up=(0.4, 1, 0), width_mm=WIDTH_MM, shadows=False)
    lights: list[Light] = []
    for away in ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)):
        lights += [stripe(direction=away, position=(place, 0, 0)) for place in places]
        lights.append(DirectionalLight(direction=away, irradiance=(1, 1, 1), shadows=False))
    skin = Skin(profile="gpu-gems-3", albedo="profile", specular="none", direction="lambertian")
    return Scene(replace(head, maps=Maps()), lights=lights, skin=skin)


def jumps(renderer: Renderer, scene: Scene, remedy: str, side: int, one: Points, other: Points) -> np.ndarray:
    """Change of red light from one side of each seam to the other, of the light there."""
    asked = {"size": (16, 16), "atlas": side, "seams": remedy, "transmission": "none"}
    settings = Settings.model_validate(asked | {"interreflection": False})
    renderer.draw(scene, settings)
    scattered = renderer.prepare(scene, settings).resources.scattered
    light = download(renderer.device, scattered).astype(float)[..., :3]
    atlas = cached_atlas(scene.head.topology.mesh, side, REMEDIES[remedy].layouts[0])
    a, b = (lit_at(light, atlas, points)[:, 0] for points in (one, other))
    return np.abs(a - b) / np.maximum((a + b) / 2, 1e-9)
