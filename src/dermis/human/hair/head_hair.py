"""Scalp hair and beard of a person: guides and roots of a hair style, with the parameters of the person."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.human.hair.look import HairLook
from dermis.human.hair.root_finder import RootFinder
from dermis.human.hair.strand_roots import BEARD_STRANDS_PER_CM2, STRANDS_PER_CM2, strands_of_style
from dermis.human.hair.styles import Style, beard_styles, styles
from dermis.human.skin.face import hairline_heights
from dermis.mesh.groom import Groom, bend_radius_mm
from dermis.specular.hair import absorption_per_mm

MAX_HAIRS_PER_CM2 = 200.0
"""Density of the densest hair of the head [1/cm2]."""
BEARD_HAIRS_PER_CM2 = 90.0
"""Density of beards [1/cm2]."""
_MIN_BEARD_CURL, _BEARD_FRIZZ_RATIO = 0.45, 0.025  # least curl; amplitude of frizz relative to the length
_BEARD_RADIUS_RATIO = 1.25  # radius of hairs of the beard, relative to hairs of the head
_MIN_EUMELANIN = 0.07  # white hair is not quite white
_SEED_COUNT = 1 << 24  # seeds are exact as float32
# Radius and pitch of the curls of hair, by the dial `HairLook.curl` [mm].
_CURL_NODES = np.array([0.0, 0.1, 0.3, 0.6, 0.8, 1.0])
_COIL_RADIUS_BY_CURL_MM = np.array([0.0, 0.5, 5.0, 6.5, 3.6, 1.7])
_COIL_PITCH_BY_CURL_MM = np.array([150.0, 130.0, 95.0, 34.0, 15.0, 7.5])
_INCOHERENCE_BY_CURL = np.array([0.3, 0.3, 0.12, 0.2, 0.5, 1.0])
_CLUMP_PHASES_BY_CURL = np.array([0.3, 0.3, 0.22, 0.5, 0.9, 1.0])
_FRIZZ_BY_CURL_MM = np.array([0.25, 0.35, 0.6, 0.9, 0.8, 0.5])
_MAX_SEGMENT_MM = 7.0  # largest length of segments, which straight hair has
_MAX_DEVIATION_MM = 0.07  # largest deviation of curls and twists from the segments that represent them
_MIN_KNOTS, _MAX_KNOTS = 5, 96
_FLOAT_FIELDS = (
    "density", "hairline", "thinning", "length_mm", "guide_mm", "fade", "layers", "clump", "clump_start_mm",
    "rope_mm", "braid", "curl_mm", "pitch_mm", "incoherence", "frizz_mm", "flyaways", "radius_mm", "cover",
    "grey", "hairs_per_strand", "clump_phases", "baby_hairs", "temple_grey", "roots_mm",
)  # fmt: skip
HAIR_PARAMETERS_DTYPE = np.dtype(
    [
        *((name, "f4") for name in _FLOAT_FIELDS),
        ("dark", "f4", 3),
        ("seed", "f4"),
        ("white", "f4", 3),
        ("dyed", "f4"),
        ("dye", "f4", 3),
        ("pad", "f4"),
    ]
)
"""Parameters of scalp hair or of a beard, laid out like the struct GroomPart in strands_grow.wgsl."""


def make_groom(
    hair_look: HairLook,
    recession: float,
    root_finder: RootFinder,
    subdivision_levels: int,
    hair_fraction: float = 1.0,
) -> Groom | None:
    """Return the scalp hair and beard of a person; None for a bald person without a beard.

    recession : recession of the hairline, 0 to 1, see `SkinLook`
    root_finder : root finder of the mean person
    subdivision_levels : subdivision levels of the person's mesh
    hair_fraction : fraction of the strands to grow; the strands are widened by the inverse of this fraction,
        so that coverage stays the same
    """
    scalp, beard = _scalp_style(hair_look), beard_styles().get(hair_look.beard_style)
    if scalp is None and beard is None:
        return None
    # One table serves beards of all lengths.
    longest_beard = beard and replace(beard, length_mm=beard.max_length_mm)
    tables = strands_of_style(scalp, longest_beard, root_finder, subdivision_levels)
    parts = [_scalp_parameters(scalp, hair_look, recession)] if scalp else []
    parts += [_beard_parameters(beard, hair_look)] if beard else []
    parameters = np.array(parts, HAIR_PARAMETERS_DTYPE)
    # A prefix of the roots is spread evenly, so that sparse hair is a prefix of dense hair.
    largest = float(parameters["density"].max())
    possible = round(largest * len(tables.roots))
    parameters["density"] /= largest
    receding = max(recession, scalp.crown if scalp else 0.0)
    heights, knots = hairline_heights(receding, hair_look.widows_peak), _knot_count(parameters)
    strands = round(hair_fraction * possible)
    return Groom(tables.guides, tables.roots, parameters, possible, strands, knots, heights, tables.centre_mm)


def _scalp_style(hair_look: HairLook) -> Style | None:
    """Return the style of scalp hair with the parting and clumps of the look; None for a bald head."""
    style = styles().get(hair_look.style) if hair_look.density > 0.0 else None
    changes = {name: getattr(hair_look, name) for name in ("parting_mm", "clump_mm")}
    given = {name: round(value, 1) for name, value in changes.items() if value is not None}
    return replace(style, **given) if style and given else style


def _scalp_parameters(style: Style, hair_look: HairLook, recession: float) -> tuple[object, ...]:
    length, fade = min(hair_look.length_mm, style.max_length_mm), hair_look.fade if style.fade else 0.0
    values = _shared_parameters(
        style, hair_look, length, (STRANDS_PER_CM2, MAX_HAIRS_PER_CM2, hair_look.density)
    )
    values |= {
        "hairline": 1.0,
        "thinning": max(recession, style.crown),
        "fade": fade,
        "clump": style.clump if hair_look.clump is None else hair_look.clump,
        "baby_hairs": hair_look.baby_hairs,
    }
    if hair_look.dye_eumelanin is not None or hair_look.dye_pheomelanin is not None:
        dye = absorption_per_mm(hair_look.dye_eumelanin or 0.0, hair_look.dye_pheomelanin or 0.0)
        values |= {"dyed": 1.0, "dye": tuple(dye), "roots_mm": hair_look.roots_mm}
    return tuple(values[name] for name in HAIR_PARAMETERS_DTYPE.names or ())


def _beard_parameters(style: Style, hair_look: HairLook) -> tuple[object, ...]:
    length, densities = (
        min(hair_look.beard_mm, style.max_length_mm),
        (BEARD_STRANDS_PER_CM2, BEARD_HAIRS_PER_CM2, 1.0),
    )
    wavy = replace(hair_look, curl=max(hair_look.curl, _MIN_BEARD_CURL))
    values = _shared_parameters(style, wavy, length, densities, _BEARD_RADIUS_RATIO)
    values |= {"fade": style.fade, "frizz_mm": _BEARD_FRIZZ_RATIO * length}
    return tuple(values[name] for name in HAIR_PARAMETERS_DTYPE.names or ())


def _shared_parameters(
    style: Style,
    hair_look: HairLook,
    length_mm: float,
    densities: tuple[float, float, float],
    radius_ratio: float = 1.0,
) -> dict[str, object]:
    """Return the parameters that scalp hair and beards share, by the names of `HAIR_PARAMETERS_DTYPE`.

    Parameters that apply only to scalp hair have values without an effect.

    length_mm : length of the hair where it is longest [mm]
    densities : number of strand roots per area [1/cm2], number of real hairs per area [1/cm2], and fraction
        of the roots from which a strand grows
    radius_ratio : radius of a single hair, relative to the hair of the head
    """
    strands_per_cm2, hairs_per_cm2, density = densities
    hairs_per_strand = hairs_per_cm2 / strands_per_cm2
    rope = style.rope_mm > 0.0
    radius = hairs_per_strand * radius_ratio * 0.5 * hair_look.diameter_mm
    cover = 0.5 * 2.0 * radius * min(length_mm, 60.0) * strands_per_cm2 * density / 100.0
    values: dict[str, object] = dict.fromkeys(HAIR_PARAMETERS_DTYPE.names or (), 0.0)
    return (
        values
        | _curl_parameters(hair_look, length_mm, rope)
        | {
            "density": density,
            "length_mm": length_mm,
            "guide_mm": style.max_length_mm,
            "layers": style.layers,
            "clump": style.clump,
            "clump_start_mm": 8.0 if rope else min(80.0, 0.5 * length_mm + 4.0),
            "rope_mm": style.rope_mm,
            "braid": float(style.braid),
            "flyaways": (0.3 if rope else 1.0) * hair_look.flyaways,
            "radius_mm": radius,
            "cover": min(cover, 4.0),
            "grey": hair_look.grey,
            "temple_grey": hair_look.temple_grey,
            "hairs_per_strand": hairs_per_strand,
            "dark": tuple(absorption_per_mm(hair_look.eumelanin, hair_look.pheomelanin)),
            "seed": hair_look.seed % _SEED_COUNT,
            "white": tuple(absorption_per_mm(_MIN_EUMELANIN, 0.0)),
            "dye": (0.0, 0.0, 0.0),
        }
    )


def _curl_parameters(hair_look: HairLook, length_mm: float, is_rope: bool) -> dict[str, object]:
    """Return the parameters of curls and frizz; values that the look omits follow from its `curl`.

    length_mm : length of the hair where it is longest [mm]
    is_rope : whether the hair is twisted or braided
    """

    def value_or_default(value: float | None, by_curl: Doubles) -> float:
        return float(np.interp(hair_look.curl, _CURL_NODES, by_curl)) if value is None else value

    incoherence = None if hair_look.curl_coherence is None else 1.0 - hair_look.curl_coherence
    frizz_mm = value_or_default(hair_look.frizz_mm, _FRIZZ_BY_CURL_MM)
    return {
        "curl_mm": min(value_or_default(hair_look.curl_radius_mm, _COIL_RADIUS_BY_CURL_MM), 0.35 * length_mm),
        "pitch_mm": value_or_default(hair_look.curl_pitch_mm, _COIL_PITCH_BY_CURL_MM),
        "incoherence": value_or_default(incoherence, _INCOHERENCE_BY_CURL),
        "clump_phases": value_or_default(incoherence, _CLUMP_PHASES_BY_CURL),
        "frizz_mm": frizz_mm * min(1.0, length_mm / 60.0) * (0.3 if is_rope else 1.0),
    }


def _knot_count(parameters: NDArray[np.void]) -> int:
    """Return a number of knots per strand that resolves the longest and most tightly curled strands.

    A chord of length c deviates from a curve with the radius of curvature R by c^2 / (8 R).

    parameters : (p,) rows of `HAIR_PARAMETERS_DTYPE`, for scalp hair and beard
    """
    segments = np.minimum(np.sqrt(8.0 * _MAX_DEVIATION_MM * bend_radius_mm(parameters)), _MAX_SEGMENT_MM)
    knots = np.ceil((parameters["length_mm"] / segments).max()) + _MIN_KNOTS
    return int(np.clip(knots, _MIN_KNOTS, _MAX_KNOTS))
