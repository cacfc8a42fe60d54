"""Goodness of fit of drawn parameters against the distributions of a spec."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import stats

from dermis.apps.batch.distributions import Distribution, parse_distribution
from dermis.apps.batch.goodness_of_fit import fit_test, fit_tests
from dermis.apps.batch.index import INDEX_FILE
from dermis.apps.batch.spec import Spec, example_toml, load_spec, parse_spec
from dermis.base.errors import DermisError
from dermis.base.extras import import_extra

COUNT = 2000
LAWS: dict[str, tuple[Any, Any]] = {
    "uniform": ({"uniform": [-3, 5]}, stats.uniform(-3, 8)),
    "logarithmic": ({"log_uniform": [0.1, 30]}, stats.loguniform(0.1, 30)),
    "normal": ({"normal": [2, 0.5]}, stats.norm(2, 0.5)),
    "truncated": ({"truncated": [0, 1, -0.5, 2]}, stats.truncnorm(-0.5, 2)),
    "far": ({"truncated": [0, 1, 3, 4]}, stats.truncnorm(3, 4)),
}


def index(folder: Path, spec: Spec) -> Path:
    """Write an index of the parameters that a spec draws, without pictures."""
    rows = [spec.parameters(k) for k in range(spec.count)]
    names = sorted({name for row in rows for name in row})
    arrow = import_extra("pyarrow", "a test")
    columns = {name: [row.get(name) for row in rows] for name in names}
    import_extra("pyarrow.parquet", "a test").write_table(arrow.table(columns), folder / INDEX_FILE)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the index of the example, with two images of each person."""
    folder = tmp_path_factory.mktemp("drawn")
    text = example_toml().replace("images_per_person = 1 ", "images_per_person = 2 ")
    (folder / "spec.toml").write_text(text)
    return index(folder, load_spec(folder / "spec.toml", count=COUNT))


def test_two_thousand_draws_agree_with_their_spec(folder: Path) -> None:
    found = {one.parameter: one for one in fit_tests(folder, load_spec(folder / "spec.toml"))}
    assert len(found) > 30 and all(one.is_accepted for one in found.values())
    chances = np.array([one.p_value for one in found.values()])
    assert chances.min() > 1e-3 and 0.3 < np.median(chances) < 0.8, "p-values are uniform"
    assert found["person.age"].sample_count == COUNT // 2, "people count once"
    assert found["gaze.yaw_deg"].sample_count < 0.4 * COUNT, "only some images have it"
    assert found["head.yaw_deg"].distance < 3 * found["head.yaw_deg"].expected_distance


@pytest.mark.parametrize(
    ("changed_line", "parameter"),
    [
        ("yaw_deg = {truncated = [0, 18, -40, 40]}", "head.yaw_deg"),
        ("yaw_deg = {truncated = [3, 14, -40, 40]}", "head.yaw_deg"),
        ("strength = {choice = [0, {uniform = [0.1, 1]}], weights = [1, 1]}", "light.rim.strength"),
        ('at = {choice = ["camera", "angles"], weights = [6, 4]}', "gaze.at"),
        ("age = {truncated = [50, 22, 25, 90]}", "person.age"),
    ],
)
def test_samples_of_another_distribution_fail_the_test(
    folder: Path, changed_line: str, parameter: str
) -> None:
    """The index does not fit a spec that states another distribution of one parameter."""
    table, _, key = parameter.rpartition(".")
    lines, inside = [], ""
    for line in example_toml().splitlines():
        inside = line.partition("]")[0][1:] if line.startswith("[") else inside
        lines.append(changed_line if inside == table and line.startswith(f"{key} =") else line)
    assert changed_line in lines
    (folder / "other.toml").write_text("\n".join(lines))
    spec = load_spec(folder / "other.toml")
    assert [one.parameter for one in fit_tests(folder, spec) if not one.is_accepted] == [parameter]


@pytest.mark.parametrize("name", LAWS)
def test_distances_match_the_kolmogorov_smirnov_test(name: str) -> None:
    definition, law = LAWS[name]
    values = np.random.default_rng(1).permutation(law.ppf((np.arange(500) + 0.3) ** 1.02 / 600))
    found, truth = (
        fit_test(name, parse_distribution(definition), list(values)),
        stats.kstest(values, law.cdf, method="asymp"),
    )
    assert found.distance == pytest.approx(truth.statistic, abs=1e-4)
    assert found.p_value == pytest.approx(truth.pvalue, rel=0.02)
    mean, sd = map(float, found.expected.split(", "))
    assert mean == pytest.approx(law.mean(), abs=2e-3 * law.std()) and sd == pytest.approx(
        law.std(), rel=2e-3
    )


def test_expected_distance_is_the_mean_distance() -> None:
    law: Distribution = parse_distribution({"uniform": [0, 1]})
    rng = np.random.default_rng(2)
    found = [fit_test("x", law, list(rng.uniform(size=400))) for _ in range(100)]
    assert np.mean([one.distance for one in found]) == pytest.approx(found[0].expected_distance, rel=0.1)


def test_values_outside_the_distribution_have_a_p_value_of_0() -> None:
    law = parse_distribution({"choice": ["a", "b"], "weights": [1, 0]})
    assert fit_test("x", law, ["a"] * 9).p_value == 1.0
    assert not fit_test("x", law, ["a"] * 9 + ["b"]).is_accepted
    steps = parse_distribution({"choice": [0, 1 / 3, {"uniform": [5, 6]}]})
    even = list(np.linspace(5, 6, 50))
    assert fit_test("x", steps, [0.0, 0.333333] * 50 + even).p_value > 0.5, "numbers are rounded"
    assert not fit_test("x", steps, [0.0, 0.34, 5.5] * 50).is_accepted


def test_backgrounds_without_an_environment_count_as_gradients(tmp_path: Path) -> None:
    kinds = {"kind": {"choice": ["environment", "gradient", "none"]}}
    around = {"name": {"choice": ["none", "uniform"]}}
    spec = parse_spec({"count": 500, "background": kinds, "environment": around})
    assert all(one.is_accepted for one in fit_tests(index(tmp_path, spec), spec))


def test_an_index_is_needed(tmp_path: Path) -> None:
    with pytest.raises(DermisError, match=r"expected a data set with index\.parquet"):
        list(fit_tests(tmp_path, parse_spec({})))
