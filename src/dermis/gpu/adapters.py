"""Graphics adapters of this machine, their limits, and a faster start of wgpu.

During the first frame, wgpu looks up 75 C types by name. For each name, cffi parses all typedefs of wgpu's
header again, which takes about ten milliseconds. The types are therefore registered in advance.
"""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from dermis.base.errors import refuse
from dermis.gpu.drivers import driver_advice
from dermis.gpu.memory import check_driver_address_space
from dermis.gpu.types import Untyped

_C_TYPEDEF_PREFIX = "typedef "
_C_INTEGER_TYPES = ("char", "uint8_t", "uint32_t", "uintptr_t", "intptr_t")
OPTIONAL_FEATURES = ("timestamp-query",)
"""Optional features of WebGPU that are requested where the adapter has them."""
DEFAULT_LIMITS = {
    "max-texture-dimension-1d": 8192,
    "max-texture-dimension-2d": 8192,
    "max-texture-dimension-3d": 2048,
    "max-texture-array-layers": 256,
    "max-bind-groups": 4,
    "max-bindings-per-bind-group": 1000,
    "max-dynamic-uniform-buffers-per-pipeline-layout": 8,
    "max-dynamic-storage-buffers-per-pipeline-layout": 4,
    "max-sampled-textures-per-shader-stage": 16,
    "max-samplers-per-shader-stage": 16,
    "max-storage-buffers-per-shader-stage": 8,
    "max-storage-textures-per-shader-stage": 4,
    "max-uniform-buffers-per-shader-stage": 12,
    "max-uniform-buffer-binding-size": 65536,
    "max-storage-buffer-binding-size": 128 << 20,
    "max-buffer-size": 256 << 20,
    "min-uniform-buffer-offset-alignment": 256,
    "min-storage-buffer-offset-alignment": 256,
    "max-vertex-buffers": 8,
    "max-vertex-attributes": 16,
    "max-vertex-buffer-array-stride": 2048,
    "max-inter-stage-shader-variables": 16,
    "max-color-attachments": 8,
    "max-color-attachment-bytes-per-sample": 32,
    "max-compute-workgroup-storage-size": 16384,
    "max-compute-invocations-per-workgroup": 256,
    "max-compute-workgroup-size-x": 256,
    "max-compute-workgroup-size-y": 256,
    "max-compute-workgroup-size-z": 64,
    "max-compute-workgroups-per-dimension": 65535,
    "max-immediate-size": 0,
}
"""Limits that WebGPU guarantees on every machine (section "Limits" of its specification)."""
_REQUIRED_LIMITS = tuple(
    name for name in DEFAULT_LIMITS if any(word in name for word in ("stage", "compute", "group", "layout"))
)
"""Limits that programs rely on; the limits of texture and buffer sizes may be lower."""
_ADAPTER_KINDS_BEST_FIRST = ("DiscreteGPU", "IntegratedGPU", "VirtualGPU", "Unknown", "CPU")


def register_wgpu_types() -> None:
    """Register the C types of wgpu's native library with cffi, before wgpu is used, to speed up its start."""
    with contextlib.suppress(ImportError):  # other builds of wgpu need no registration
        from wgpu.backends.wgpu_native import ffi

        register_c_types(ffi)


def register_c_types(ffi: Any) -> int:
    """Register the C types of pointers, arrays and callbacks with cffi, and return their number.

    This uses cffi's internals. If these have changed, nothing is registered and the first frame takes longer.
    """
    try:
        with ffi._lock:  # cffi's own callers take it too
            declared = ffi._parser._declarations
            types = {
                name: (ffi._get_cached_btype(kind), False)
                for name, kind in _pointer_and_array_types(declared)
            }
            types |= {name: (ffi._get_cached_btype(kind), True) for name, kind in _callback_types(declared)}
        for name, parsed in types.items():
            ffi._parsed_types.setdefault(name, parsed)
    except Exception:  # another cffi may raise anything
        return 0
    return len(types)


