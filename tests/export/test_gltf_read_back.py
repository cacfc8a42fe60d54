"""Reading a person's glTF file again: hair, eyes and bones of the person, and the maps of the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis import Human, load_head
from dermis.apps.export.subject import load_subject
from dermis.base.errors import DermisWarning
from dermis.formats.gltf.write import encode_head
from dermis.human.hair.look import HairLook
from dermis.human.person_file import person_parameters, write_person_json
from dermis.mesh.eyeball import EyeTextures
from dermis.mesh.maps import Maps
from dermis.scene.file_people import person_in_file

PERSON = replace(Human.sampled(7), hair=HairLook("cropped"))
COLOUR = np.full((32, 32, 3), 0.25, np.float32)
EYES = EyeTextures(COLOUR, np.broadcast_to(np.array([0.0, 0.0, 1.0], np.float32), COLOUR.shape))


def written(path: Path, taller_mm: float = 0.0, person: dict[str, Any] | None = None, **options: Any) -> Path:
    head = replace(PERSON.head(subdivide=0, hairs=0.05), maps=Maps(colour=COLOUR))
    mesh = replace(head.mesh, positions=head.mesh.positions + np.array([0.0, taller_mm, 0.0], np.float32))
    mesh.positions[: len(mesh.positions) // 2] += np.float32(taller_mm)
    notes = {"person": person_parameters(PERSON) | (person or {})}
    settings = {"roughness": 0.3, "asset_extras": notes, "eyes": EYES, "compact": True} | options
    path.write_bytes(encode_head(replace(head, mesh=mesh), **settings))
    return path


def test_a_file_keeps_its_person_and_hair(tmp_path: Path) -> None:
    path = written(tmp_path / "person.glb")
    found = person_in_file(path)
    assert found is not None and person_parameters(found) == person_parameters(PERSON)
    head = load_head(path, subdivide=0)
    assert head.hair is not None and head.strands is not None and len(head.strands) > 1000
    assert head.eyes is not None and head.eyes.look == PERSON.iris and len(head.targets) == 52
    np.testing.assert_allclose(head.maps.colour, np.full((32, 32, 3), 0.25), atol=0.005)
    assert len(load_head(path, subdivide=1).mesh.triangles) == 4 * len(head.mesh.triangles)


def test_a_sculpted_mesh_is_kept_without_hair(tmp_path: Path) -> None:
    with pytest.warns(DermisWarning, match="hair is left out"):
        head = load_head(written(tmp_path / "sculpted.glb", taller_mm=2.0), subdivide=0)
    assert head.hair is None and head.eyes is not None


def test_plain_eyes_keep_everything_of_the_file(tmp_path: Path) -> None:
    head = load_head(written(tmp_path / "person.glb"), subdivide=0, eyes="plain")
    assert head.hair is None and head.strands is None


def test_a_note_says_why_hair_is_left_out(tmp_path: Path) -> None:
    """Expressions at rest, invalid parameters and options for meshes leave hair out, with a note each."""
    smiling = written(tmp_path / "smiling.glb", weights={"mouthSmileLeft": 1.0})
    newer = written(tmp_path / "newer.glb", person={"unknown": 1})
    plain = written(tmp_path / "plain.glb")
    for path, options, reason in (
        (smiling, {}, "default weights of its morph targets are not 0"),
        (newer, {}, "parameters of its person are invalid"),
        (plain, {"unit_mm": 1000.0}, "unit_mm changes how its mesh is read"),
    ):
        with pytest.warns(DermisWarning, match=f"{path.name}: its hair is left out, .*{reason}"):
            head = load_head(path, subdivide=0, **options)
        assert head.hair is None and head.eyes is not None


def test_options_of_the_head_are_stored_with_the_person(tmp_path: Path) -> None:
    """Exported parameters contain clothing and eyes from options, so that they are those of the mesh."""
    write_person_json(tmp_path / "person.json", replace(PERSON, hair=HairLook("none")))
    subject = load_subject(
        tmp_path / "person.json", clothing="red shirt", eye={"eumelanin": 0.9}, subdivide=1
    )
    person, head = subject.person, subject.head
    assert person is not None and head is not None and head.eyes is not None
    assert person.clothing is not None and person.clothing.text == "red cotton shirt"
    assert person.iris == head.eyes.look and person.iris.eumelanin == 0.9
    assert person.positions_mm.shape == head.control_rig.positions_mm.shape
