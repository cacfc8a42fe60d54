"""The names that the package promises, and the six lines of its description on a small head."""

from __future__ import annotations

import inspect
import pydoc
from pathlib import Path

import numpy as np
import pytest
from small_head import write_head

import dermis
from dermis.gpu.device import Device


def test_names_are_listed_in_order_and_each_has_a_home() -> None:
    assert dermis.__all__ == sorted(dermis.__all__, key=lambda name: (name[0].islower(), name))
    assert set(dermis.__all__) == set(dermis._HOME)


@pytest.mark.parametrize("name", dermis.__all__)
def test_each_name_resolves_and_is_explained(name: str) -> None:
    thing = getattr(dermis, name)
    assert thing.__name__ == name
    assert inspect.getmodule(thing).__name__ == f"dermis.{dermis._HOME[name]}"
    text = thing.__doc__ or ""
    assert len(text.splitlines()[0]) > 20, "no docstring of its own"
    assert text != (inspect.getdoc(thing.__mro__[1]) if inspect.isclass(thing) else None)
    assert pydoc.getdoc(thing)


@pytest.mark.parametrize("name", ["load_heads", "Skn", "_", "scne"])
def test_unknown_names_are_attribute_errors(name: str) -> None:
    with pytest.raises(AttributeError, match=f"module 'dermis' has no attribute '{name}'"):
        getattr(dermis, name)


def test_import_by_star_gives_what_is_promised() -> None:
    names: dict[str, object] = {}
    exec("from dermis import *", names)
    assert set(dermis.__all__) <= set(names)


def test_the_lines_of_the_description(
    tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    head = dermis.load_head(write_head(tmp_path / "head.obj"))
    scene = dermis.Scene(head, lights=dermis.studio(), camera=dermis.portrait(head))
    image = dermis.render(scene, size=(48, 32), atlas=64)
    assert image.shape == (32, 48, 3) and image.dtype == np.float32
    assert np.isfinite(image).all() and image[16, 24].min() > 0.01
    dermis.write_image(tmp_path / "head.exr", image)
    assert (tmp_path / "head.exr").stat().st_size > 1000


def test_a_renderer_is_kept_for_many_frames(
    tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.frame.renderer.open_device", lambda adapter: device)
    head = dermis.load_head(write_head(tmp_path / "head.obj"))
    renderer = dermis.Renderer()
    front = dermis.Scene(head)
    side = dermis.Scene(head, camera=dermis.profile(head), skin=dermis.Skin(mix=0.2))
    first = renderer.render(front, size=(32, 32), atlas=64)
    other = renderer.render(side, size=(32, 32), atlas=64)
    again = renderer.render(front, size=(32, 32), atlas=64)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("name", ["bust", "bust_many_charts"])
def test_heads_that_are_gone_say_what_replaced_them(name: str, tmp_path: Path) -> None:
    with pytest.raises(dermis.DermisError, match=rf"^{name}: .* replaced by .*'human'\. Write human instead"):
        dermis.load_head(name)
    scene = tmp_path / "scene.toml"
    scene.write_text(f'[head]\nname = "{name}"\n')
    with pytest.raises(dermis.DermisError, match="Write human instead"):
        dermis.load_scene(scene)


def test_errors_are_of_one_kind() -> None:
    with pytest.raises(dermis.DermisError, match=r"expected .* but .*\."):
        dermis.load_head("nobody.obj")
    with pytest.raises(dermis.DermisError, match=r"expected .* but .*\."):
        dermis.Settings(size=(0, 0))
