"""Export to glTF: formulas, validity of the files, and reading them back."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_rules import check_rules, khronos_issues

from dermis import Human, load_head
from dermis.apps.export.fitting import profile_error
from dermis.apps.export.run import export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.targets.gltf.target import DRAFT_NOTICE, SCATTER_VARIANT, TARGET, TRANSMISSION_VARIANT
from dermis.apps.export.targets.gltf.volume import (
    Volume,
    fit_volume,
    multiscatter_colour,
    multiscatter_for_reflectance,
    single_scattering_albedo,
    volume_from_mean_free_paths,
    volume_profile,
)
from dermis.human.hair.look import HairLook
from dermis.human.person_file import write_person_glb
from dermis.optics.tissue import load_tissue

SCATTER_EXTENSIONS = {"KHR_materials_scatter", "KHR_materials_transmission", "KHR_materials_volume"}
TRANSMISSION = "KHR_materials_diffuse_transmission"


@pytest.fixture(scope="module")
def person(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return files of a head in both variants; its name contains quotes and code."""
    folder = tmp_path_factory.mktemp("glb")
    source = folder / 'x"; import os; <script>.glb'
    human = replace(Human.sampled(7), hair=HairLook("cropped"))
    write_person_glb(source, human, human.head(subdivide=0, hairs=0.1), roughness=0.3)
    subject = load_subject(source, colour=brown(folder), subdivide=0)
    files = {variant: folder / f"{variant}.glb" for variant in (SCATTER_VARIANT, TRANSMISSION_VARIANT)}
    for variant, file in files.items():
        export_skin(subject, "gltf", file, variant=variant)
    return files


def brown(folder: Path) -> Path:
    """Write a picture with one colour in its left half and another in its right."""
    from dermis.images.io import write_png

    picture = np.full((64, 64, 3), (188, 137, 113), np.uint8)
    picture[:, 32:] = (120, 80, 60)
    write_png(folder / "brown.png", picture)
    return folder / "brown.png"


def skin_of(file: Path) -> dict[str, Any]:
    """Return the skin material of a valid file."""
    (found,) = [one for one in check_rules(file).tree["materials"] if "dermis" in one.get("extras", {})]
    return dict(found)


def test_albedo_inversion_matches_van_de_hulst() -> None:
    """The draft prints one direction; the other is the published inverse of the approximation."""
    albedo = np.array([0.3, 0.7, 0.9, 0.99, 0.999])
    np.testing.assert_allclose(single_scattering_albedo(multiscatter_colour(albedo)), albedo, atol=2e-5)
    s = np.sqrt(1 - 0.9)
    assert multiscatter_colour(0.9) == pytest.approx((1 - s) * (1 - 0.139 * s) / (1 + 1.17 * s))
    assert single_scattering_albedo(0.5, 0.8) > single_scattering_albedo(0.5)


def test_volume_keeps_the_mean_free_paths() -> None:
    """Colours stay within 0 and 1 for any ratio of the channels."""
    paths = np.array([1.3, 0.9, 0.05])
    volume = volume_from_mean_free_paths(paths, (0.6, 0.4, 0.2))
    assert volume.distance_m == pytest.approx(1.3e-3) and ((volume.colour > 0) & (volume.colour < 1)).all()
    np.testing.assert_allclose(volume.mean_free_path_mm, paths, rtol=1e-6)


@pytest.mark.parametrize("name", ["skin1", "skin2", "marble"])
def test_homogeneous_skin_is_exported_unchanged(name: str) -> None:
    """The fit finds the mean free path and albedo of the tissue."""
    tissue, subject = load_tissue(name), load_subject(name)
    volume, layer = fit_volume(subject.curve), tissue.medium.layers[0]
    np.testing.assert_allclose(volume.mean_free_path_mm, layer.mean_free_path_mm, rtol=0.01)
    np.testing.assert_allclose(single_scattering_albedo(volume.multiscatter), layer.alpha_prime, atol=0.003)
    found = profile_error(subject.curve, volume_profile(volume))
    assert found.cdf.max() < 0.003 and found.edge.max() < 0.001 and np.abs(found.energy).max() < 0.005


def test_albedo_without_inversion_would_lose_light() -> None:
    """Below a refracting surface, half of the red light of skin1 would be lost, as the documentation says."""
    subject = load_subject("skin1")
    volume = fit_volume(subject.curve)
    found = profile_error(
        subject.curve, volume_profile(Volume(volume.distance_m, volume.colour, subject.curve.energy))
    )
    np.testing.assert_allclose(found.energy, [-0.50, -0.61, -0.64], atol=0.03)
    np.testing.assert_allclose(
        multiscatter_for_reflectance(subject.curve.energy), volume.multiscatter, atol=1e-6
    )


@pytest.mark.parametrize("name", ["skin1", "dj3"])
def test_typed_values_have_larger_error(name: str) -> None:
    subject = load_subject(name)
    target = TARGET.with_variant(SCATTER_VARIANT)
    best, naive = (
        profile_error(subject.curve, target.predicted_profile(rows, subject, "2.0"))
        for rows in (target.parameters(subject, "2.0"), target.naive_parameters(subject, "2.0"))
    )
    assert np.abs(best.energy).max() < 0.005 < 0.3 < np.abs(naive.energy).min()
    assert best.cdf.max() < (0.005 if name == "skin1" else 0.2) and best.cdf.sum() < naive.cdf.sum()


