"""Options generated from the models: a new field is an option, a key of scene files and a row of the docs."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from cyclopts import App
from pydantic import Field

import dermis.cli
from dermis.base.errors import DermisError
from dermis.cli.head_options import HEAD_OPTION_NAMES
from dermis.cli.options import check_fields, model_options
from dermis.cli.scene_options import ENVIRONMENT_OPTION_NAMES
from dermis.scene import Camera, Environment, Settings, Skin, files
from dermis.scene.frozen_model import FrozenModel, field_choices, field_help, field_slider_range, slider
from dermis.scene.head_table import EyeTable, HeadTable
from dermis.scene.skin import Pigments, TissueLayer

ROOT = Path(__file__).resolve().parents[2]
_OF_SKIN: tuple[type[FrozenModel], ...] = (Skin, Pigments, TissueLayer)
MODELS = (*_OF_SKIN, Settings, Environment, HeadTable, EyeTable, Camera)


class WaxedSkin(Skin):
    """Skin of another package, with additional fields."""

    wax: Annotated[float, Field(ge=0, le=1)] = 0.25
    """Share of the skin that is waxed,
    seen from above."""
    coats: Annotated[int, Field(ge=1, json_schema_extra=slider(1, 5, logarithmic=True))] = 2
    """Coats of wax."""
    polish: Literal["cloth", "wheel"] | None = None
    """What it is polished with."""
    tint: tuple[float, float, float] = (0.0, 0.5, 1.0)
    """Colour of the wax."""


WaxOptions = model_options(WaxedSkin, excluded_fields=("mix",), option_names={"coats": "wax_coats"})


def taken(*words: str) -> Any:
    """Return the arguments that a command with the options of the toy model receives."""
    app = App(result_action="return_value")

    @app.command
    def polish(*, skin: WaxOptions = {}) -> Any:  # type: ignore[valid-type]  # noqa: B006
        return skin

    return app(["polish", *words], exit_on_error=False, print_error=False)


def test_a_new_field_is_an_option(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--wax", "0.5", "--wax-coats", "3", "--polish", "wheel", "--tint", "1,0,0", "--rho-s", "0.1")
    given = {"wax": 0.5, "coats": 3, "polish": "wheel", "tint": (1.0, 0.0, 0.0), "rho_s": 0.1}
    assert taken() == {} and taken(*words) == given
    assert WaxedSkin(**taken(*words)).coats == 3
    taken("--help")
    text = " ".join(re.sub(r"[│\n]", " ", capsys.readouterr().out).split())
    assert "--wax FLOAT Share of the skin that is waxed, seen from above." in text
    assert "[range: 0 to 1] [default: 0.25]" in text and "[choices: cloth, wheel]" in text
    assert "R,G,B" in text and "--mix" not in text and "--pigments" not in text and "--layers" not in text


def test_impossible_values_name_the_option() -> None:
    with pytest.raises(DermisError, match=r"--wax-coats: expected a number .* 1, but got 0\. Correct it\."):
        check_fields(WaxedSkin, {"coats": 0}, {"coats": "wax_coats"})


def test_a_new_field_is_a_key_of_scene_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from small_head import write_head

    from dermis.scene.saving import scene_text

    monkeypatch.setattr(files, "Skin", WaxedSkin)
    head = write_head(tmp_path / "head.obj")
    (tmp_path / "scene.toml").write_text(f'[head]\nname = "{head.name}"\n[skin]\nwax = 0.75\n')
    scene, settings = files.load_scene(tmp_path / "scene.toml")
    assert isinstance(scene.skin, WaxedSkin) and scene.skin.wax == 0.75
    assert "wax = 0.75" in scene_text(scene, settings, {"name": str(head)}).splitlines()


def test_a_new_field_is_a_row_of_the_docs() -> None:
    found = importlib.util.spec_from_file_location("generated_pages", ROOT / "docs" / "generated_pages.py")
    assert found and found.loader
    pages = importlib.util.module_from_spec(found)
    found.loader.exec_module(pages)
    rows = pages.table_of(WaxedSkin, {}).splitlines()
    assert "| `wax` | `--wax` | 0 to 1 | 0.25 | Share of the skin that is waxed, seen from above. |" in rows
    assert "| `polish` | `--polish` | cloth, wheel |  | What it is polished with. |" in rows
    for model in MODELS:
        assert model in {model for model, _ in pages.TABLES.values()}


def test_fields_provide_help_choices_and_range() -> None:
    assert field_help(WaxedSkin, "wax") == "Share of the skin that is waxed, seen from above."
    assert field_choices(WaxedSkin, "polish") == ("cloth", "wheel") and field_choices(WaxedSkin, "wax") == ()
    assert field_slider_range(WaxedSkin, "wax") == (0, 1, False) and field_slider_range(
        WaxedSkin, "coats"
    ) == (1, 5, True)
    assert field_slider_range(TissueLayer, "absorption_per_mm") == (1e-4, 50, True)
    assert field_slider_range(WaxedSkin, "polish") is None is field_slider_range(WaxedSkin, "tint")


@pytest.mark.parametrize("model", MODELS)
def test_every_field_is_explained(model: type[FrozenModel]) -> None:
    for field in model.model_fields:
        text = field_help(model, field)
        assert text[0].isupper() and text.endswith("."), (field, text)


def test_option_names_are_unique() -> None:
    names = [
        *Settings.model_fields,
        *Skin.model_fields,
        *(HEAD_OPTION_NAMES.get(f, f) for f in HeadTable.model_fields),
    ]
    names += ENVIRONMENT_OPTION_NAMES.values()
    assert len(names) == len(set(names))


def test_commands_do_not_repeat_choices_of_a_model() -> None:
    known = [set(field_choices(model, field)) for model in MODELS for field in model.model_fields]
    for path in sorted(Path(dermis.cli.__file__).parent.glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Subscript) and ast.unparse(node.value) == "Literal":
                words = {one.value for one in ast.walk(node.slice) if isinstance(one, ast.Constant)}
                assert not words or not any(words <= choices for choices in known), (path.name, words)
