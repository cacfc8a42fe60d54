"""Opening of USD stages whose layers are all in the folder of the file, or in its package (.usdz)."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.formats.size_limits import DAMAGED_ADVICE, MAX_FILE_BYTES, check_limit

if TYPE_CHECKING:
    from pxr import Sdf, Usd

LAYER_SUFFIXES = (".usd", ".usda", ".usdc")
_FAULT_LOCATION_PATTERN = re.compile(r"/([^/\s]+:\d+:\d+: .*)")
"""Pattern of an error message with the position of the error in a text layer."""
_MAX_LAYERS, _MAX_PACKAGE_ENTRIES = 256, 4096
_LAYER_ADVICE = "Flatten it into one file (usdcat --flatten), or export a .usdz"


class OpenedStage(NamedTuple):
    """Stage of a USD file, and the folder that contains its layers or, for a package, copies of them."""

    stage: Usd.Stage
    folder: Path


def open_stage(absolute_path: Path, path: Path, copy_folder: Path) -> OpenedStage:
    """Open the stage of a USD file.

    absolute_path : absolute path of the file
    path : path that the user typed, for error messages
    copy_folder : empty folder to which the layers of a package are copied

    Raises DermisError when a layer is missing, damaged, or not in the folder of the file or below it.
    """
    usd: Any = import_extra("pxr.Usd", f"{path}: USD scenes")
    root, folder = absolute_path, absolute_path.parent
    if absolute_path.suffix.lower() == ".usdz":
        root, folder = _extract_layers(absolute_path, path, copy_folder.resolve()), copy_folder.resolve()
    _check_layers(path, root, folder)
    stage = usd.Stage.Open(str(root))
    if stage is None:
        _refuse_damaged(path)
    return OpenedStage(stage, folder)


def _extract_layers(absolute_path: Path, path: Path, layer_folder: Path) -> Path:
    """Copy the layers of a package to a folder, and return the root layer, which is the first entry."""
    with zipfile.ZipFile(absolute_path) as package:
        entries = package.infolist()
        layers = [one for one in entries if Path(one.filename).suffix.lower() in LAYER_SUFFIXES]
        check_limit(path, len(entries), _MAX_PACKAGE_ENTRIES, "files in the package", "Export the head alone")
        total = sum(one.file_size for one in layers)
        check_limit(path, total, MAX_FILE_BYTES, "bytes of layers", "Export the head alone")
        if not layers or layers[0] is not entries[0]:
            refuse(path, "a package whose first file is a USD layer", "it is not", DAMAGED_ADVICE)
        copies = [Path(package.extract(one, layer_folder)) for one in layers]
    return copies[0]


def _check_layers(path: Path, root_layer: Path, layer_folder: Path) -> None:
    """Refuse a file that references layers outside its folder, before these layers are opened.

    root_layer : file of the root layer
    layer_folder : folder that must contain all layers
    """
    sdf: Any = import_extra("pxr.Sdf", f"{path}: USD scenes")
    pending, known, size = [root_layer], {root_layer}, 0
    while pending:
        file = pending.pop()
        size += file.stat().st_size
        check_limit(path, size, MAX_FILE_BYTES, "bytes of layers", "Export the head alone")
        try:
            layer = sdf.Layer.FindOrOpen(str(file))
        except RuntimeError as fault:
            reason = _FAULT_LOCATION_PATTERN.search(str(fault))
            _refuse_damaged(path, f" ({reason[1]})" if reason else "")
        if layer is None:
            _refuse_damaged(path)
        for name in _layer_names(path, layer):
            found = _layer_file(file, name, layer_folder)
            if found is None:
                refuse(path, "layers in its own folder or below", f"it references {name!r}", _LAYER_ADVICE)
            if found not in known:
                known.add(found)
                pending.append(found)
                check_limit(path, len(known), _MAX_LAYERS, "layers", _LAYER_ADVICE)


def _layer_names(path: Path, layer: Sdf.Layer) -> Iterator[str]:
    """Yield the names of the layers that a layer references.

    Raises DermisError for value clips, which name layers by patterns.
    """
    yield from layer.GetCompositionAssetDependencies()
    clips = list[str]()

    def visit(spec_path: Sdf.Path) -> None:
        spec = layer.GetPrimAtPath(spec_path) if spec_path.IsPrimPath() else None
        if spec is not None and (spec.HasInfo("clips") or spec.HasInfo("clipSets")):
            clips.append(str(spec_path))

    layer.Traverse("/", visit)
    if clips:
        refuse(path, "a scene without value clips", f"{clips[0]} has some", _LAYER_ADVICE)


def _layer_file(referencing_layer: Path, layer_name: str, layer_folder: Path) -> Path | None:
    """Return the file of a layer that another layer references; None for a file outside the folder.

    referencing_layer : file of the referencing layer
    layer_name : name of the referenced layer, as written in the referencing layer
    layer_folder : folder that must contain all layers
    """
    if any(mark in layer_name for mark in ":[`\0"):  # names with schemes, packages or expressions
        return None
    file = (referencing_layer.parent / layer_name).resolve()
    is_layer = file.suffix.lower() in LAYER_SUFFIXES and file.is_relative_to(layer_folder) and file.is_file()
    return file if is_layer else None


def _refuse_damaged(path: Path, reason: str = "") -> NoReturn:
    refuse(path, "a USD scene", f"it cannot be opened{reason}", DAMAGED_ADVICE)
