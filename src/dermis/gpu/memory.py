"""What the process holds on its devices."""

from __future__ import annotations


def held_bytes() -> int:
    """Bytes of all textures and buffers that are not yet released."""
    import wgpu

    found = wgpu.diagnostics.object_counts.get_dict()
    return int(found["total"].get("resource_mem", 0))