def _pointer_and_array_types(declarations: Any) -> Iterator[tuple[str, Any]]:
    """Yield the C type names of pointers and arrays as wgpu spells them, with their cffi models.

    declarations : dictionary from C names to the declarations that cffi parsed from wgpu's header
    """
    from cffi import model  # type: ignore[import-untyped]

    named = {
        name.removeprefix(_C_TYPEDEF_PREFIX): kind
        for name, (kind, _) in declarations.items()
        if _C_TYPEDEF_PREFIX in name
    }
    for name, kind in named.items():
        if isinstance(kind, model.StructType | model.PrimitiveType):
            yield from ((f"{name} *{space}", model.PointerType(kind)) for space in ("", " "))
        if isinstance(kind, model.StructType | model.PointerType | model.EnumType):
            yield f"{name}[]", model.ArrayType(kind, None)
    for name in _C_INTEGER_TYPES:
        yield name, model.PrimitiveType(name)
        yield f"{name} *", model.PointerType(model.PrimitiveType(name))
        yield f"{name} []", model.ArrayType(model.PrimitiveType(name), None)


def _callback_types(declarations: Any) -> Iterator[tuple[str, Any]]:
    """Yield, for each callback type of wgpu's header, its C signature and its parsed type.

    The signature is a string that uses the header's names of types; the parsed type is an object of
    `cffi.model`.

    declarations : dictionary from C names to the declarations that cffi parsed from wgpu's header
    """
    from cffi import model

    named = {
        name.removeprefix(_C_TYPEDEF_PREFIX): kind
        for name, (kind, _) in declarations.items()
        if _C_TYPEDEF_PREFIX in name
    }
    handles = {kind.get_c_name(): name for name, kind in named.items() if isinstance(kind, model.PointerType)}
    for name, kind in named.items():
        if name.endswith("Callback"):
            arguments = ", ".join(argument.get_c_name() for argument in kind.args)
            for structure, handle in handles.items():
                arguments = arguments.replace(structure, handle)
            yield f"{kind.result.get_c_name()}({arguments})", kind


@dataclass(frozen=True)
class Adapter:
    """Graphics processor, or software renderer, as seen through one backend.

    name, driver : names of the adapter and its driver, as the driver reports them
    kind : type of the adapter: "DiscreteGPU", "IntegratedGPU", "VirtualGPU", "CPU" or "Unknown"
    backend : graphics interface: "Vulkan", "Metal", "D3D12" or "OpenGL"
    features : names in `OPTIONAL_FEATURES` that the adapter supports
    handle : adapter object of wgpu
    number : index in the result of `list_adapters`; the selector "#1" selects the adapter with the number 1
    """

    name: str
    driver: str
    kind: str
    backend: str
    features: tuple[str, ...]
    handle: Untyped
    number: int = 0


def list_adapters() -> list[Adapter]:
    """Return all adapters, best first: GPUs before software adapters, then by number of features.

    Raises DermisError if drivers fail, or if the address space is too small for them.
    """
    check_driver_address_space()
    try:
        import wgpu
    except (ImportError, OSError) as error:
        refuse("wgpu", "its native library to load", f"it does not: {error}", "Install the package again")
    register_wgpu_types()
    try:
        with _silenced_stderr():
            adapters = [_describe_adapter(handle) for handle in wgpu.gpu.enumerate_adapters_sync()]
    except Exception as error:  # a broken driver may raise anything
        refuse("graphics drivers", "a list of adapters", f"they fail: {error}", driver_advice())
    adapters.sort(key=lambda a: (_adapter_kind_rank(a.kind), -len(a.features), a.backend == "OpenGL"))
    return [replace(one, number=number) for number, one in enumerate(adapters)]


