"""C types registered with cffi, compared with those that it parses itself."""

from __future__ import annotations

import cffi
import pytest

from dermis.gpu import adapters as native_types
from dermis.gpu.adapters import register_c_types

HEADER = """
typedef enum Colour { Red, Green, Force = 0x7FFFFFFF } Colour;
typedef struct DeviceImpl* Device;
typedef struct Chain { struct Chain *next; Colour colour; } Chain;
typedef struct Entry { Chain chain; Device device; uint32_t count; double scale; } Entry;
typedef void (*EntryCallback)(Device const * device, Colour colour, Entry entry, void* userdata);
"""
CALLBACK = "void(Device const *, Colour, Entry, void *)"
ASKED = (
    "Entry *",
    "Entry * ",
    "Entry[]",
    "Chain *",
    "Device[]",
    "Colour[]",
    "char []",
    "uint8_t []",
    "uint8_t *",
    "uintptr_t",
)


def test_types_equal_those_of_cffi() -> None:
    told, plain = cffi.FFI(), cffi.FFI()
    for ffi in (told, plain):
        ffi.cdef(HEADER)
    assert register_c_types(told) > len(ASKED)
    assert set(ASKED) <= set(told._parsed_types)  # type: ignore[attr-defined]
    for name in ASKED:
        a, b = told.typeof(name), plain.typeof(name)
        assert (a.kind, a.cname) == (b.kind, b.cname) and str(a) == str(b)
    entry = told.new("Entry *", {"count": 7, "scale": 0.5})
    assert entry.count == 7 and entry.scale == 0.5 and told.sizeof(entry[0]) == plain.sizeof("Entry")
    assert told.new("Entry[]", 3)[2].count == 0
    called = []
    listener = told.callback(CALLBACK)(lambda *given: called.append(given[1]))
    assert told.typeof(listener) is told.typeof("EntryCallback") and CALLBACK in told._parsed_types  # type: ignore[attr-defined]
    listener(told.NULL, 1, entry[0], told.NULL)
    assert called == [1] and str(plain.typeof("EntryCallback")) == str(told.typeof("EntryCallback"))
    # spelled otherwise, cffi finds the same type as before
    assert told.typeof("Entry  *") is told.typeof("Entry *")
    assert told.typeof("Colour []") is told.typeof("Colour[]")


def test_wgpu_receives_the_types_it_requests() -> None:
    """Check that all names are registered that wgpu looks up."""
    from wgpu.backends.wgpu_native import ffi

    declared = ffi._parser._declarations
    told = {
        name
        for name, _ in (
            *native_types._pointer_and_array_types(declared),
            *native_types._callback_types(declared),
        )
    }
    assert register_c_types(ffi) == len(told) and told <= set(ffi._parsed_types)
    assert {"WGPUBindGroupEntry *", "WGPUBindGroupEntry[]", "WGPUExtent3D *", "WGPUCommandBuffer[]"} <= told
    assert "void(WGPUDevice const *, WGPUErrorType, WGPUStringView, void *, void *)" in told
    assert "void(WGPUMapAsyncStatus, WGPUStringView, void *, void *)" in told


@pytest.mark.parametrize("broken", [object(), None])
def test_other_cffi_instances_are_unchanged(broken: object) -> None:
    assert register_c_types(broken) == 0
