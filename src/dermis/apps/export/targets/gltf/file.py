"""Encoding of a skin or head as a .glb file with material extensions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np

from dermis.apps.export.subject import Subject
from dermis.apps.export.targets.gltf.volume import multiscatter_for_reflectance
from dermis.formats.gltf.materials import SkinMaterialAdditions, encode_colours_png
from dermis.formats.gltf.write import encode_head
from dermis.human.person_file import person_parameters, relief_slopes
from dermis.mesh.head import Head

Extensions = Mapping[str, Mapping[str, object]]
_MULTISCATTER_ROLE = "multiscatter"
_MULTISCATTER_TABLE_SIZE = 1024


def encode_glb(
    subject: Subject, material_extensions: Extensions, draft_notice: str, hair_detail: float = 1.0
) -> bytes:
    """Return a .glb file of the head with eyes, hairs and rig, or of a ball for a skin without a head.

    material_extensions : dictionary from the name of each extension of the skin's material to its JSON
    draft_notice : notice that an extension is a draft, stored in the file; "" if all extensions are ratified
    hair_detail : fraction of the tubes and ribbons that represent hairs
    """
    head = subject.head_or_ball
    notes: dict[str, object] = {"draft": draft_notice} if draft_notice else {}
    if subject.person is not None:
        notes["person"] = person_parameters(subject.person)
    elif head.eyes is not None:
        notes["person"] = {"eyes": asdict(head.eyes.look)}
    return encode_head(
        head,
        roughness=subject.skin.roughness,
        slopes=relief_slopes(head),
        asset_extras=notes,
        eyes=subject.eye_pictures(),
        skin_additions=_skin_additions(subject, head, material_extensions, draft_notice),
        compact=True,
        hair_detail=hair_detail,
    )


def _skin_additions(
    subject: Subject, head: Head, material_extensions: Extensions, draft_notice: str
) -> SkinMaterialAdditions:
    """Return the extensions and base colour of the skin material, and an additional map if needed.

    If the head has a colour map and the export uses the draft extension KHR_materials_scatter, the uniform
    multiscatter colour is replaced by a map.

    material_extensions, draft_notice : see `encode_glb`
    """
    if not draft_notice:
        colour = {"baseColorFactor": [*(float(x) for x in subject.albedo), 1.0]}
        return SkinMaterialAdditions({} if head.maps.colour is not None else colour, material_extensions)
    white, extras = {"baseColorFactor": [1.0, 1.0, 1.0, 1.0]}, {"draft": draft_notice}
    if head.maps.colour is None:
        return SkinMaterialAdditions(white, material_extensions, extras)
    steps = np.linspace(0.0, 1.0, _MULTISCATTER_TABLE_SIZE)
    scattered = np.interp(head.maps.colour, steps, multiscatter_for_reflectance(steps)).astype(np.float32)
    scatter = {**material_extensions["KHR_materials_scatter"], "multiscatterColorFactor": [1.0, 1.0, 1.0]}
    scatter["multiscatterColorTexture"] = {"index": _MULTISCATTER_ROLE}
    material_extensions = {**material_extensions, "KHR_materials_scatter": scatter}
    return SkinMaterialAdditions(
        white, material_extensions, extras, {_MULTISCATTER_ROLE: encode_colours_png(scattered)}
    )
