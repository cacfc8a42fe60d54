"""The public names, and the six lines of the package's description on a small head."""

from __future__ import annotations

import inspect
import pydoc
import subprocess
import sys
import tomllib
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from small_head import write_head

import dermis
import dermis.scene
from dermis.gpu.device import Device
from dermis.images.io import read_image


def test_names_are_listed_in_order_with_their_modules() -> None:
    assert dermis.__all__ == sorted(dermis.__all__, key=lambda name: (name[0].islower(), name))
    assert set(dermis.__all__) == set(dermis._MODULE_OF_NAME)


@pytest.mark.parametrize("name", dermis.__all__)
def test_each_name_resolves_and_has_a_docstring(name: str) -> None:
    thing = getattr(dermis, name)
    assert thing.__name__ == name
    assert inspect.getmodule(thing).__name__ == f"dermis.{dermis._MODULE_OF_NAME[name]}"
    text = thing.__doc__ or ""
    assert len(text.splitlines()[0]) > 20, "no docstring of its own"
    assert text != (inspect.getdoc(thing.__mro__[1]) if inspect.isclass(thing) else None)
    assert pydoc.getdoc(thing)


@pytest.mark.parametrize("name", ["load_heads", "Skn", "_", "scne"])
def test_unknown_names_are_attribute_errors(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'dermis' has no attribute '{name}'"):
        getattr(dermis, name)


def test_dir_lists_all_names_before_import() -> None:
    code = "import dermis; assert set(dermis.__all__) <= set(dir(dermis)); assert '_HOME' not in dir(dermis)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_version_is_that_of_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    monkeypatch.delitem(vars(dermis), "__version__", raising=False)
    assert dermis.__version__ == version("dermis") and "__version__" in dir(dermis)

    def unknown(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.delitem(vars(dermis), "__version__")
    monkeypatch.setattr("importlib.metadata.version", unknown)
    assert dermis.__version__ == project["version"]


@pytest.mark.parametrize("module", [dermis, dermis.scene])
def test_old_names_warn_and_work(module: ModuleType) -> None:
    with pytest.warns(DeprecationWarning, match=r"profile is now dermis\.(scene\.)?side; .*") as warned:
        assert module.profile is dermis.side
    assert [one.filename for one in warned] == [__file__]
    assert "profile" not in dir(module) and "profile" not in module.__all__


OLD_MODULES = """
import sys, warnings
from importlib import import_module
from dermis.base.renamed import RENAMED_MODULES
for old, new in RENAMED_MODULES.items():
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        module = import_module(f"dermis.{old}")
    assert module is import_module(f"dermis.{new}") is sys.modules[f"dermis.{old}"], old
    assert module.__name__ == module.__spec__.name == f"dermis.{new}", old
    (warning,) = warned
    assert str(warning.message).startswith(f"dermis.{old} is now dermis.{new}; the old name"), warning
with warnings.catch_warnings(record=True) as warned:
    warnings.simplefilter("always")
    from dermis.unmixing.unmix import Change
assert [one.filename for one in warned] == [__file__] * 2, warned
from dermis.apps.inverse.unmixing import unmix
assert Change is unmix.PigmentChange
"""


def test_old_modules_warn_and_alias_the_new_ones(tmp_path: Path) -> None:
    script = tmp_path / "old.py"
    script.write_text(OLD_MODULES)
    subprocess.run([sys.executable, str(script)], check=True)


def test_star_import_gives_the_public_names() -> None:
    names: dict[str, object] = {}
    exec("from dermis import *", names)
    assert set(dermis.__all__) <= set(names)


def test_readme_example_lines_run(tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    head = dermis.load_head(write_head(tmp_path / "head.obj"))
    scene = dermis.Scene(head, lights=dermis.studio(), camera=dermis.portrait(head))
    image = dermis.render(scene, size=(48, 32), atlas=64)
    assert image.shape == (32, 48, 3) and image.dtype == np.float32
    assert np.isfinite(image).all() and image[16, 24].min() > 0.01
    dermis.write_image(tmp_path / "head.exr", image)
    assert (tmp_path / "head.exr").stat().st_size > 1000


def test_render_function_reuses_its_renderer(
    tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    head = dermis.load_head(write_head(tmp_path / "head.obj"))
    renderer = dermis.Renderer()
    front = dermis.Scene(head)
    side = dermis.Scene(head, camera=dermis.side(head), skin=dermis.Skin(mix=0.2))
    first = renderer.render(front, size=(32, 32), atlas=64)
    other = renderer.render(side, size=(32, 32), atlas=64)
    again = renderer.render(front, size=(32, 32), atlas=64)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(first, again)


def test_single_head_is_drawn_as_a_portrait(
    tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    head = dermis.load_head(write_head(tmp_path / "head.obj"))
    whole = dermis.render(dermis.Scene(head), size=32, atlas=64)
    np.testing.assert_array_equal(dermis.render(head, size=32, atlas=64), whole)
    for wrong, said in ((None, "got None"), ((dermis.Scene(head), 1), "got"), ("s.toml", "load_scene")):
        with pytest.raises(dermis.DermisError, match=f"^scene: expected a head to show, .*{said}"):
            dermis.render(wrong)  # type: ignore[arg-type]
    with pytest.raises(dermis.DermisError, match=r"^adapter: .*got a Settings\. .*draw\(scene, settings\)"):
        dermis.render(head, dermis.Settings())  # type: ignore[arg-type]


def test_write_image_accepts_levels_and_linear_values(tmp_path: Path) -> None:
    levels = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    dermis.write_image(tmp_path / "a.png", levels)
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), levels)
    linear = np.full((4, 4, 3), 0.5)
    dermis.write_image(tmp_path / "b.png", linear.tolist())  # type: ignore[arg-type]
    assert read_image(tmp_path / "b.png").max() == 188
    for path, picture in ((tmp_path / "a.exr", levels), (linear, "a.png"), (tmp_path / "a.png", np.ones(3))):
        with pytest.raises(dermis.DermisError, match=r"expected .* but .*\."):
            dermis.write_image(path, picture)  # type: ignore[arg-type]
    assert not (tmp_path / "a.exr").exists()


@pytest.mark.parametrize(
    ("slip", "said"),
    [
        (lambda path: dermis.load_head(path, unit_mm="cm"), r"unit_mm: .*got 'cm'\. Write unit_mm=10\."),
        (lambda path: dermis.load_head(path, unit_mm="ell"), "unit_mm: .*got 'ell'"),
        (lambda path: dermis.load_head(path, subdivide=1.0), "subdivide: .*got 1.0"),
        (lambda path: dermis.load_head(path, colour=np.ones((8, 8, 3))), "colour: .*got a ndarray"),
        (lambda path: dermis.load_head(dermis.load_head(path)), "load_head: .*got a Head"),
        (lambda path: dermis.load_head(path, opaque="eyes"), "'eyes' is none"),
        (lambda path: dermis.load_lights(None), "file: .*got a NoneType"),
        (lambda path: dermis.load_scene(None), "file: .*got a NoneType"),
        (lambda path: dermis.Human(sex="male"), "sex: expected a number from 0 to 1, but got 'male'"),
        (lambda path: dermis.Human(targets=["nose"]), "targets: expected weights of targets by name"),
    ],
)
def test_usage_errors_have_a_message(slip: Callable[[Path], object], said: str, tmp_path: Path) -> None:
    with pytest.raises(dermis.DermisError, match=said):
        slip(write_head(tmp_path / "head.obj"))


@pytest.mark.parametrize("name", ["bust", "bust_many_charts"])
def test_removed_heads_name_their_replacement(name: str, tmp_path: Path) -> None:
    with pytest.raises(dermis.DermisError, match=rf"^{name}: .* replaced by .*'human'\. Write human instead"):
        dermis.load_head(name)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'[head]\nname = "{name}"\n')
    with pytest.raises(dermis.DermisError, match="Write human instead"):
        dermis.load_scene(scene)


def test_errors_share_one_base_class() -> None:
    with pytest.raises(dermis.DermisError, match=r"expected .* but .*\."):
        dermis.load_head("nobody.obj")
    with pytest.raises(dermis.DermisError, match=r"expected .* but .*\."):
        dermis.Settings(size=(0, 0))
