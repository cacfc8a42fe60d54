"""How close is close: every tolerance of the tests, once, with its reason.

A test that needs another number than these says so where it stands.
"""

from __future__ import annotations

TWIN = 1e-4
"""Shader against float64 twin, of the value's scale: float32 and fast exp, pow and sqrt stay far under."""

PUBLISHED = 1e-9
"""Closed forms against tables printed with 16 digits, relative."""

TABLE_ALBEDO = 0.01
"""The shader's 64 x 32 table of the surface albedo, read between its texels, relative."""

TABLE_LOBE = 0.002
"""The shader's 512 x 512 Beckmann table, read between its texels, of the lobe's peak."""
