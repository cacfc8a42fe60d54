"""Settings for comparison with the 2007 talk: listed under a separate heading."""

from __future__ import annotations

from pathlib import Path

import pytest
from small_head import write_head

import dermis
from dermis.scene.frozen_model import FrozenModel, field_heading, field_help, fields_under
from dermis.scene.talk_comparisons import COMPARISONS_HEADING

FIELDS: dict[type[FrozenModel], list[str]] = {
    dermis.Skin: ["specular_colour", "energy"],
    dermis.Settings: ["stretch", "seams", "seam_colour", "gamma"],
}
SCENE = """
[skin]
specular_colour = "wrong"
energy = "published"
[render]
stretch = "axes"
seams = "clear-colour"
seam_colour = [0.1, 0.2, 0.3]
gamma = "wrong"
"""


@pytest.mark.parametrize("kind", FIELDS)
def test_settings_of_the_talk_are_listed_under_their_heading(kind: type[FrozenModel]) -> None:
    assert fields_under(COMPARISONS_HEADING, kind) == FIELDS[kind]
    assert {field_heading(kind, name) for name in kind.model_fields} == {"", COMPARISONS_HEADING}
    assert all(field_help(kind, name) for name in FIELDS[kind])
    text = (kind.__doc__ or "").partition("\nExamples\n")[0]
    _, parameters, comparisons = text.split("\n----")
    assert parameters.rstrip("-").endswith(COMPARISONS_HEADING)
    assert all(f"\n{name} : " in comparisons and f"\n{name} : " not in parameters for name in FIELDS[kind])


def test_scene_files_of_the_first_release_open(tmp_path: Path) -> None:
    head = write_head(tmp_path / "head.obj")
    file = tmp_path / "scene.toml"
    file.write_text(f'[head]\nname = "{head.name}"\n{SCENE}')
    scene, settings = dermis.load_scene(file)
    assert (scene.skin.specular_colour, scene.skin.energy) == ("wrong", "published")
    values = settings.stretch, settings.seams, settings.seam_colour, settings.gamma
    assert values == ("axes", "clear-colour", (0.1, 0.2, 0.3), "wrong")