def test_no_scattering_means_no_spread() -> None:
    subject, target = load_subject("skin1"), TARGET.with_variant(TRANSMISSION_VARIANT)
    rows = target.parameters(subject, "2.0")
    found = profile_error(subject.curve, target.predicted_profile(rows, subject, "2.0"))
    assert found.cdf.min() > 0.9 and found.edge.min() > 0.4
    values = {row.name.rpartition(".")[2]: row.value for row in rows}
    assert 0.0 < values["diffuseTransmissionFactor"] < 0.3
    red, green, blue = values["diffuseTransmissionColorFactor"]  # type: ignore[misc]
    assert red == 1.0 > green > blue > 0.0


def test_skin_without_head_is_exported_as_a_ball(tmp_path: Path) -> None:
    report = export_skin("skin1", "gltf", tmp_path / "ball.glb", variant=SCATTER_VARIANT)
    document = check_rules(tmp_path / "ball.glb")
    tree, skin = document.tree, skin_of(tmp_path / "ball.glb")
    positions = document.read_floats(tree["meshes"][0]["primitives"][0]["attributes"]["POSITION"])
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 0.05, rtol=1e-5)
    assert set(tree["extensionsUsed"]) >= SCATTER_EXTENSIONS and "extensionsRequired" not in tree
    assert (
        tree["asset"]["extras"]["draft"] == DRAFT_NOTICE == skin["extras"]["draft"]
        and DRAFT_NOTICE in report.limitations
    )
    assert skin["pbrMetallicRoughness"]["baseColorFactor"] == [1.0, 1.0, 1.0, 1.0]
    for row in report.parameters:
        extension, _, member = row.name.partition(".")
        written = skin["extensions"][extension][member]
        assert (tuple(written) if isinstance(written, list) else written) == row.value


def test_head_colours_equal_the_map(person: dict[str, Path]) -> None:
    """Each texel of the multiscatter texture is the colour that reproduces the reflectance in the map."""
    from io import BytesIO

    from PIL import Image

    document = check_rules(person[SCATTER_VARIANT])
    skin = skin_of(person[SCATTER_VARIANT])
    scatter = skin["extensions"]["KHR_materials_scatter"]
    assert scatter["multiscatterColorFactor"] == [1.0, 1.0, 1.0]
    image = document.tree["images"][scatter["multiscatterColorTexture"]["index"]]
    pixels = np.asarray(Image.open(BytesIO(document.read_view(image["bufferView"]))).convert("RGB"))
    linear = lambda levels: ((np.asarray(levels) / 255 + 0.055) / 1.055) ** 2.4  # noqa: E731
    for texel, levels in ((pixels[10, 10], (188, 137, 113)), (pixels[10, 50], (120, 80, 60))):
        np.testing.assert_allclose(linear(texel), multiscatter_for_reflectance(linear(levels)), atol=0.01)
    assert document.tree["meshes"][0]["extras"]["targetNames"][:1] and document.tree["skins"]
    assert {"left eye", "right eye"} <= {one["name"] for one in document.tree["materials"]}


def test_diffuse_transmission_has_the_usual_colours(person: dict[str, Path]) -> None:
    skin = skin_of(person[TRANSMISSION_VARIANT])
    assert "baseColorTexture" in skin["pbrMetallicRoughness"] and TRANSMISSION in skin["extensions"]
    assert not SCATTER_EXTENSIONS & set(skin["extensions"]) and "draft" not in skin["extras"]
    assert "draft" not in check_rules(person[TRANSMISSION_VARIANT]).tree["asset"].get("extras", {})


@pytest.mark.parametrize("variant", [SCATTER_VARIANT, TRANSMISSION_VARIANT])
def test_exported_head_reads_back_unchanged(person: dict[str, Path], variant: str) -> None:
    back = load_head(person[variant])
    assert back.maps.colour is not None and back.eyes is not None and "jawOpen" in back.targets
    linear = ((np.array([188, 137, 113]) / 255 + 0.055) / 1.055) ** 2.4
    np.testing.assert_allclose(back.maps.colour[10, 10], linear, atol=0.005)
    assert back.eyes.look == Human.sampled(7).iris


@pytest.mark.parametrize("variant", [SCATTER_VARIANT, TRANSMISSION_VARIANT])
def test_the_khronos_validator_finds_no_errors(person: dict[str, Path], variant: str) -> None:
    found = khronos_issues(person[variant])
    assert found["numErrors"] == 0
    unknown = {one["message"] for one in found["messages"] if one["code"] == "UNSUPPORTED_EXTENSION"}
    assert all("KHR_materials_scatter" in one or TRANSMISSION in one for one in unknown)


def test_hostile_names_are_escaped(person: dict[str, Path]) -> None:
    """The name of a head is a JSON string, and the file contains no path of its source."""
    data = person[SCATTER_VARIANT].read_bytes()
    tree = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    assert tree["scenes"][0]["name"] == 'x"; import os; <script>'
    assert str(person[SCATTER_VARIANT].parent).encode() not in data


def test_equal_exports_are_identical_files(tmp_path: Path) -> None:
    subject: Subject = load_subject("dj3")
    for name in ("a.glb", "b.glb"):
        export_skin(subject, "gltf", tmp_path / name)
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
