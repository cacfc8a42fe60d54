"""Specs of data sets: reproducible parameters, and invalid values."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import dermis
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec, example_toml, load_spec, parse_spec
from dermis.base.errors import DermisError

COUNT = 5000
REFUSED = {
    "camera = 3": "camera: expected a table with distance_mm",
    "[camera]\nyaw = 3": "camera: yaw: expected one of distance_mm",
    "[camera]\nyaw_deg = {uniform = [1, 0]}": "camera: yaw_deg: expected a lower limit",
    "[camera]\npitch_deg = {normal = [0, 20]}": "camera: pitch_deg: .* normal extends 6 sd",
    "[light.key]\nyaw_deg = 500": r"light\.key: yaw_deg: expected numbers from -180 to 180",
    '[light]\nkind = "candle"': "light: kind: expected one of rig, ",
    '[light]\nkind = "none"': "light: expected light in each image",
    "[light]\nkind = {files = '*.toml'}": "light: kind: expected one of rig, ",
    "[person]\nage = 20": "person: age: expected numbers from 25 to 90",
    "[person]\nage = 'old'": "person: age: expected numbers",
    "[person]\nita = 80": "person: ita: expected numbers from -65 to 70",
    "[person]\nita = 20\n[person.skin]\nmelanin = 0.1": "person: ita: expected an ITA or the melanin",
    "[person]\nskin_ancestry = 'martian'": "person: skin_ancestry: expected one of caucasian",
    "generator = 1": "generator: expected 6",
    "[person]\nafrican = 0": "person: expected a fraction of african",
    '[person]\nhead = "human"\nage = 30': r"person\.age: expected sampled people",
    "[person.skin]\nshine = 1": r"person\.skin: shine: expected one of melanin",
    "[person.skin]\nmelanin = 2": r"person\.skin: melanin: expected a number from 0 to 1",
    "[person.hair]\nstyle = 'mohawk'": r"person\.hair: style: expected one of none",
    "[person.eyes]\nseed = 3": r"person\.eyes: seed: expected one of eumelanin",
    "[person.targets]\n'nose/none' = 1": r"person\.targets: nose/none",
    "[skin]\nroughness = 3": "skin: .*roughness: expected a number from 0.05",
    "[skin]\nseed = 3": "skin: seed: expected one of",
    '[expression]\nname = "x"': "expression: name: expected one of neutral",
    "[expressions.x]\njawOpen = 3": r"expressions\.x\.jawOpen: expected a number",
    "[pose]\njawOpen = {uniform = [0, 1e3]}": "pose: jawOpen: expected numbers from -100",
    "[environment]\nname = {files = '*.hdr'}": r"environment\.name: expected files that match",
    "[environment]\nname = {choice = ['none', 'night.hdr']}": "environment: name: .*'night.hdr' is neither",
    "[person]\nhead = 'mannequin'": "person: head: expected a file in the spec's folder, or one of human",
    "[environment]\nname = {files = '/**'}": r"environment\.name: expected a pattern",
    "[render]\nsize = [64, 64]": "render: size: .* Write it as size, above",
    "[render]\nbackground = 'none'": r"render: background: .* Write it as \[background\]",
    "[render]\natlas = 1": "render: atlas: expected a whole number from 64",
    "size = 0": "spec: size",
    "count = 0": "spec: count: expected a whole number from 1",
    "counts = 1": "spec: counts: expected count",
    "folder = '/'": "folder: expected no such key",
    "outputs = ['smell']": "output: expected one of depth",
    "landmarks = ['dlib']": "landmarks: expected any of ibug-68",
    "landmarks = ['none.csv']": r"landmarks: .* tables of name,vertex .*got 'none\.csv'",
    "format = 'zip'": "spec: format",
    "[[correlated]]\nof = ['camera.yaw_deg', 'x']\ncorrelation = 0.5": "correlated: of: .*got 'x'",
    "[[correlated]]\nof = ['camera.yaw_deg']\ncorrelation = 0.5": "correlated: .*2 to 50 names",
    "[[correlated]]\nof = ['camera.yaw_deg', 'head.yaw_deg']\ncorrelation = 1": "correlated: .*definite",
    "[[correlated]]\nof = ['a', 'b']\ncorrelation = [[1, 0]]": "correlated: .*2 rows of 2",
    "[[correlated]]\nof = ['a', 'b']\ncorrelation = [[1, 0.2], [0.3, 1]]": "correlated: .*symmetric",
    "[[correlated]]\nof = ['camera.yaw_deg', 'person.age']\ncorrelation = 0.5\n[person]\nage = 30": "first",
    "correlated = 3": "correlated",
    "[sensor]\nISO = 3": "sensor: ISO: expected one of vignetting",
    "[sensor]\niso = {uniform = [100, 1e6]}": "sensor: .*iso: expected a number from 0 to 51200",
    "[sensor]\ndemosaicing = {choice = ['malvar', 'best']}": "sensor: .*demosaicing: expected .*malvar",
    "[sensor]\n[background]\nkind = 'none'": "background: kind: expected a background, as photographs",
    "[sensor]\n[render]\ntone = 'filmic'": "render: tone: expected 'none' with",
    "size = [1, 8]\n[sensor]\ndemosaicing = 'malvar'": "size: expected 2 pixels or more",
    "keep_linear = true": "keep_linear: expected a table",
    "[lens]\nk1 = 0.1": "lens: expected a table",
    "[sensor]\n[lens]\nk4 = 1": "lens: k4: expected one of k1",
    "[sensor]\n[lens]\np1 = {normal = [0, 0.1]}": "lens: .*p1: expected a number from -0.1",
    "outputs = ['motion']\n[sensor]\n[lens]": "outputs: expected outputs without motion",
}
FIRST = {
    "person.seed": 489798491,
    "person.age": 59.3503,
    "camera.distance_mm": 1523.67,
    "head.yaw_deg": -28.0143,
}
"""Of the first image of the example."""


def spec(text: str = "", **more: Any) -> Spec:
    return parse_spec(tomllib.loads(text) | {"count": COUNT} | more)


@pytest.fixture(scope="module")
def example() -> Spec:
    return parse_spec(tomllib.loads(example_toml()) | {"count": COUNT})


@pytest.fixture(scope="module")
def found(example: Spec) -> list[Parameters]:
    return [example.parameters(k) for k in range(COUNT)]


@pytest.mark.parametrize("text", REFUSED)
def test_impossible_values_are_refused_with_table_and_key(text: str, tmp_path: Path) -> None:
    file = tmp_path / "spec.toml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(DermisError, match=REFUSED[text]) as refused:
        load_spec(file)
    assert str(refused.value).startswith(str(file))


def test_the_example_is_a_valid_commented_spec(tmp_path: Path) -> None:
    file = tmp_path / "spec.toml"
    file.write_text(example_toml(), encoding="utf-8")
    drawn = load_spec(file)
    assert (drawn.count, drawn.size, drawn.shard_size, drawn.files) == (1000, (512, 512), 1000, {})
    assert load_spec(file, count=3, seed=9, size=(64, 32)).size == (64, 32)
    assert len(drawn.parameters(999)) > 60
    with pytest.raises(DermisError, match="image: expected a whole number from 0 to 999"):
        drawn.parameters(1000)


def test_files_that_the_example_names_are_accepted(tmp_path: Path) -> None:
    text = example_toml()
    for line in [line[2:] for line in text.splitlines() if line.startswith("# name = ")]:
        (tmp_path / "panoramas").mkdir(exist_ok=True)
        (tmp_path / "panoramas" / "sky.hdr").write_bytes(b"light")
        told = tomllib.loads(text) | {"environment": tomllib.loads(line.partition("  #")[0])}
        assert parse_spec(told, tmp_path).parameters(0)["environment.name"] in (
            "lebombo", "royal_esplanade", "panoramas/sky.hdr",
        )  # fmt: skip


def test_statistics_match_the_stated_distributions(found: list[Parameters]) -> None:
    ages = [one["person.age"] for one in found]
    assert stats.kstest(ages, stats.truncnorm(-17 / 22, 48 / 22, 42, 22).cdf).pvalue > 0.01
    distances = [one["camera.distance_mm"] for one in found]
    assert stats.kstest(distances, stats.loguniform(600, 2500).cdf).pvalue > 0.01
    yaws = [one["camera.yaw_deg"] for one in found]
    assert stats.kstest(yaws, stats.truncnorm(-75 / 24, 75 / 24, 0, 24).cdf).pvalue > 0.01
    kinds = [one["light.kind"] for one in found]
    assert kinds.count("rig") / COUNT == pytest.approx(0.6, abs=0.02)
    rigs = [one for one in found if one["light.kind"] == "rig"]
    assert [one for one in found if "light.key.yaw_deg" in one] == rigs
    assert stats.kstest([one["light.key.yaw_deg"] for one in rigs], stats.uniform(-75, 150).cdf).pvalue > 0.01


def test_correlated_parameters_keep_their_own_distributions(found: list[Parameters]) -> None:
    names = "background.red", "background.green", "background.blue"
    walls = np.array([[one[name] for name in names] for one in found if names[0] in one]).T
    assert all(stats.kstest(one, stats.uniform(0.01, 0.49).cdf).pvalue > 0.01 for one in walls)
    for a, b in ((0, 1), (0, 2), (1, 2)):  # the ranks of a Gaussian copula
        rank = stats.spearmanr(walls[a], walls[b]).statistic
        assert rank == pytest.approx(6 / np.pi * np.arcsin(0.4), abs=0.03)
    yaws = np.array([[one["head.yaw_deg"], one["camera.yaw_deg"]] for one in found])
    assert stats.spearmanr(yaws).statistic == pytest.approx(6 / np.pi * np.arcsin(0.15), abs=0.04)


def test_a_new_parameter_or_distribution_changes_no_other_parameter() -> None:
    base = spec("[person]\nage = {uniform = [30, 60]}\n[expression]\nname = 'mixture'")
    other = spec(
        "[person]\nage = {normal = [50, 2]}\nsex = {uniform = [0, 1]}\n"
        "[person.eyes]\nredness = {uniform = [0, 1]}\n[expression]\nname = 'mixture'\n"
        "[pose]\njawOpen = {uniform = [0, 1]}\n[skin]\noiliness = {uniform = [0, 1]}"
    )
    changed = {"person.age", "person.sex", "person.eyes.redness", "pose.jawOpen", "skin.oiliness"}
    for k in range(40):
        before, after = base.parameters(k), other.parameters(k)
        assert {name for name in before | after if before.get(name) != after.get(name)} == changed
    assert [base.parameters(k) for k in range(5)] != [base.replace(seed=1).parameters(k) for k in range(5)]


def test_the_stated_number_of_images_share_a_person() -> None:
    drawn = spec(
        "images_per_person = 3\n[person]\nage = {uniform = [25, 90]}\n[head]\nyaw_deg = {uniform = [-9, 9]}"
    )
    found = [drawn.parameters(k) for k in range(9)]
    assert [one["person.number"] for one in found] == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    for first in (0, 3, 6):
        assert len({(one["person.seed"], one["person.age"]) for one in found[first : first + 3]}) == 1
    assert (
        len({one["person.seed"] for one in found}) == 3 and len({one["head.yaw_deg"] for one in found}) == 9
    )
    alone = spec("[person]\nage = {uniform = [25, 90]}")
    assert alone.parameters(2)["person.age"] == found[8]["person.age"]


def test_other_processes_sample_the_same(example: Spec) -> None:
    code = (
        "import json, tomllib; from dermis.apps.batch.spec import example_toml, parse_spec; "
        "spec = parse_spec(tomllib.loads(example_toml()) | {'count': 5000}); "
        "print(json.dumps([spec.to_toml(), *(spec.parameters(k) for k in (4999, 0, 17))]))"
    )
    own = json.dumps([example.to_toml(), *(example.parameters(k) for k in (4999, 0, 17))])
    source = Path(dermis.__file__).parents[1]
    for hashes in ("1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": hashes, "PYTHONPATH": str(source)}
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True
        )
        assert run.stdout.strip() == own
    assert pickle.loads(pickle.dumps(example)).parameters(3) == example.parameters(3)


def test_the_first_image_of_the_example_is_unchanged(example: Spec) -> None:
    """The parameters are the same on every machine and in every version with the same generator number."""
    found = example.parameters(0)
    told = {name: found[name] for name in ("person.seed", "person.age", "camera.distance_mm", "head.yaw_deg")}
    assert told == FIRST


def test_text_is_canonical(example: Spec) -> None:
    text = example.to_toml()
    again = parse_spec(tomllib.loads(text))
    assert again == example and again.to_toml() == text and again.digest() == example.digest()
    assert [again.parameters(k) for k in range(9)] == [example.parameters(k) for k in range(9)]
    assert example.replace(seed=5).digest() != example.digest()


NUMBER = st.floats(-20, 20)
DRAWN: st.SearchStrategy[Any] = st.one_of(
    NUMBER,
    st.builds(lambda low, more: {"uniform": [low, low + more]}, NUMBER, st.floats(0.1, 9)),
    st.builds(lambda mean, sd: {"truncated": [mean, sd, mean - 1, mean + 1]}, NUMBER, st.floats(0.1, 9)),
    st.builds(lambda each: {"choice": each}, st.lists(NUMBER, min_size=1, max_size=4)),
)
KEYS = ("yaw_deg", "pitch_deg", "roll_deg")
TABLES = st.fixed_dictionaries(
    {},
    optional={
        "count": st.integers(1, 10**9),
        "seed": st.integers(0, 2**32 - 1),
        "size": st.tuples(st.integers(1, 2048), st.integers(1, 2048)).map(list),
        "images_per_person": st.integers(1, 99),
        "outputs": st.lists(st.sampled_from(["depth", "uv", "alpha"]), unique=True),
        "format": st.sampled_from(["folder", "webdataset"]),
        "render": st.fixed_dictionaries(
            {}, optional={"atlas": st.integers(64, 4096), "strands": st.booleans()}
        ),
        "camera": st.dictionaries(st.sampled_from(KEYS), DRAWN),
        "head": st.dictionaries(st.sampled_from(KEYS), DRAWN),
        "pose": st.dictionaries(st.text(max_size=9), DRAWN, max_size=4),
        "expressions": st.dictionaries(
            st.text(max_size=9), st.dictionaries(st.text(max_size=9), st.floats(0, 1)), max_size=2
        ),
        "correlated": st.just(
            [{"of": ["camera.yaw_deg", "head.yaw_deg"], "correlation": [[1, 0.5], [0.5, 1]]}]
        ),
    },
)


@settings(deadline=None, max_examples=60)
@given(TABLES)
def test_specs_round_trip_through_toml(tables: dict[str, Any]) -> None:
    made = parse_spec(tables)
    again = parse_spec(tomllib.loads(made.to_toml()))
    assert again == made and again.to_toml() == made.to_toml()
    assert again.parameters(0) == made.parameters(0)


def test_files_are_sorted_and_checked_by_their_hashes(tmp_path: Path) -> None:
    for name, data in (("b.hdr", b"2"), ("a.hdr", b"1"), ("c.txt", b"3")):
        (tmp_path / name).write_bytes(data)
    (tmp_path / "d.hdr").mkdir()
    tables = tomllib.loads("[environment]\nname = {files = '*.hdr'}")
    first = parse_spec(tables, tmp_path)
    assert list(first.files) == ["a.hdr", "b.hdr"]
    assert {first.parameters(k)["environment.name"] for k in range(30)} == {"a.hdr", "b.hdr"}
    assert parse_spec(tomllib.loads(first.to_toml()), tmp_path) == first
    (tmp_path / "a.hdr").write_bytes(b"other")
    assert parse_spec(tables, tmp_path).digest() != first.digest()
    with pytest.raises(DermisError, match=r"files: a\.hdr: expected a file with SHA-256"):
        parse_spec(tomllib.loads(first.to_toml()), tmp_path)
    (tmp_path / "a.hdr").unlink()
    with pytest.raises(DermisError, match=r"files: a\.hdr: .* there is none"):
        parse_spec(tomllib.loads(first.to_toml()), tmp_path)


def test_landmark_tables_are_identified_by_their_hashes(tmp_path: Path) -> None:
    table, tables = tmp_path / "points.csv", {"landmarks": ["ibug-68", "points.csv"]}
    table.write_text("# a ball\nname,vertex\ntop,3\n")
    first = parse_spec(tables, tmp_path)
    assert list(first.files) == ["points.csv"]
    assert first.landmark_tables == {"ibug-68": "ibug-68", "points.csv": str(table)}
    assert parse_spec(tomllib.loads(first.to_toml()), tmp_path) == first
    table.write_text("name,vertex\ntop,4\n")
    assert parse_spec(tables, tmp_path).digest() != first.digest()
    with pytest.raises(DermisError, match=r"files: points\.csv: expected a file with SHA-256"):
        parse_spec(tomllib.loads(first.to_toml()), tmp_path)
    table.write_text("name,point\ntop,4\n")
    with pytest.raises(DermisError, match=r"points\.csv: expected landmarks in CSV"):
        parse_spec(tables, tmp_path)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"yaw_deg": 3}, r"expected this key in \[camera\] or \[gaze\] or \[head\] or \[light\.fill\]"),
        ({"counts": 5}, "spec: counts: expected count, but this name is unknown"),
        ({"mystery": 5}, "expected one of size, count, seed"),
        ({"size": [3]}, r"^spec: size"),
    ],
)
def test_unknown_keys_above_all_tables_name_the_table(data: dict[str, object], told: str) -> None:
    with pytest.raises(DermisError, match=told) as found:
        parse_spec(data)
    assert "Table" not in str(found.value) and "folder" not in str(found.value)
