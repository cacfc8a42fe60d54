"""Unity's HDRP: a DiffusionProfileSettings asset, and the maps of a head.

By its source (DiffusionProfileSettings.cs) the lobe's d is the scattering colour times the multiplier, in mm
where the world scale is the metres of a unit.
"""

from __future__ import annotations

import json
from pathlib import Path

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
        """Colour and multiplier of the fitted lobes."""
        d = fit_d(subject.curve)
        return (
            *_distances(d, version),
            Row(_SCALE, 1.0, "m", "metres of a unit of the scene"),
            Row(_IOR, _SKIN_IOR, "-", "of the surface reflection"),
            Row(_TINT, (1.0, 1.0, 1.0), "-", "of light through thin parts, times the base colour"),
            Row(_DEPTHS, (0.0, _THICKEST * float(d.max())), "mm", "black and white of a thickness map"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """The skin's colour as the scattering colour, as the inspector advises, and a multiplier of 1."""
        typed: dict[str, Value] = {_COLOUR: floats(subject.colour()), _MULTIPLIER: _TYPED_MM}
        return with_values(self.parameters(subject, version), typed)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The lobe that the engine computes from its parameters."""
        colour, scale = np.array(numbers_of(rows, _COLOUR)), numbers_of(rows, _SCALE)[0]
        multiplier = 1.0 if version == _BEFORE_14 else numbers_of(rows, _MULTIPLIER)[0]
        return lobe(colour * multiplier / scale, subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The asset, and beside it the maps."""
        asset = self.file_in(place, subject)
        asset.write_text(asset_text(asset.stem, rows, version), encoding="utf-8")
        maps = ((f"{asset.stem}_{role}.png", data) for role, data in subject.map_pictures().items())
        return [asset, *write_files(asset.parent, maps)]


def _distances(d_mm: Floats, version: str) -> Rows:
    """The lobes' widths, in the one colour of before HDRP 14 or in colour and multiplier."""
    if version == _BEFORE_14:
        return (Row(_COLOUR, floats(d_mm), "mm", "d, plain numbers in an HDR colour, no gamma"),)
    told = unity_parameters(BurleyProfile(np.ones(3), 1.0 / d_mm))
    return (
        Row(_COLOUR, told.scattering_colour, "-", "d by its largest channel, plain numbers, no gamma"),
        Row(_MULTIPLIER, told.multiplier_mm, "mm", "d of the widest channel"),
    )


def asset_text(name: str, rows: Rows, version: str) -> str:
    """The asset as the editor itself writes one; the editor gives it a hash when it is first opened."""
    known = {row.name: row.value for row in rows}
    colour, tint = (_rgba(numbers_of(rows, key)) for key in (_COLOUR, _TINT))
    low, high = numbers_of(rows, _DEPTHS)
    multiplier = f"    {_MULTIPLIER}: {known[_MULTIPLIER]:.6g}\n" if _MULTIPLIER in known else ""
    return f"""\
%YAML 1.1
%TAG !u! tag:unity3d.com,2011:
--- !u!114 &11400000
MonoBehaviour:
  m_ObjectHideFlags: 0
  m_CorrespondingSourceObject: {{fileID: 0}}
  m_PrefabInstance: {{fileID: 0}}
  m_PrefabAsset: {{fileID: 0}}
  m_GameObject: {{fileID: 0}}
  m_Enabled: 1
  m_EditorHideFlags: 0
  m_Script: {{fileID: 11500000, guid: b2686e09ec7aef44bad2843e4416f057, type: 3}}
  m_Name: {json.dumps(name)}
  m_EditorClassIdentifier:
  profile:
    scatteringDistance: {colour}
{multiplier}    transmissionTint: {tint}
    texturingMode: 0
    smoothnessMultipliers: {{x: 1, y: 1}}
    lobeMix: 0.5
    diffuseShadingPower: 1
    transmissionMode: 0
    thicknessRemap: {{x: {low:.6g}, y: {high:.6g}}}
    worldScale: {known[_SCALE]:.6g}
    ior: {known[_IOR]:.6g}
    hash: 0
  m_Version: {_FORMS[version]}
"""


def _rgba(colour: tuple[float, ...]) -> str:
    r, g, b = colour
    return f"{{r: {r:.6g}, g: {g:.6g}, b: {b:.6g}, a: 1}}"


TARGET = Unity()
