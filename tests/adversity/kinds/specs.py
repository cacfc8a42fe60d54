"""Specs of data sets, with the files that they refer to."""

from __future__ import annotations

from functools import cache
from random import Random

from adversity.case import WRONG, FoundError, Input, Plan
from adversity.checks import check_finite
from adversity.kind import Kind
from adversity.kinds.pictures import picture_bytes

_MORE = """
images_per_person = 4
[person.skin]
melanin = {log_uniform = [0.005, 0.2]}
[person.hair]
style = {choice = ["none", "short"]}
[person.targets]
"nose/nose-hump-incr" = {normal = [0, 0.1]}
[expression]
name = {choice = ["own", "mixture"]}
[expressions.own]
mouthSmile = 0.4
[pose]
jawOpen = {uniform = [0, 0.3]}
[environment]
name = {files = "*.hdr"}
[state]
blush = {uniform = [0, 1]}
[clip]
frames = 2
flow = true
speech = {choice = [0, {uniform = [0.3, 1]}]}
pulse_per_min = {truncated = [70, 10, 50, 110]}
[rig]
kind = "stereo"
baseline_mm = {uniform = [50, 200]}
[blur]
f_number = {choice = [1.4, 8]}
shutter_ms = 20
[[correlated]]
of = ["camera.yaw_deg", "camera.pitch_deg", "head.yaw_deg"]
correlation = [[1, 0.2, 0.5], [0.2, 1, 0], [0.5, 0, 1]]
"""
_IMAGES = 8


@cache
def _texts() -> tuple[str, ...]:
    """Return the example spec, one with the remaining options, and its complete text."""
    from dermis.apps.batch.spec import example_toml, parse_spec

    return example_toml(), _MORE, parse_spec({"seed": 3}).to_toml()


def _spec(rng: Random) -> Input:
    files = {"spec.toml": rng.choice(_texts()).encode(), "sky.hdr": picture_bytes("sky.hdr")}
    return Input(files, {"file": "spec.toml"}, ("spec.toml",))


def _take_spec(plan: Plan) -> None:
    """Check that an accepted spec can be rendered and survives a round trip through its text."""
    import tomllib
    from pathlib import Path

    from dermis.apps.batch.spec import load_spec, parse_spec

    spec = load_spec(plan["file"])
    for k in range(min(spec.count, _IMAGES)):
        check_finite(spec.parameters(k), "parameters")
    if parse_spec(tomllib.loads(spec.to_toml()), Path(plan["file"]).parent) != spec:
        raise FoundError(WRONG, "the text of a spec reads as another one")


KINDS = (Kind("spec", _spec, _take_spec, share=12),)
