"""A page that renders the head itself, by the same passes, in any browser with WebGPU."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, numbers_of
from dermis.base.errors import refuse
from dermis.optics.curve import Curve
from dermis.optics.media import Floats

_ATLAS = 512
_MAP = 1024  # texels a side, most
_TITLE = "WebGPU"


@dataclass(frozen=True)
class Web(Target):
    """A page that needs no library, no server and no network."""

    name: ClassVar[str] = "web"
    title: ClassVar[str] = _TITLE
    versions: ClassVar[tuple[str, ...]] = ("1",)
    suffixes: ClassVar[tuple[str, ...]] = (".html",)
    wrong: ClassVar[str] = (
        "The page draws square pictures with an atlas of 512 texels; maps have at most 1024 texels a side, "
        "8 bits a channel, and lose what WebP loses. Expressions move the skin, but their folds and flushes "
        "are not painted; between the nodes of a dial, numbers are interpolated. Hairs keep the thickness of "
        "the first view."
    )

    def parameters(self, subject: Subject, version: str) -> Rows:
        """The Gaussians that light is spread by."""
        profile = self._profile(subject)
        return (
            Row("atlas", _ATLAS, "texel", "side of the atlas that light spreads on"),
            Row("variance", tuple(float(x) for x in profile.variance_mm2), "mm2", "of each Gaussian"),
            *(
                Row(
                    f"weight.{colour}", tuple(float(x) for x in profile.weight[:, k]), "-", "of each Gaussian"
                )
                for k, colour in enumerate(("red", "green", "blue"))
            ),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """The same: there is nothing to type."""
        return self.parameters(subject, version)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The sum of Gaussians."""
        _, (_, *variance), *weight = [(0.0, *numbers_of(rows, row.name)) for row in rows]
        return _curve(np.array(variance), np.array([one[1:] for one in weight]).T, subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The page."""
        from dermis.apps.export.targets.web.build import MOVING, SIZES, PageRequest, page_content
        from dermis.apps.export.targets.web.dials import dials_of
        from dermis.apps.export.targets.web.maps import with_smaller_maps
        from dermis.apps.export.targets.web.page import web_page
        from dermis.scene.settings import Settings

        scene = subject.scene
        if scene is None:
            refuse(
                "subject", "a head, which the page renders", f"the skin {subject.name} came", "Name a head"
            )
        scene = replace(scene, head=with_smaller_maps(scene.head, min(self.side, _MAP)))
        dials = dials_of(scene)
        made = page_content(PageRequest(scene, dials, Settings(atlas=_ATLAS), SIZES, self.adapter, MOVING))
        place.write_text(web_page(made, dials, subject.name, self.wrong), encoding="utf-8")
        return [place]

    @staticmethod
    def _profile(subject: Subject):  # type: ignore[no-untyped-def]
        from dermis.frame.features.diffusion.profiles import SkinProfiles
        from dermis.optics.profiles import load_profile

        scene = subject.scene
        return SkinProfiles().of(scene.skin) if scene else load_profile(subject.name)


def _curve(variance_mm2: Floats, weight: Floats, energy: Floats) -> Curve:
    """What leaves within each radius of a sum of Gaussians."""
    total = weight.sum(axis=0)

    def within(r: Floats) -> Floats:
        return np.asarray(-np.expm1(-0.5 * r[:, None] ** 2 / variance_mm2) @ weight / total)

    return Curve.of(within, energy)


TARGET = Web()
