"""How much a mesh file may hold: more than any head has, in seconds and two gigabytes."""

from __future__ import annotations

MAX_FILE_BYTES = 512 << 20
"""Of a mesh file, and of all buffers that a glTF file names together."""
MAX_TRIANGLES = 1_250_000
"""Of all groups together; the parametric human has 856,064 at its finest."""
MAX_VERTICES = 1_250_000
MAX_CORNERS = 4096
"""Of one polygon."""
MAX_GROUPS = 4096
"""Materials, groups, and the primitives of a glTF file's scene."""
MAX_RELIEF_MM = 1.0
"""Of one grey level of an 8-bit height map: 255 of them are a nose and more."""
MAX_NODES, MAX_NODE_DEPTH = 1 << 16, 1024
MAX_INFLUENCES = 16
"""Of bones on a vertex, of which the four strongest are kept."""
MAX_DISPLACEMENTS = 6_000_000
"""Of vertices by all targets."""
MAX_BONES = 2048
MAX_TARGETS = 4096
MAX_CHANNELS = 1 << 14
"""Curves of an animation clip."""
MAX_ACCESSOR_NUMBERS = 1 << 27
"""That a glTF file's accessors stand for, each counted as often as it is used, and for 512 at least."""
MAX_JSON_VALUES = 1 << 21
"""Values in a glTF file's JSON."""
MAX_MTL_BYTES = 4 << 20
"""Of all .mtl files that an OBJ file names."""
MAX_LIBRARIES = 64
"""Names of .mtl files."""
