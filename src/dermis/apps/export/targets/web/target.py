"""A page that renders the head itself, by the same passes, in any browser with WebGPU."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from dermis.apps.export.fitting import gaussian_curve
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, floats, numbers_of
from dermis.base.errors import refuse
from dermis.optics.curve import Curve
from dermis.optics.gaussians import GaussianSum

_ATLAS = 512
_MAP = 1024  # texels a side, most


class Web(Target):
    """Page that needs no library, no server and no network."""

    name = "web"
    title = "WebGPU"
    versions = ("1",)
    suffixes = (".html",)
    wrong = (
        "The page draws square pictures with an atlas of 512 texels; maps have at most 1024 texels a side, "
        "8 bits a channel, and lose what WebP loses. Expressions move the skin, but their folds and flushes "
        "are not painted; between the nodes of a dial, numbers are interpolated. Hairs keep the thickness of "
        "the first view."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the Gaussians that spread light."""
        profile = self._profile(subject)
        return (
            Row("atlas", _ATLAS, "texel", "side of the atlas that light spreads on"),
            Row("variance", floats(profile.variance_mm2), "mm2", "of each Gaussian"),
            *(
                Row(f"weight.{colour}", floats(profile.weight[:, k]), "-", "of each Gaussian")
                for k, colour in enumerate(("red", "green", "blue"))
            ),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the same: there is nothing to type."""
        return self.parameters(subject, version)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the curve of the sum of Gaussians."""
        _, variance, *weight = (np.array(numbers_of(rows, row.name)) for row in rows)
        return gaussian_curve(variance, np.stack(weight, axis=1), subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the page."""
        from dermis.apps.export.targets.web.build import MOVING, SIZES, PageRequest, page_content
        from dermis.apps.export.targets.web.dials import dials_of
        from dermis.apps.export.targets.web.maps import with_smaller_maps
        from dermis.apps.export.targets.web.page import web_page
        from dermis.scene.settings import Settings

        scene = subject.scene
        if scene is None:
            came = f"the skin {subject.name} came"
            refuse("subject", "a head, which the page renders", came, "Name a head")
        scene = replace(scene, head=with_smaller_maps(scene.head, min(self.side, _MAP)))
        dials = dials_of(scene)
        made = page_content(PageRequest(scene, dials, Settings(atlas=_ATLAS), SIZES, self.adapter, MOVING))
        place.write_text(web_page(made, dials, subject.name, self.wrong), encoding="utf-8")
        return [place]

    @staticmethod
    def _profile(subject: Subject) -> GaussianSum:
        from dermis.frame.features.diffusion.profiles import SkinProfiles
        from dermis.optics.profiles import load_profile

        scene = subject.scene
        return SkinProfiles().of(scene.skin) if scene else load_profile(subject.name)


TARGET = Web()