def select_adapters(selector: str) -> tuple[list[Adapter], str]:
    """Return the adapters that match a selector, best first, and the reason for the choice as text.

    selector : "auto", "cpu", part of a name, or "#" and a number, which is counted from 0, such as "#1"

    Raises DermisError if no adapter matches.
    """
    adapters = list_adapters()
    # OpenGL renders wrongly or not at all, so it has to be selected by name.
    reliable = [a for a in adapters if a.backend != "OpenGL"]
    if not adapters or (selector in ("auto", "cpu") and not reliable):
        actual = "this machine shows only OpenGL's" if adapters else "this machine shows none"
        refuse("adapter", "a Vulkan, Metal or DX12 adapter", actual, driver_advice())
    if match := re.fullmatch(r"#(\d{1,4})", selector):
        number = int(match[1])
        fitting, reason = adapters[number : number + 1], f"it is the one with the number {number}"
    elif selector == "auto":
        fitting, reason = reliable, "it is the fastest kind, with the most features"
    elif selector == "cpu":
        fitting, reason = [a for a in reliable if a.kind == "CPU"], "software was requested"
    else:
        fitting = [a for a in adapters if selector.lower() in f"{a.name} {a.driver} {a.backend}".lower()]
        reason = f"its name contains {selector!r}"
    if not fitting:
        names = ", ".join(f"#{a.number} {a.name} ({a.backend})" for a in adapters)
        advice = (
            driver_advice() if selector == "cpu" else "Choose auto, cpu, part of one of these names, or #0"
        )
        refuse(f"adapter {selector!r}", "one of this machine's adapters", f"it has {names}", advice)
    return fitting, reason


def adapters_like_best_match(selector: str) -> list[Adapter]:
    """Return the best adapter for a selector, then all other matching GPUs of the same kind and backend.

    Because all returned adapters use one backend, no GPU is listed twice. A software adapter is returned
    alone.

    Raises DermisError if no adapter matches.
    """
    (best, *others), _ = select_adapters(selector)
    if best.kind == "CPU":
        return [best]
    return [best, *(one for one in others if (one.kind, one.backend) == (best.kind, best.backend))]


def check_limits(adapter_name: str, adapter_limits: Mapping[str, int]) -> None:
    """Raise DermisError for an adapter whose limits are too low for the shaders of a frame.

    adapter_name : name of the adapter, for the message
    adapter_limits : dictionary from the name of a limit to its value on the adapter
    """
    for name in _REQUIRED_LIMITS:
        minimum = DEFAULT_LIMITS[name]
        if adapter_limits.get(name, minimum) < minimum:
            expected = f"{name} of at least {minimum}, as WebGPU promises"
            advice = "Choose another adapter, which dermis doctor lists, or update its driver"
            refuse(f"adapter {adapter_name}", expected, f"it has {adapter_limits[name]}", advice)


def device_limits(adapter_limits: Mapping[str, int], full_limit_names: Sequence[str]) -> dict[str, int]:
    """Return the limits to request for a device, as a dictionary from the name of a limit to its value.

    Most limits are WebGPU's defaults, or lower where the adapter offers less.

    adapter_limits : dictionary from the name of a limit to its value on the adapter
    full_limit_names : names of the other limits, which are requested as high as the adapter offers
    """
    limits = {
        name: (max if name.startswith("min-") else min)(default, adapter_limits.get(name, default))
        for name, default in DEFAULT_LIMITS.items()
    }
    return limits | {name: adapter_limits[name] for name in full_limit_names}


def _describe_adapter(wgpu_adapter: Untyped) -> Adapter:
    info = wgpu_adapter.info
    return Adapter(
        name=info["device"],
        driver=info["description"],
        kind=info["adapter_type"],
        backend=info["backend_type"],
        features=tuple(f for f in OPTIONAL_FEATURES if f in wgpu_adapter.features),
        handle=wgpu_adapter,
    )


def _adapter_kind_rank(adapter_kind: str) -> int:
    return _ADAPTER_KINDS_BEST_FIRST.index(
        adapter_kind if adapter_kind in _ADAPTER_KINDS_BEST_FIRST else "Unknown"
    )


@contextlib.contextmanager
def _silenced_stderr() -> Iterator[None]:
    """Discard writes to stderr (file descriptor 2): without a display, drivers print warnings there."""
    try:
        saved = os.dup(2)
    except OSError:  # there is no stderr
        yield
        return
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(sink)
