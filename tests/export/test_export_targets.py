"""Export targets: inverse of their formulas, and the contents of their files."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest
import yaml

from dermis.apps.export.fitting import fit_burley_width
from dermis.apps.export.registry import TARGETS
from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import Subject, load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.unity.target import Unity, asset_text
from dermis.base.errors import DermisError

LOBES = ["unity", "unreal", "renderman"]
KNOWN = """
boundary_color_bleed enable_burley enable_mean_free_path extinction_scale implementation ior lobe_mix
mean_free_path_color mean_free_path_distance normal_scale roughness0 roughness1 scattering_distribution
surface_albedo tint transmission_tint_color world_unit_scale"""
UNREAL = """
AssetImportTask AssetToolsHelpers EditorAssetLibrary LinearColor Material MaterialEditingLibrary
MaterialFactoryNew MaterialExpressionScalarParameter MaterialExpressionTextureSampleParameter2D
MaterialExpressionVectorParameter
MaterialInstanceConstant MaterialInstanceConstantFactoryNew MaterialProperty MaterialSamplerType
MaterialShadingModel SkeletalMesh StaticMesh SubsurfaceProfile SubsurfaceProfileFactory
TextureCompressionSettings log"""
EVIL = '"; import os; os._exit(3) # \n'


@pytest.mark.parametrize("name", LOBES)
def test_parameters_reproduce_the_fitted_lobe_in_all_versions(name: str, skin1: Subject) -> None:
    target = TARGETS[name].with_variant(None)
    for version in target.versions:
        predicted = target.predicted_profile(target.parameters(skin1, version), skin1, version)
        np.testing.assert_allclose(fit_burley_width(predicted), fit_burley_width(skin1.curve), rtol=1e-4)


@pytest.mark.parametrize("name", [*LOBES, "arnold"])
def test_exported_values_beat_typed_values(name: str, dj3: Subject) -> None:
    target = TARGETS[name].with_variant(None)
    report = evaluate_export(dj3, target, target.versions[-1])
    assert (report.error.cdf < report.naive_error.cdf).all()
    assert (report.error.edge < report.naive_error.edge).all()
    assert "red light" in report.limitation_texts()[0]


def test_unity_reads_its_asset_back(skin1: Subject, tmp_path: Path) -> None:
    report = export_skin(skin1, "unity", tmp_path / "skin.asset")
    text = (tmp_path / "skin.asset").read_text("utf-8").replace("!u!114 ", "").replace("%TAG", "#")
    content = yaml.safe_load(text)["MonoBehaviour"]
    own = content["profile"]
    distance = np.array([own["scatteringDistance"][c] for c in "rgb"]) * own["scatteringDistanceMultiplier"]
    np.testing.assert_allclose(distance, report.d_mm, rtol=1e-4)
    assert (content["m_Version"], content["m_Name"], own["worldScale"], own["hash"]) == (2, "skin", 1, 0)


def test_unity_before_14_stores_the_width_in_the_colour_only(skin1: Subject) -> None:
    rows = TARGETS["unity"].parameters(skin1, "12")
    text = asset_text("skin", rows, "12")
    assert "scatteringDistanceMultiplier" not in text and "m_Version: 1\n" in text
    np.testing.assert_allclose(get_numbers(rows, "scatteringDistance"), fit_burley_width(skin1.curve))


class _Settings:
    """Settings of Unreal's editor, which refuse fields that its documentation does not name."""

    known = frozenset(KNOWN.split())

    def __init__(self, *more: str) -> None:
        self.allowed, self.values = self.known | {*more}, dict[str, Any]()

    def set_editor_property(self, name: str, value: Any) -> None:
        if name not in self.allowed:
            raise AttributeError(name)
        self.values[name] = value


def _editor(settings: _Settings, saved: list[Any]) -> ModuleType:
    """Return a stub of the module `unreal` with the functions that the script may use for a bare skin."""
    stored = {}
    profile = SimpleNamespace(
        get_editor_property={"settings": settings}.__getitem__,
        set_editor_property=stored.__setitem__,
        get_path_name=lambda: "/Game/Dermis/x",
    )
    tools = SimpleNamespace(create_asset=lambda *arguments: saved.append(arguments) or profile)
    unreal: Any = MagicMock(spec_set=UNREAL.split())
    unreal.AssetToolsHelpers = SimpleNamespace(get_asset_tools=lambda: tools)
    unreal.EditorAssetLibrary = SimpleNamespace(
        does_asset_exist=lambda path: False, save_loaded_asset=saved.append
    )
    unreal.LinearColor = lambda *channels: channels
    return unreal  # type: ignore[no-any-return]


