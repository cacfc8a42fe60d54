"""Unity's HDRP: a DiffusionProfileSettings asset, and the maps of a head.

By its source (DiffusionProfileSettings.cs) the lobe's d is the scattering colour times the multiplier, in mm
where the world scale is the metres of a unit.
"""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

from dermis.export.curve import Curve
from dermis.export.lobe import fit_d, lobe
from dermis.export.naming import yaml_text
from dermis.export.subject import Subject
from dermis.export.target import Row, Rows, Target, numbers_of
from dermis.export.textures import write_maps
from dermis.optics.fits.burley import BurleyProfile, unity_parameters

_COLOUR, _MULTIPLIER, _SCALE, _IOR = "scatteringDistance", "scatteringDistanceMultiplier", "worldScale", "ior"
_TINT, _DEPTHS = "transmissionTint", "thicknessRemap"
_SKIN_IOR, _THICKEST = 1.4, 10.0  # thickness by the widest d
_TYPED_MM = 1.0
_BEFORE_14 = ("10", "12")


class Unity(Target):
    """A diffusion profile; the albedo stays in the material's base colour."""

    name: ClassVar[str] = "unity"
    title: ClassVar[str] = "Unity HDRP"
    suffixes: ClassVar[tuple[str, ...]] = (".asset", "")
    versions: ClassVar[tuple[str, ...]] = ("12", "14", "17")
    needs_maps: ClassVar[bool] = True
    wrong: ClassVar[str] = (
        "One lobe a channel cannot hold what layers do: most of the red light of layered skin leaves nearer, "
        "and the rest farther, than shown. The filter is cut at 99.7 % of the widest channel."
    )
    not_run: ClassVar[bool] = True

    def parameters(self, subject: Subject, version: str) -> Rows:
        """Colour and multiplier of the fitted lobes."""
        d = fit_d(subject.curve)
        told = unity_parameters(BurleyProfile(np.ones(3), 1.0 / d))
        thickest = _THICKEST * told.multiplier_mm
        return (
            Row(_COLOUR, told.scattering_colour, "-", "d by its largest channel, plain numbers, no gamma"),
            Row(_MULTIPLIER, told.multiplier_mm, "mm", "d of the widest channel"),
            Row(_SCALE, 1.0, "m", "metres of a unit of the scene"),
            Row(_IOR, _SKIN_IOR, "-", "of the surface reflection"),
            Row(_TINT, (1.0, 1.0, 1.0), "-", "colour of what passes thin parts; the base colour tints it too"),
            Row(_DEPTHS, (0.0, thickest), "mm", "what black and white of a thickness map stand for"),
        )

    def naive(self, subject: Subject, version: str) -> Rows:
        """The skin's colour as the scattering colour, as the inspector advises, and the multiplier as it is."""
        typed = {_COLOUR: tuple(map(float, np.clip(subject.albedo, 0.0, 1.0))), _MULTIPLIER: _TYPED_MM}
        rows = self.parameters(subject, version)
        return tuple(Row(r.name, typed.get(r.name, r.value), r.unit, r.meaning) for r in rows)

    def shown(self, rows: Rows, subject: Subject, version: str) -> Curve:
        """The lobe that the engine computes from its parameters."""
        d = np.array(numbers_of(rows, _COLOUR)) * numbers_of(rows, _MULTIPLIER)[0] / numbers_of(rows, _SCALE)[0]
        return lobe(d, subject.curve.energy)

    def write(self, subject: Subject, rows: Rows, place: Path, version: str) -> list[Path]:
        """The asset, and beside it the maps."""
        asset = place if place.suffix else place / f"{subject.identifier}.asset"
        asset.write_text(asset_text(asset.stem, rows), encoding="utf-8")
        return [asset, *write_maps(subject, asset.parent, f"{asset.stem}_").values()]


def asset_text(name: str, rows: Rows) -> str:
    """The asset as the editor itself writes one; the editor gives it a hash when it is first opened."""
    known = {row.name: row.value for row in rows}
    colour, tint = (_rgba(numbers_of(rows, key)) for key in (_COLOUR, _TINT))
    low, high = numbers_of(rows, _DEPTHS)
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
  m_Name: {yaml_text(name)}
  m_EditorClassIdentifier:
  profile:
    scatteringDistance: {colour}
    scatteringDistanceMultiplier: {known[_MULTIPLIER]:.6g}
    transmissionTint: {tint}
    texturingMode: 0
    smoothnessMultipliers: {{x: 1, y: 1}}
    lobeMix: 0.5
    diffuseShadingPower: 1
    transmissionMode: 0
    thicknessRemap: {{x: {low:.6g}, y: {high:.6g}}}
    worldScale: {known[_SCALE]:.6g}
    ior: {known[_IOR]:.6g}
    hash: 0
  m_Version: 2
"""


def _rgba(colour: tuple[float, ...]) -> str:
    r, g, b = colour
    return f"{{r: {r:.6g}, g: {g:.6g}, b: {b:.6g}, a: 1}}"


TARGET = Unity()
