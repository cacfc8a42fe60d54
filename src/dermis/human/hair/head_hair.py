"""Scalp hair and beard of a person: guides and roots of a hair style, with the parameters of the person."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from dermis.human.hair.look import HairLook
from dermis.human.hair.root_finder import RootFinder
from dermis.human.hair.strand_roots import BEARD_STRANDS_PER_CM2, STRANDS_PER_CM2, strands_of_style
from dermis.human.hair.styles import BEARD, Style, styles
from dermis.human.skin.face import hairline_heights
from dermis.mesh.groom import Groom
from dermis.specular.hair import absorption_per_mm

MAX_HAIRS_PER_CM2 = 200.0
"""Density of the densest hair of the head [1/cm2]."""
BEARD_HAIRS_PER_CM2 = 60.0
"""Density of beards [1/cm2]."""
_HAIR_RADIUS_MM, _BEARD_RADIUS_MM = 0.034, 0.048
_MIN_EUMELANIN = 0.07  # white hair is not quite white
_SEED_COUNT = 1 << 24  # seeds are exact as float32
# Radius and pitch of the curls of hair, by the dial `HairLook.curl` [mm].
_CURL_NODES = np.array([0.0, 0.1, 0.3, 0.6, 0.8, 1.0])
_COIL_RADIUS_BY_CURL_MM = np.array([0.0, 0.5, 5.0, 6.5, 3.6, 1.7])
_COIL_PITCH_BY_CURL_MM = np.array([150.0, 130.0, 95.0, 34.0, 15.0, 7.5])
_INCOHERENCE_BY_CURL = np.array([0.3, 0.3, 0.12, 0.2, 0.5, 1.0])
_FRIZZ_BY_CURL_MM = np.array([0.25, 0.35, 0.6, 0.9, 0.8, 0.5])
_FLYAWAY_FRACTION = 0.012
_KNOTS_PER_TURN = 7.0
_STRAIGHT_SEGMENT_MM = 14.0  # length of the segments of straight hair
_MIN_KNOTS, _MAX_KNOTS = 5, 64
_FLOAT_FIELDS = (
    "density", "hairline", "thinning", "length_mm", "guide_mm", "fade", "layers", "clump", "clump_start_mm",
    "rope_mm", "braid", "curl_mm", "pitch_mm", "incoherence", "frizz_mm", "flyaways", "radius_mm", "cover",
    "grey", "hairs_per_strand",
)  # fmt: skip
HAIR_PARAMETERS_DTYPE = np.dtype(
    [
        *((name, "f4") for name in _FLOAT_FIELDS),
        ("dark", "f4", 3),
        ("seed", "f4"),
        ("white", "f4", 3),
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
    scalp, bearded = styles().get(hair_look.style), hair_look.beard_mm > 0.0
    if hair_look.density == 0.0:
        scalp = None
    if scalp is None and not bearded:
        return None
    tables = strands_of_style(scalp, bearded, root_finder, subdivision_levels)
    parts = [_scalp_parameters(scalp, hair_look, recession)] if scalp else []
    parts += [_beard_parameters(hair_look)] if bearded else []
    parameters, strands = np.array(parts, HAIR_PARAMETERS_DTYPE), round(hair_fraction * len(tables.roots))
    heights, knots = hairline_heights(max(recession, scalp.crown if scalp else 0.0)), _knot_count(parameters)
    return Groom(tables.guides, tables.roots, parameters, strands, knots, heights, tables.centre_mm)


def _scalp_parameters(style: Style, hair_look: HairLook, recession: float) -> tuple[object, ...]:
    length, fade = min(hair_look.length_mm, style.max_length_mm), hair_look.fade if style.fade else 0.0
    densities = STRANDS_PER_CM2, MAX_HAIRS_PER_CM2, hair_look.density
    return _parameter_row(
        style, hair_look, length, densities, _HAIR_RADIUS_MM, fade, max(recession, style.crown), 1.0
    )


def _beard_parameters(hair_look: HairLook) -> tuple[object, ...]:
    length, densities = (
        min(hair_look.beard_mm, BEARD.max_length_mm),
        (BEARD_STRANDS_PER_CM2, BEARD_HAIRS_PER_CM2, 1.0),
    )
    return _parameter_row(BEARD, hair_look, length, densities, _BEARD_RADIUS_MM)


def _parameter_row(
    style: Style,
    hair_look: HairLook,
    length_mm: float,
    densities: tuple[float, float, float],
    hair_radius_mm: float,
    fade: float = 0.0,
    thinning: float = 0.0,
    hairline_effect: float = 0.0,
) -> tuple[object, ...]:
    """Return the parameters of scalp hair or of a beard as a row of `HAIR_PARAMETERS_DTYPE`.

    length_mm : length of the hair where it is longest [mm]
    densities : number of strand roots per area [1/cm2], number of real hairs per area [1/cm2], and fraction
        of the roots from which a strand grows
    hair_radius_mm : radius of a single hair [mm]
    fade : how much shorter the hair is at the sides and the nape than on top, 0 to 1
    thinning : how far the hair on the crown has thinned, 0 to 1
    hairline_effect : 1 for hair that is sparser, shorter and finer near the hairline, 0 for other hair
    """
    strands_per_cm2, hairs_per_cm2, density = densities
    hairs_per_strand = hairs_per_cm2 / strands_per_cm2
    curl_mm, pitch_mm, incoherence, frizz_mm = (
        float(np.interp(hair_look.curl, _CURL_NODES, column))
        for column in (
            _COIL_RADIUS_BY_CURL_MM,
            _COIL_PITCH_BY_CURL_MM,
            _INCOHERENCE_BY_CURL,
            _FRIZZ_BY_CURL_MM,
        )
    )
    rope = style.rope_mm > 0.0
    radius = hairs_per_strand * hair_radius_mm
    cover = 0.5 * 2.0 * radius * min(length_mm, 60.0) * strands_per_cm2 * density / 100.0
    values = {
        "density": density,
        "hairline": hairline_effect,
        "thinning": thinning,
        "length_mm": length_mm,
        "guide_mm": style.max_length_mm,
        "fade": fade,
        "layers": style.layers,
        "clump": style.clump,
        "clump_start_mm": 8.0 if rope else min(80.0, 0.5 * length_mm + 4.0),
        "rope_mm": style.rope_mm,
        "braid": float(style.braid),
        "curl_mm": min(curl_mm, 0.35 * length_mm),
        "pitch_mm": pitch_mm,
        "incoherence": incoherence,
        "frizz_mm": frizz_mm * min(1.0, length_mm / 60.0) * (0.3 if rope else 1.0),
        "flyaways": 0.3 * _FLYAWAY_FRACTION if rope else _FLYAWAY_FRACTION,
        "radius_mm": radius,
        "cover": min(cover, 4.0),
        "grey": hair_look.grey,
        "hairs_per_strand": hairs_per_strand,
        "dark": tuple(absorption_per_mm(hair_look.eumelanin, hair_look.pheomelanin)),
        "seed": hair_look.seed % _SEED_COUNT,
        "white": tuple(absorption_per_mm(_MIN_EUMELANIN, 0.0)),
        "pad": 0.0,
    }
    return tuple(values[name] for name in HAIR_PARAMETERS_DTYPE.names or ())


def _knot_count(parameters: NDArray[np.void]) -> int:
    """Return a number of knots per strand that resolves the longest and most tightly curled strands.

    parameters : (p,) rows of `HAIR_PARAMETERS_DTYPE`, for scalp hair and beard
    """
    lengths, pitches, curls, ropes = (
        parameters[name] for name in ("length_mm", "pitch_mm", "curl_mm", "rope_mm")
    )
    straight = lengths / _STRAIGHT_SEGMENT_MM + _MIN_KNOTS
    curled = np.where((curls > 1.0) & (ropes == 0.0), _KNOTS_PER_TURN * lengths / pitches, 0.0)
    roped = np.where(ropes > 0.0, _KNOTS_PER_TURN * lengths / (7.0 * np.maximum(ropes, 1.0)), 0.0)
    return int(np.clip(np.ceil(np.max([straight, curled, roped])), _MIN_KNOTS, _MAX_KNOTS))