@pytest.mark.parametrize(("version", "more"), [("5.7", ()), ("5.8", ("distance_scale",))])
def test_unreal_runs_its_script(
    version: str, more: tuple[str, ...], skin1: Subject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = export_skin(skin1, "unreal", tmp_path / "skin.py", version=version)
    settings, saved = _Settings(*more), list[Any]()
    monkeypatch.setitem(sys.modules, "unreal", _editor(settings, saved))
    runpy.run_path(str(tmp_path / "skin.py"))
    found = settings.values
    assert found["enable_burley"] is True and found["enable_mean_free_path"] is True
    assert found["world_unit_scale"] * found.get("distance_scale", 0.1) == pytest.approx(0.1)
    A = np.array(found["surface_albedo"][:3])
    path_mm = 10.0 * np.array(found["mean_free_path_color"][:3]) * found["mean_free_path_distance"]
    d = path_mm / (0.6 * (1.85 - A + 7.0 * np.abs(A - 0.8) ** 3))
    np.testing.assert_allclose(d, report.d_mm, rtol=1e-4)
    created = [one[:2] for one in saved if isinstance(one, tuple)]
    assert created == [(name, "/Game/Dermis") for name in ("skin1", "M_skin1", "MI_skin1")]


@pytest.mark.parametrize("name", [*LOBES, "arnold"])
def test_hostile_names_are_escaped(name: str, skin1: Subject, tmp_path: Path) -> None:
    evil = Subject(EVIL, skin1.curve, skin1.albedo, skin1.model, skin1.tissue)
    assert evil.identifier.isidentifier()
    report = export_skin(
        evil, name, tmp_path / "export" if name != "renderman" else tmp_path / "export_.json"
    )
    for file in report.files:
        text = file.read_text("utf-8")
        if file.suffix == ".json":
            json.loads(text)
        elif file.suffix == ".py":
            compile(text, str(file), "exec")
            assert "os._exit" not in text
        assert str(tmp_path) not in text


@pytest.mark.parametrize("name", ["renderman", "arnold"])
def test_values_are_marked_as_not_rendered(name: str, skin1: Subject, tmp_path: Path) -> None:
    export_skin(skin1, name, tmp_path / "values.json")
    content = json.loads((tmp_path / "values.json").read_text("utf-8"))
    assert content["status"].startswith("not run") and content["parameters"]
    assert all(row["unit"] and row["meaning"] for row in content["parameters"].values())


def test_only_export_folders_are_replaced(skin1: Subject, tmp_path: Path) -> None:
    folder = tmp_path / "exported"
    for _ in range(2):
        export_skin(skin1, "unity", folder)
    assert sorted(file.name for file in folder.iterdir()) == ["README.md", "export.json", "skin1.asset"]
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "work.txt").write_text("mine")
    with pytest.raises(DermisError, match=r"a folder that holds export\.json"):
        export_skin(skin1, "unity", tmp_path / "own")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["exported", "own"]


@pytest.mark.parametrize("name", ["mine", "none/such"])
def test_folders_are_checked_before_the_head_is_loaded(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "work.txt").write_text("precious")
    loaded = MagicMock()
    monkeypatch.setattr("dermis.apps.export.run.load_subject", loaded)
    with pytest.raises(DermisError, match=r"expected a (free name|writable path)"):
        export_skin("human:7", "unity", tmp_path / name)
    assert not loaded.called and [file.name for file in tmp_path.rglob("*")] == ["mine", "work.txt"]


def test_unknown_names_are_reported_with_known_ones(skin1: Subject, tmp_path: Path) -> None:
    with pytest.raises(DermisError, match="target: expected one of arnold, "):
        export_skin(skin1, "quake", tmp_path / "x")
    with pytest.raises(DermisError, match=r"a supported version of Unity HDRP: 12, 14, 17, but got '3'"):
        export_skin(skin1, "unity", tmp_path / "x", version="3")
    with pytest.raises(DermisError, match="variant: expected none for unity"):
        export_skin(skin1, "unity", tmp_path / "x", variant="thick")
    with pytest.raises(DermisError, match=r"ends in \.asset or no suffix"):
        export_skin(skin1, "unity", tmp_path / "x.png")
    assert not list(tmp_path.iterdir())


def test_written_files_contain_the_file_name_without_folder(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("variances_mm2 = [0.1, 2.0]\nweights = [[0.3, 0.2, 0.1], [0.3, 0.1, 0.1]]\n")
    files = export_skin(load_subject(file), "unity", tmp_path / "out").files
    assert load_subject(file).name == "mine.toml"
    assert all(str(tmp_path).encode() not in path.read_bytes() for path in files)


def test_registered_target_is_exported(tmp_path: Path) -> None:
    class Toy(Unity):
        name = "toy"
        title = "Toy"

    with TARGETS.temporary_entry("toy", Toy()):
        report = export_skin("skin1", "toy", tmp_path / "skin.asset")
    assert report.files[0].name == "skin.asset" and report.files[0].exists()
    with pytest.raises(DermisError, match=r"target: expected one of arnold, .*got 'toy'"):
        export_skin("skin1", "toy", tmp_path / "again.asset")
