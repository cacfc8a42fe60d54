"""C types that wgpu asks cffi for by name, registered in advance.

cffi parses each new name together with all typedefs of the header, which takes some ten milliseconds, and
a first frame asks for seventy-five. Here they are built from what cffi has already parsed.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

_TYPEDEF = "typedef "
_NUMBERS = ("char", "uint8_t", "uint32_t", "uintptr_t", "intptr_t")


def register_wgpu_types() -> None:
    """Register the types; to be called before wgpu is used."""
    with contextlib.suppress(ImportError):  # other builds of wgpu need nothing
        from wgpu.backends.wgpu_native import ffi

        register_types(ffi)


def register_types(ffi: Any) -> int:
    """Register names of pointers, arrays and callbacks with cffi; returns how many.

    This uses cffi's internals. Where those differ it does nothing, and the first frame takes longer.
    """
    try:
        with ffi._lock:  # as its own callers do
            declared = ffi._parser._declarations
            made = {name: (ffi._get_cached_btype(kind), False) for name, kind in _types(declared)}
            made |= {name: (ffi._get_cached_btype(kind), True) for name, kind in _callbacks(declared)}
        for name, found in made.items():
            ffi._parsed_types.setdefault(name, found)
    except Exception:  # another cffi may raise anything
        return 0
    return len(made)


def _types(declared: Any) -> Iterator[tuple[str, Any]]:
    """Names of types as wgpu spells them, with cffi's descriptions of the types."""
    from cffi import model  # type: ignore[import-untyped]

    named = {name.removeprefix(_TYPEDEF): kind for name, (kind, _) in declared.items() if _TYPEDEF in name}
    for name, kind in named.items():
        if isinstance(kind, model.StructType | model.PrimitiveType):
            yield from ((f"{name} *{space}", model.PointerType(kind)) for space in ("", " "))
        if isinstance(kind, model.StructType | model.PointerType | model.EnumType):
            yield f"{name}[]", model.ArrayType(kind, None)
    for name in _NUMBERS:
        yield name, model.PrimitiveType(name)
        yield f"{name} *", model.PointerType(model.PrimitiveType(name))
        yield f"{name} []", model.ArrayType(model.PrimitiveType(name), None)


def _callbacks(declared: Any) -> Iterator[tuple[str, Any]]:
    """Signatures of callbacks as wgpu spells them, with cffi's descriptions of the function pointers."""
    from cffi import model

    named = {name.removeprefix(_TYPEDEF): kind for name, (kind, _) in declared.items() if _TYPEDEF in name}
    handles = {kind.get_c_name(): name for name, kind in named.items() if isinstance(kind, model.PointerType)}
    for name, kind in named.items():
        if name.endswith("Callback"):
            spelled = ", ".join(argument.get_c_name() for argument in kind.args)
            for structure, handle in handles.items():
                spelled = spelled.replace(structure, handle)
            yield f"{kind.result.get_c_name()}({spelled})", kind
