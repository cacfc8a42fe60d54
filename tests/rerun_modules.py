"""Test modules whose failed tests are run a second time, with the reason for each.

All others do not depend on real time: they wait for an event with a generous limit, count events, or advance
their own clock.
"""

from __future__ import annotations

RERUN = {
    "test_browser": "two taps are one gesture within a time that Chromium measures",
    "test_served": "a still picture follows 0.3 s after the last change, by the timer of the event loop",
    "test_window": "the X server and the window's toolkit pass events on at a pace of their own",
}
"""Names of the modules, and what in each depends on the clock of another program."""
