"""The page about files has the tables that the readers declare."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_head import obj_text

from dermis.base.errors import DermisError
from dermis.formats.load import load_rigged
from dermis.formats.mesh_formats import MESH_FORMATS, MeshFormat, find_format, mesh_suffixes
from dermis.formats.obj import read_obj

ROOT = Path(__file__).parents[1]


def test_page_equals_the_generated_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Updated by python tools/formats_page.py."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    from formats_page import PAGE, page_text

    assert PAGE.read_text(encoding="utf-8") == page_text()


def test_formats_are_identified_by_suffix() -> None:
    assert find_format("HEAD.USDZ") is MESH_FORMATS["usd"] and find_format("head.fbx") is None
    assert len(set(mesh_suffixes())) == len(mesh_suffixes()) == 10


def test_plugin_format_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a.egg"
    path.write_text(obj_text())
    with MESH_FORMATS.temporary_entry("egg", MeshFormat((".egg",), read_obj, ())):
        assert len(load_rigged(path).mesh.triangles) > 0
    with pytest.raises(DermisError, match=r"the suffix is '\.egg'"):
        load_rigged(path)


@pytest.mark.parametrize("name", MESH_FORMATS)
def test_property_names_are_unique(name: str) -> None:
    for rows in (MESH_FORMATS[name].properties, MESH_FORMATS[name].materials):
        assert len({row.name for row in rows}) == len(rows)
