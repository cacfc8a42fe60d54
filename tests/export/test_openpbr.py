"""Export to OpenPBR: radii of the closest random walk, and the error of other interpretations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dermis.apps.export.fitting import profile_error
from dermis.apps.export.run import evaluate_export, export_skin
from dermis.apps.export.subject import load_subject
from dermis.apps.export.target import get_numbers
from dermis.apps.export.targets.openpbr.materials import OPEN_PBR
from dermis.apps.export.targets.openpbr.target import TARGET, fitted_mean_free_path_mm, get_radii_mm
from dermis.apps.truths.half_space import diffuse_albedo
from dermis.optics.media import albedo_from_colour

pytest.importorskip("MaterialX")
import MaterialX

EDGE = 0.015  # a matched walk against photons under a surface of index 1.4


def test_random_walk_matches_homogeneous_skin_better_than_published_values() -> None:
    subject = load_subject("skin1")
    report = evaluate_export(subject, TARGET, "1.1.1")
    assert report.error.edge.max() < EDGE and report.error.cdf.max() < 0.04
    assert report.naive_error.edge[0] > 0.04
    naive = get_radii_mm(report.naive_parameters, OPEN_PBR)
    np.testing.assert_allclose(naive, [3.67, 1.37, 0.68], rtol=0.01)  # [Jensen2001], printed


def test_total_albedo_equals_the_formula() -> None:
    subject = load_subject("skin1")
    parameters = TARGET.parameters(subject, "1.1.1")
    shown = TARGET.predicted_profile(parameters, subject, "1.1.1")
    exact = [diffuse_albedo(float(one)) for one in albedo_from_colour(subject.albedo)]
    np.testing.assert_allclose(shown.energy, exact, atol=0.003)


def test_radii_grow_with_the_skin() -> None:
    subject = load_subject("skin1")
    np.testing.assert_allclose(
        get_radii_mm(TARGET.parameters(subject, "1.1.1"), OPEN_PBR),
        fitted_mean_free_path_mm(subject),
        rtol=1e-9,
    )
    d = evaluate_export(subject, TARGET, "1.1.1").d_mm
    ratio = fitted_mean_free_path_mm(subject) / d
    # From other simulations: d over the mean free path is 0.434 at a colour of 0.43 and 0.34 at 0.2.
    assert 1.9 < ratio[0] < 2.4 and 2.7 < ratio[1] < 3.2 and ratio[2] > ratio[1]


def test_profile_is_fitted_for_renderers_with_profiles() -> None:
    subject = load_subject("skin1")
    profile, walk = (TARGET.with_variant(one) for one in ("open-pbr-profile", "open-pbr"))
    assert evaluate_export(subject, profile, "1.1.1").error.edge.max() < EDGE
    radii = walk.parameters(subject, "1.1.1")
    assert profile_error(subject.curve, profile.predicted_profile(radii, subject, "1.1.1")).edge.max() > 0.08


@pytest.mark.parametrize("variant", TARGET.variants)
def test_document_contains_the_given_values(variant: str, tmp_path: Path) -> None:
    report = export_skin("skin1", "openpbr", tmp_path / "skin.mtlx", variant=variant)
    document = MaterialX.createDocument()
    MaterialX.readFromXmlFile(document, str(tmp_path / "skin.mtlx"))
    (node,) = [one for one in document.getNodes() if one.getType() == "surfaceshader"]
    for row in report.parameters:
        exported = get_numbers(report.parameters, row.name)
        value = node.getInput(row.name).getValue()
        assert np.allclose(value if len(exported) == 1 else value.asTuple(), exported, rtol=1e-5)
