"""Painted skin of a human: colours of pigments, marks, relief, and changes by expressions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from setups import settings_of
from tolerances import SITE_PAINTED

from dermis import Human
from dermis.atlas.raster import rasterise
from dermis.base.errors import DermisError
from dermis.base.tables import read_rows
from dermis.frame.features.surface.painting import paint
from dermis.frame.features.surface.painting import paint as given
from dermis.frame.features.surface.painting.painted_head import with_painted_maps
from dermis.frame.renderer import Renderer
from dermis.gpu import Device, download
from dermis.human.regions.average import average_positions
from dermis.human.skin.colours import skin_colour_table
from dermis.human.skin.face import MOVEMENTS, movement_weights
from dermis.human.skin.look import SkinLook
from dermis.human.skin.measured import SiteDifferences
from dermis.human.skin.painted import PaintedMaps, mean_colour
from dermis.human.skin.surface import BORDER_FIELDS, PaintedSurface, painted_surface
from dermis.images.colour import lab
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.scene.lights import studio
from dermis.scene.model import Scene

Floats = NDArray[np.float32]
SIDE = 256
BARE = SkinLook(freckles=0, moles=0, spots=0, veins=0, stubble=0, beard=0, tan=0, age=0)
"""Skin without marks."""


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head()


@pytest.fixture(scope="module")
def surface(head: Head) -> PaintedSurface:
    return painted_surface(head.mesh, head.control_rig.stencils)


def painted(device: Device, surface: PaintedSurface, look: SkinLook = BARE, side: int = SIDE) -> Maps:
    return paint.paint_arrays(device, surface, look, side)


def covered(head: Head, side: int = SIDE) -> NDArray[np.bool_]:
    """Return the (side, side) mask of texels on the skin."""
    kinds = np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]
    texel, _ = rasterise(head.mesh, side, np.flatnonzero(kinds))
    found = np.zeros(side * side, bool)
    found[texel] = True
    return found.reshape(side, side)


def fields(head: Head, surface: PaintedSurface, name: str, side: int = SIDE) -> Floats:
    """Return the (side, side) distances at texels on the skin, large elsewhere [mm]."""
    kinds = np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]
    texel, triangle = rasterise(head.mesh, side, np.flatnonzero(kinds))
    values = surface.vertices[:, 8 + BORDER_FIELDS.index(name)]
    found = np.full(side * side, -99.0, np.float32)
    found[texel] = values[head.mesh.triangles[triangle]].mean(axis=1)
    return found.reshape(side, side)


def grey(maps: Maps) -> Floats:
    assert maps.colour is not None
    return np.asarray(maps.colour.mean(axis=-1))


def test_the_same_look_is_the_same_paint_to_the_bit(device: Device, surface: PaintedSurface) -> None:
    first, second = painted(device, surface), painted(device, surface)
    for role in ("colour", "height", "specular", "roughness"):
        assert np.array_equal(getattr(first, role), getattr(second, role)), role


def test_colours_are_those_of_the_pigments(device: Device, surface: PaintedSurface, head: Head) -> None:
    """Every colour of bare skin is in the table for some melanin and blood, except inside the lids."""
    maps, on = painted(device, surface), covered(head)
    assert maps.colour is not None
    outside = on & (fields(head, surface, "lips") < -6) & (fields(head, surface, "lids") > 0.5)
    assert outside.sum() > 0.9 * on.sum()
    bare = maps.colour[outside][::37]
    table = skin_colour_table(BARE.eumelanin, BARE.oxygen, DEFAULT_SKIN.epidermis_mm)
    melanin, blood = np.meshgrid(
        BARE.melanin * 2 ** np.linspace(-2, 2, 81), BARE.blood * 2 ** np.linspace(-2, 4, 121)
    )
    known = table.lookup(melanin.ravel(), blood.ravel())
    away = np.abs(bare[:, None, :] - known[None]).max(axis=-1).min(axis=1)
    assert away.max() < 0.012


def test_its_mean_is_that_of_the_look(device: Device, surface: PaintedSurface, head: Head) -> None:
    for look in (BARE, replace(BARE, melanin=0.2), replace(BARE, melanin=0.004, blood=0.005)):
        maps = painted(device, surface, look)
        assert maps.colour is not None
        mean = maps.colour[covered(head)].mean(axis=0)
        np.testing.assert_allclose(mean, mean_colour(look), rtol=0.16)


def test_sites_have_their_measured_pigments(device: Device, surface: PaintedSurface, head: Head) -> None:
    """Compare medians around each place of sites.csv with the colour of its pigments, in two patterns."""
    kinds = np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]
    texel, triangle = rasterise(head.mesh, 512, np.flatnonzero(kinds))
    corners = head.mesh.triangles[triangle]
    points = np.abs(average_positions(head)[corners].mean(axis=1) * (1, 0, 0)) + average_positions(head)[
        corners
    ].mean(axis=1) * (0, 1, 1)
    plain = SiteDifferences()
    patterned = SiteDifferences(
        forehead=(0.8, 0.4, -0.2), nose_tip=(0.3, 0.8, 0.0), neck=(0.5, -1.2, 0.1), ear_lobe=(0.2, 0.7, -0.3)
    )
    for sites in (plain, patterned):
        look = replace(BARE, melanin=0.05, oxygen=0.8, tan=0.3, sites=sites)
        colour = painted(device, surface, look, 512).colour
        assert colour is not None
        for row in read_rows("dermis.human.skin", "sites"):
            difference = (0.0, 0.0, 0.0) if row["site"] == "cheek" else getattr(sites, row["site"])
            table = skin_colour_table(look.eumelanin, look.oxygen + difference[2], look.epidermis_mm)
            pigments = look.melanin * 2.0 ** difference[0], look.blood * 2.0 ** difference[1]
            expected = lab(table.lookup(*(np.array([one]) for one in pigments))[0])
            near = np.linalg.norm(points - [float(row[axis]) for axis in "xyz"], axis=1) < 9.0
            found = np.median(lab(colour.reshape(-1, 3)[texel[near]]), axis=0)
            np.testing.assert_allclose(found, expected, atol=SITE_PAINTED, err_msg=row["site"])


def test_lips_are_redder_than_what_is_around(device: Device, surface: PaintedSurface, head: Head) -> None:
    maps, lips = painted(device, surface), fields(head, surface, "lips")
    mouth = fields(head, surface, "mouth")
    assert maps.colour is not None
    ratio = maps.colour[..., 0] / maps.colour[..., 1]
    around = ratio[(lips > -8) & (lips < -3)].mean()
    assert ratio[(lips > 1) & (mouth > 1)].mean() > 1.15 * around


def test_no_texel_beside_a_chart_is_black_or_high(device: Device, surface: PaintedSurface) -> None:
    maps = painted(device, surface, SkinLook(age=1.0))
    assert grey(maps).min() > 0.02
    assert maps.height is not None and np.isfinite(maps.height).all() and np.abs(maps.height).max() < 2.0


def test_what_is_asked_for_shows(device: Device, surface: PaintedSurface, head: Head) -> None:
    on = covered(head)
    plain = painted(device, surface)

    def change(**marks: float) -> float:
        other = painted(device, surface, replace(BARE, **marks))
        return float((grey(plain) - grey(other))[on].mean())

    for marks in ({"freckles": 1.0}, {"spots": 1.0}, {"stubble": 1.0}, {"beard": 1.0}, {"veins": 1.0}):
        assert change(**marks) > 1e-4, marks
    assert change(seed=1) == pytest.approx(0.0, abs=0.01)


def test_age_deepens_folds(device: Device, surface: PaintedSurface, head: Head) -> None:
    on = covered(head)
    depths = []
    for age in (0.0, 0.5, 1.0):
        height = painted(device, surface, replace(BARE, age=age)).height
        assert height is not None
        depths.append(-np.percentile(height[on], 0.2))
    assert depths[0] < 0.6 * depths[1] < 0.6 * depths[2]


def test_finer_maps_show_the_same_skin(device: Device, surface: PaintedSurface, head: Head) -> None:
    coarse, fine = painted(device, surface), painted(device, surface, side=2 * SIDE)
    assert coarse.colour is not None and fine.colour is not None
    halved = fine.colour.reshape(SIDE, 2, SIDE, 2, 3).mean(axis=(1, 3))
    inner = covered(head)
    assert np.abs(halved - coarse.colour)[inner].mean() < 0.01


def test_given_maps_stay_and_others_are_painted(device: Device, head: Head) -> None:
    own = np.full((16, 16), 0.4, np.float32)
    mixed = replace(head, maps=replace(head.maps, roughness=own))
    found = with_painted_maps(device, mixed, SIDE).maps
    assert found.roughness is own and found.colour is not None and found.height is not None
    other = replace(head, maps=Maps())
    assert with_painted_maps(device, other, SIDE) is other


def test_the_finest_mesh_is_painted_as_the_coarsest(
    device: Device, surface: PaintedSurface, head: Head
) -> None:
    """The finest mesh has the largest number of triangles."""
    fine = Human().head(subdivide=3)
    finest = painted_surface(fine.mesh, fine.control_rig.stencils)
    assert finest.triangle_count == 16 * surface.triangle_count
    both = [painted(device, one).colour for one in (surface, finest)]
    assert both[0] is not None and both[1] is not None
    apart = np.abs(both[0] - both[1]).max(axis=-1)[covered(head)]
    assert apart.mean() < 0.005 and (apart > 0.1).mean() < 0.01


def test_more_triangles_than_have_numbers_are_refused(
    device: Device, surface: PaintedSurface, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(given, "_MAX_PAINTED_TRIANGLES", surface.triangle_count)
    with pytest.raises(DermisError, match="Subdivide less"):
        painted(device, surface)


@pytest.mark.parametrize("side", [100, 128, 8192])
def test_sides_that_cannot_be_are_refused(device: Device, head: Head, side: int) -> None:
    with pytest.raises(DermisError, match="a power of two from 256 to 4096"):
        with_painted_maps(device, head, side)


def test_a_face_at_rest_is_the_one_without_a_pose(renderer: Renderer, head: Head) -> None:
    still = renderer.draw(Scene(head, lights=studio()), settings_of(atlas=256)).linear()
    posed = renderer.draw(
        Scene(head, lights=studio(), pose={"jawOpen": 0.0}), settings_of(atlas=256)
    ).linear()
    assert np.array_equal(still, posed)


def test_raised_brows_deepen_the_forehead_and_leave_the_chin(renderer: Renderer, head: Head) -> None:
    """Compare the relief on the device texel by texel."""
    chosen = settings_of(atlas=512)
    found = []
    for weight in (0.0, 1.0):
        scene = Scene(head, lights=studio(), pose={"browInnerUp": weight, "browOuterUpLeft": weight})
        renderer.draw(scene, chosen)
        lit = renderer.prepare(scene, chosen).bindings
        found.append(download(renderer.device, lit["relief_map"]).astype(np.float32)[..., :2])
    change = np.abs(found[1] - found[0]).max(axis=-1)
    surface = painted_surface(head.mesh, head.control_rig.stencils)
    kinds = np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]
    texel, triangle = rasterise(head.mesh, 512, np.flatnonzero(kinds))
    y = np.full(512 * 512, np.nan)
    y[texel] = surface.vertices[head.mesh.triangles[triangle], 3].mean(axis=1)
    y = y.reshape(512, 512)
    assert change[(y > 25) & (y < 60)].max() > 0.02
    assert (change[y < -20] > 1e-3).mean() < 1e-3  # but where charts meet in the map


def test_movements_are_those_of_their_targets() -> None:
    names = ("jawOpen", "browInnerUp", "mouthPressLeft")
    made = dict(zip(MOVEMENTS, movement_weights(names, np.array([0, 1, 0.5], np.float32)), strict=True))
    assert made["raised-brows"] == pytest.approx(0.8) and made["pressed"] == pytest.approx(0.25)
    assert made["smile"] == 0 and movement_weights(names, np.full(3, 9, np.float32)).max() == 1
    assert not movement_weights((), np.zeros(0, np.float32)).any()


def test_unposed_people_share_the_painted_places() -> None:
    """Positions and fields are those of the average person for all people."""
    one, other = (
        painted_surface(h.mesh, h.control_rig.stencils) for h in (Human().head(), Human(age=80, sex=1).head())
    )
    np.testing.assert_allclose(one.vertices[:, 2:5], other.vertices[:, 2:5], atol=1e-4)
    assert np.array_equal(one.triangles, other.triangles)


def test_looks_out_of_range_are_refused() -> None:
    with pytest.raises(DermisError, match="freckles"):
        SkinLook(freckles=1.5)
    with pytest.raises(DermisError, match="seed"):
        SkinLook(seed=0.5)  # type: ignore[arg-type]


def test_mean_colour_of_painted_maps_is_known_before_they_are_painted(head: Head) -> None:
    assert isinstance(head.maps, PaintedMaps) and head.maps.mean_colour is not None
    red, green, blue = head.maps.mean_colour
    assert red > green > blue


def test_the_wrong_gamma_is_wrong_for_painted_skin_too(renderer: Renderer, head: Head) -> None:
    right, wrong = (
        renderer.draw(Scene(head, lights=studio()), settings_of(atlas=256, gamma=gamma)).linear()
        for gamma in ("right", "wrong")
    )
    seen = right.max(axis=-1) > 0.05
    assert wrong[seen].mean() > 1.2 * right[seen].mean()


def near(
    surface: PaintedSurface, head: Head, place: tuple[float, float, float], radius_mm: float = 6.0
) -> NDArray[np.bool_]:
    """Return the (SIDE, SIDE) mask of texels near a place on the average person [mm]."""
    kinds = np.array([one.kind == "skin" for one in head.mesh.materials])[head.mesh.material]
    texel, triangle = rasterise(head.mesh, SIDE, np.flatnonzero(kinds))
    centres = surface.vertices[:, 2:5][head.mesh.triangles[triangle]].mean(axis=1)
    found = np.zeros(SIDE * SIDE, bool)
    found[texel[np.linalg.norm(centres - place, axis=1) < radius_mm]] = True
    return found.reshape(SIDE, SIDE)


def test_pores_and_tension_lines_are_those_of_the_site(
    device: Device, surface: PaintedSurface, head: Head
) -> None:
    pores, tension = np.moveaxis(
        paint.paint_raw_arrays(device, surface, BARE, SIDE).specular[..., [1, 3]], -1, 0
    )
    nose, forehead, lids = (
        float(np.median(pores[near(surface, head, place)]))
        for place in ((0, -37, 40), (20, 46, 19), (29, 6, 16))
    )
    assert nose > 1.3 * forehead > 2.0 * lids
    lips = (fields(head, surface, "lips") > 2.5) & (fields(head, surface, "mouth") > 1)
    assert lips.any() and pores[lips].max() < 1e-3
    left, right, middle = (
        float(np.median(tension[near(surface, head, place)]))
        for place in ((40, -35, 8), (-40, -35, 8), (0, 46, 22))
    )
    assert left > 0.6 and right < -0.6 and abs(middle) < 0.2


def test_blemishes_are_red_bumps_and_scars_are_pits(
    device: Device, surface: PaintedSurface, head: Head
) -> None:
    plain, cheek = painted(device, surface), near(surface, head, (40, -35, 8), 25.0)
    for field, rises in (("blemishes", True), ("scars", False)):
        other = painted(device, surface, replace(BARE, **{field: 1.0}))
        assert plain.colour is not None and other.colour is not None
        assert plain.height is not None and other.height is not None
        redder = (lab(other.colour) - lab(plain.colour))[cheek, 1]
        height = (other.height - plain.height)[cheek]
        assert redder.max() > 1.0 and redder.min() > -0.5
        assert (height.max() > 0.04 and height.min() > -0.01) == rises
        assert (height.min() < -0.02 and height.max() < 0.01) != rises


def test_veins_make_skin_below_the_eyes_bluer(device: Device, surface: PaintedSurface, head: Head) -> None:
    hues = []
    for veins in (0.0, 0.6):
        colour = painted(device, surface, replace(BARE, veins=veins)).colour
        assert colour is not None
        below, cheek = (
            np.median(lab(colour[near(surface, head, place)]), axis=0)
            for place in ((26, -12, 16), (38, -33, 13))
        )
        assert below[0] < cheek[0]
        hues.append(below[2] - cheek[2])
    assert hues[1] < hues[0] - 0.5
