"""Files that exports to game engines share: meshes in levels of detail, and packed maps of the skin."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.gltf.file import encode_glb
from dermis.apps.export.targets.openpbr.materials import open_pbr_maps
from dermis.base.arrays import Bytes, Floats
from dermis.human.person_file import relief_slopes
from dermis.images.codecs import encode_png
from dermis.images.colour import encode_srgb8
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.optics.media import SKIN_ETA

LOD_FILE_MEANINGS = {
    "*_LOD0.glb": "all parts of the head in full detail, with a plain skin material; metres, Y up",
    "*_LOD1.glb": "the same with the coarsest mesh and a quarter of the hairs, for small or distant heads",
}
_HAIR_DETAIL = 1.0, 0.25  # fraction of the tubes and ribbons in each level of detail


def lod_files(subject: Subject, stem: str) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of the meshes of a subject's head, without maps of the skin.

    Heads that do not belong to a parametric person have a single level of detail.

    stem : start of the names
    """
    if subject.scene is None:
        return
    heads = [subject.scene.head]
    if subject.person is not None and heads[0].levels > 0:
        coarse = subject.person.head(subdivide=0)
        look = heads[0].eyes and heads[0].eyes.look  # red from crying, for example
        heads.append(replace(coarse, eyes=coarse.eyes.with_look(look)) if coarse.eyes and look else coarse)
    for level, (head, detail) in enumerate(zip(heads, _HAIR_DETAIL, strict=False)):
        yield f"{stem}_LOD{level}.glb", _encode_mesh(subject, replace(head, name=heads[0].name), detail)


def _encode_mesh(subject: Subject, head: Head, hair_detail: float) -> bytes:
    assert subject.scene is not None
    plain = replace(head, maps=Maps(parts=head.maps.parts))
    extensions = {"KHR_materials_ior": {"ior": SKIN_ETA}}
    return encode_glb(replace(subject, scene=replace(subject.scene, head=plain)), extensions, "", hair_detail)


def engine_maps(subject: Subject) -> dict[str, Floats]:
    """Return the maps of the skin by role: colour, roughness (perceptual), specular (factor of F0), normal.

    Missing maps are left out. Colours are linear, and normals are in the range 0 to 1.
    """
    if subject.head is None:
        return {}
    return open_pbr_maps(subject.head.maps, subject.skin, relief_slopes(subject.head))


def packed_png(*channels: Floats | float) -> bytes:
    """Return a linear 8-bit PNG file whose channels are given arrays (n, n) or constants."""
    arrays = np.broadcast_arrays(*channels)
    return encode_png(_levels(np.stack(arrays, axis=-1)))


def colour_png(colour: Floats) -> bytes:
    """Return a linear colour map (n, n, 3) as an 8-bit PNG file in sRGB."""
    return encode_png(encode_srgb8(colour))


def normal_png(normal: Floats) -> bytes:
    """Return a normal map (n, n, 3) with values from 0 to 1, green up, as an 8-bit PNG file."""
    return encode_png(_levels(normal))


def _levels(values: Floats) -> Bytes:
    return np.rint(np.clip(values, 0.0, 1.0) * 255).astype(np.uint8)
