"""Validation of the messages of a page: events with plausible values, and nothing else."""

from __future__ import annotations

import json
from typing import Any

import pytest

from dermis.apps.viewer.browser.request_filter import checked_message

POINTER = {"type": "pointer_move", "x": 1, "y": 2.5, "button": 1, "buttons": [1], "modifiers": ["Shift"]}
RESIZE = {"type": "resize", "width": 960, "height": 540, "pwidth": 1920, "pheight": 1080, "ratio": 2}
WHEEL = {"type": "wheel", "x": 1, "y": 2, "dx": 0, "dy": -100, "buttons": [], "modifiers": []}
KEY = {"type": "key_down", "key": "Enter", "modifiers": ["Control"]}
CHAR = {"type": "char", "data": "ü", "is_composing": False, "input_type": "insertText"}
SHOWN = {"type": "_framefeedback", "index": 3, "localtime": 1.8e9}
TOUCHES = {"0": {"x": 1, "y": 2, "pressure": 0.5}, "1": {"x": 3, "y": 4}}


@pytest.mark.parametrize(
    "event",
    [
        POINTER,
        POINTER | {"type": "double_click"},
        POINTER | {"ntouches": 2, "touches": TOUCHES},
        RESIZE,
        RESIZE | {"pwidth": 0, "pheight": 0, "ratio": 0.25},
        WHEEL,
        KEY,
        CHAR,
        CHAR | {"data": None},
        SHOWN,
        {"type": "hide"},
    ],
)
def test_valid_page_events_pass(event: dict[str, Any]) -> None:
    passed = json.loads(str(checked_message(json.dumps(event | {"timestamp": 12.5}))))
    assert {name: passed[name] for name in event if name != "touches"} == {
        name: value for name, value in event.items() if name != "touches"
    }
    touches = event.get("touches", {})
    assert [(one["x"], one["y"]) for one in passed.get("touches", {}).values()] == [
        (one["x"], one["y"]) for one in touches.values()
    ]


NUMBERS = [float("nan"), float("inf"), -float("inf"), 1e300, -1e300, 10**400, "1", None, True, [], {}]
FIELDS = [
    (RESIZE, "ratio"),
    (POINTER, "x"),
    (WHEEL, "dy"),
    (RESIZE, "pwidth"),
    (SHOWN, "index"),
    (KEY, "timestamp"),
]


@pytest.mark.parametrize(("event", "field"), FIELDS, ids=[field for _, field in FIELDS])
@pytest.mark.parametrize("value", NUMBERS, ids=[str(value)[:5] for value in NUMBERS])
def test_numbers_are_finite_and_in_range(event: dict[str, Any], field: str, value: Any) -> None:
    assert checked_message(json.dumps({"timestamp": 1.0} | event)) is not None
    assert checked_message(json.dumps({"timestamp": 1.0} | event | {field: value})) is None


@pytest.mark.parametrize("ratio", [1e-300, 5e-324, 0, -0.0, -1, 0.01, 21])
def test_pixel_ratios_are_limited_to_real_screens(ratio: float) -> None:
    assert checked_message(json.dumps(RESIZE | {"timestamp": 1, "ratio": ratio})) is None


@pytest.mark.parametrize(
    "event",
    [
        RESIZE | {"pwidth": 100000},
        RESIZE | {"pheight": -1},
        RESIZE | {"pheight": 0.5},
        {"type": "resize"},
        SHOWN | {"index": -1},
        {"type": "_framefeedback"},
        {"type": "close"},
        {"type": "_clients_change", "ids": [7]},
        {"type": "before_draw"},
        {"type": 3},
        {"type": ["show"]},
        {"x": 1},
        POINTER | {"buttons": "1"},
        POINTER | {"buttons": [1e9]},
        POINTER | {"buttons": [1] * 100},
        POINTER | {"modifiers": {"Shift": 1}},
        POINTER | {"touches": [1]},
        POINTER | {"touches": {"0": {"x": 1}}},
        POINTER | {"touches": {str(k): {"x": 1, "y": 1} for k in range(17)}},
        KEY | {"key": "x" * 33},
        KEY | {"key": 3},
        CHAR | {"data": "x" * 5000},
        CHAR | {"data": "\ud800"},
    ],
)
def test_other_events_are_dropped(event: dict[str, Any]) -> None:
    assert checked_message(json.dumps({"timestamp": 1.0} | event)) is None


def test_unknown_event_fields_are_dropped() -> None:
    passed = json.loads(
        str(checked_message(json.dumps(KEY | {"timestamp": 1, "event_type": "close", "more": [1]})))
    )
    assert passed == KEY | {"timestamp": 1.0}


@pytest.mark.parametrize(
    "text",
    ["", "{", "hello", "3", "[1, 2]", None, b"{}", "[" * 4000, '{"a":' * 700, "9" * 4000, '{"type": "show"'],
    ids=lambda text: str(text)[:6],
)
def test_invalid_events_are_dropped(text: Any) -> None:
    assert checked_message(text) is None
