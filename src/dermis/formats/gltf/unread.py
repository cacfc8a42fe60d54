"""Notes for the user on content of glTF files that is not read."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from dermis.formats.gltf.document import Document
from dermis.formats.gltf.nodes import Nodes
from dermis.formats.text_files import join_names

LIGHTS_EXTENSION = "KHR_lights_punctual"
_POINT_AND_LINE_MODES = range(4)  # modes of primitives


def note_unread(document: Document, nodes: Nodes, read_extensions: Collection[str]) -> Iterator[str]:
    """Yield notes on lights, cameras, points, lines, further scenes and extensions that are not read.

    read_extensions : names of the extensions that other functions handle; this function yields no notes on
        them
    """
    listed_nodes = document.top_level_array("nodes")
    in_scene = [listed_nodes[k] for k in nodes.scene_nodes or ()]
    lights = sum(LIGHTS_EXTENSION in (node.get("extensions") or {}) for node in in_scene)
    if lights:
        yield f"its lights ({lights}) are left out; --lights or the scene sets lights"
    cameras = sum("camera" in node for node in in_scene)
    if cameras:
        yield f"its cameras ({cameras}) are left out; --camera sets one"
    modes = [one.get("mode", 4) for mesh in document.top_level_array("meshes") for one in mesh["primitives"]]
    thin = sum(mode in _POINT_AND_LINE_MODES for mode in modes)
    if thin:
        yield f"points and lines ({thin} primitives) are left out"
    if len(document.top_level_array("scenes")) > 1:
        yield f"one of its {len(document.top_level_array('scenes'))} scenes is read"
    unread = [
        name for name in map(str, document.top_level_array("extensionsUsed")) if name not in read_extensions
    ]
    if unread:
        yield f"these extensions are left out: {join_names(unread)}"
