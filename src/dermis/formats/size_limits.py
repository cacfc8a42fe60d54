"""Size limits of mesh files.

Any usual head is within these limits, and a file within these limits loads quickly in 2 GB of memory.
"""

from __future__ import annotations

from dermis.base.errors import refuse

DAMAGED_ADVICE = "The file is damaged: export it again"
DECIMATE_ADVICE = "Decimate it (in Blender: Modifiers > Decimate)"

MAX_FILE_BYTES = 512 << 20
"""Largest size of a mesh file, and largest total size of the buffers of a glTF file [byte]."""
MAX_TRIANGLES = 1_250_000
"""Largest total number of triangles in all groups; the parametric human has at most 856,064."""
MAX_VERTICES = 1_250_000
MAX_POLYGON_CORNERS = 4096
"""Largest number of corners of a polygon."""
MAX_GROUPS = 4096
"""Largest number of groups of an OBJ file, meshes of a USD file, or primitives of a glTF scene."""
MAX_RELIEF_MM = 1.0
"""Largest height difference of one grey level of an 8-bit height map [mm]."""
MAX_NODES, MAX_NODE_DEPTH = 1 << 16, 1024
MAX_BONES_PER_VERTEX = 16
"""Largest number of bones that a vertex may have; only the four with the largest weights are used."""
MAX_DISPLACEMENTS = 6_000_000
"""Largest number of displaced vertices, summed over all morph targets."""
MAX_BONES = 2048
MAX_TARGETS = 4096
MAX_ANIMATION_CURVES = 1 << 14
"""Largest number of curves of an animation clip."""
MAX_ACCESSOR_COMPONENTS = 1 << 27
"""Largest total number of accessor components that are read; each read counts as 512 components or more."""
MAX_JSON_VALUES = 1 << 21
"""Largest number of values in the JSON tree of a glTF file."""
MAX_MTL_BYTES = 4 << 20
"""Largest total size of the .mtl files of an OBJ file [byte]."""
MAX_MTL_FILES = 64
"""Largest number of .mtl files of an OBJ file."""


def check_limit(
    error_subject: object, actual_count: int, max_count: int, items_noun: str, advice: str
) -> None:
    """Raise an error for a file with more than `max_count` objects of one kind.

    error_subject : file, for the error
    actual_count : number of the objects
    items_noun : plural noun for the objects
    advice : sentence for the error on how the user can correct the file
    """
    if actual_count > max_count:
        refuse(error_subject, f"at most {max_count:,} {items_noun}", f"it has {actual_count:,}", advice)
