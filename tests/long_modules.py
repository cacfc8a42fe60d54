"""Test modules that take longest, which run first: otherwise one process runs the last of them alone."""

from __future__ import annotations

LONG = (
    "gallery/test_scripts.py",
    "pictures/test_pictures.py",
    "viewer/test_adversity.py",
    "export/test_export_maps.py",
    "human/test_grown_strands.py",
    "test_docs.py",
    "test_wheel.py",
    "adversity/test_campaign.py",
    "cli/test_tutorials.py",
    "frame/test_outside_orders.py",
    "frame/test_lost_device.py",
    "frame/test_drawn_people.py",
    "batch/test_distributed.py",
    "batch/test_drivers.py",
    "batch/test_run.py",
    "viewer/test_viewer.py",
    "viewer/test_preparing.py",
    "viewer/test_browser.py",
    "viewer/test_window.py",
    "viewer/test_opening.py",
    "truths/test_person_traced.py",
    "human/test_regions.py",
)
"""Paths of the modules below `tests`, in the order in which they start."""
