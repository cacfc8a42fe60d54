"""Maps of a head as picture files, for targets that read such."""

from __future__ import annotations

from pathlib import Path

from dermis.apps.export.subject import Subject
from dermis.human.head_file import relief_slopes
from dermis.mesh.gltf.textures import skin_pictures

ROLES = "colour", "normal", "roughness", "specular", "height"


def painted(subject: Subject, side: int, adapter: str) -> Subject:
    """The subject with all maps of its head as arrays; it is itself where nothing has to be painted.

    side : of maps that are painted, a power of two from 256 to 4096 [texels]
    adapter : that paints
    """
    if subject.head is None or not subject.head.maps.painted:
        return subject
    from dermis.frame.painted import with_painted_maps
    from dermis.gpu.failures import on_device

    head = subject.head
    return subject.with_head(on_device(adapter, lambda device: with_painted_maps(device, head, side)))


def write_maps(subject: Subject, folder: Path, stem: str = "") -> dict[str, Path]:
    """The maps that a head has, as PNG, by role: colour (sRGB), normal (green up), and grey ones.

    Roughness is Beckmann's m, specular the strength of the reflection, both plain; height is from its lowest
    to its highest in 16 bits.

    stem : what their names begin with, such as "skin_"
    """
    head = subject.head
    if head is None:
        return {}
    pictures, _ = skin_pictures(head.maps, relief_slopes(head))
    written = {role: folder / f"{stem}{role}.png" for role in ROLES if role in pictures}
    for role, path in written.items():
        path.write_bytes(pictures[role])
    return written
