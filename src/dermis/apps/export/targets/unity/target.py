"""Unity's HDRP: a DiffusionProfileSettings asset, and the maps of a head.

By its source (DiffusionProfileSettings.cs) the lobe's d is the scattering colour times the multiplier, in mm
where the world scale is the metres of a unit.
"""

from __future__ import annotations

import json
from pathlib import Path
from string import Template

import numpy as np

from dermis.apps.export.fitting import fit_d, lobe
from dermis.apps.export.subject import Subject
from dermis.apps.export.target import Row, Rows, Target, Value, floats, numbers_of, with_values, write_files
from dermis.optics.curve import Curve
from dermis.optics.fits.burley import BurleyProfile, unity_parameters
from dermis.optics.media import Floats

_COLOUR, _MULTIPLIER, _SCALE, _IOR = "scatteringDistance", "scatteringDistanceMultiplier", "worldScale", "ior"
_TINT, _DEPTHS = "transmissionTint", "thicknessRemap"
_SKIN_IOR, _THICKEST = 1.4, 10.0  # thickness by the widest d
_TYPED_MM = 1.0
_BEFORE_14 = "12"
_FORMS = {_BEFORE_14: 1, "14": 2, "17": 2}  # m_Version: 1 has no multiplier yet


class Unity(Target):
    """A diffusion profile; the albedo stays in the material's base colour."""

    name = "unity"
    title = "Unity HDRP"
    suffixes = (".asset", "")
    versions = tuple(_FORMS)
    needs_maps = True
    wrong = (
        "The filter is cut at 99.7 % of the widest channel, and worldScale has to tell the scale of a scene "
        "that is not in metres."
    )
    not_run = True

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Return the colour and multiplier of the fitted lobes."""
        d = fit_d(subject.curve)
        return (
            *_distances(d, version),
            Row(_SCALE, 1.0, "m", "metres of a unit of the scene"),
            Row(_IOR, _SKIN_IOR, "-", "of the surface reflection"),
            Row(_TINT, (1.0, 1.0, 1.0), "-", "of light through thin parts, times the base colour"),
            Row(_DEPTHS, (0.0, _THICKEST * float(d.max())), "mm", "black and white of a thickness map"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """Return the skin's colour as the scattering colour, as the inspector advises, and multiplier 1."""
        typed: dict[str, Value] = {_COLOUR: floats(subject.colour()), _MULTIPLIER: _TYPED_MM}
        return with_values(self.parameters(subject, version), typed)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """Return the lobe that the engine computes from its parameters."""
        colour, scale = np.array(numbers_of(rows, _COLOUR)), numbers_of(rows, _SCALE)[0]
        multiplier = 1.0 if version == _BEFORE_14 else numbers_of(rows, _MULTIPLIER)[0]
        return lobe(colour * multiplier / scale, subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """Write the asset, and beside it the maps."""
        asset = self.file_in(place, subject)
        asset.write_text(asset_text(asset.stem, rows, version), encoding="utf-8")
        maps = ((f"{asset.stem}_{role}.png", data) for role, data in subject.map_pictures().items())
        return [asset, *write_files(asset.parent, maps)]


def _distances(d_mm: Floats, version: str) -> Rows:
    """Return the lobes' widths, as one colour before HDRP 14 and as colour and multiplier since."""
    if version == _BEFORE_14:
        return (Row(_COLOUR, floats(d_mm), "mm", "d, plain numbers in an HDR colour, no gamma"),)
    typed = unity_parameters(BurleyProfile(np.ones(3), 1.0 / d_mm))
    return (
        Row(_COLOUR, typed.scattering_colour, "-", "d by its largest channel, plain numbers, no gamma"),
        Row(_MULTIPLIER, typed.multiplier_mm, "mm", "d of the widest channel"),
    )


def asset_text(name: str, rows: Rows, version: str) -> str:
    """Return the asset as the editor writes one; the editor gives it a hash when it is first opened."""
    known = {row.name: row.value for row in rows}
    colour, tint = (_rgba(numbers_of(rows, key)) for key in (_COLOUR, _TINT))
    low, high = numbers_of(rows, _DEPTHS)
    multiplier = f"    {_MULTIPLIER}: {known[_MULTIPLIER]:.6g}\n" if _MULTIPLIER in known else ""
    template = Template(Path(__file__).with_name("profile.asset").read_text("utf-8"))
    return template.substitute(
        name=json.dumps(name),
        colour=colour,
        multiplier=multiplier,
        tint=tint,
        low=f"{low:.6g}",
        high=f"{high:.6g}",
        scale=f"{known[_SCALE]:.6g}",
        ior=f"{known[_IOR]:.6g}",
        form=_FORMS[version],
    )


def _rgba(colour: tuple[float, ...]) -> str:
    r, g, b = colour
    return f"{{r: {r:.6g}, g: {g:.6g}, b: {b:.6g}, a: 1}}"


TARGET = Unity()
