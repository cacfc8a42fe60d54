"""What a shard says of itself when it is whole."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib.metadata import version

from dermis.base.reading import parse_json, understood

NAME = "__whole__"
"""Of the file in a shard that says so: its last one, which the library webdataset passes over."""
MOST_BYTES = 1 << 20


@dataclass(frozen=True)
class Stamp:
    """What a shard says of itself.

    spec : digest of the data set's
    first, stop : its images, from the first to before the last
    left_out : number and reason of images that could not be made
    sha256 : of all that is in it before this
    made_with : the adapter, and versions of what drew
    """

    spec: str
    index: int
    first: int
    stop: int
    left_out: tuple[tuple[int, str], ...] = ()
    sha256: str = ""
    made_with: dict[str, str] = field(default_factory=dict)

    def data(self) -> bytes:
        """Its bytes, the last of which are a hash of the others."""
        told = asdict(self)
        check = hashlib.sha256(json.dumps(told).encode()).hexdigest()
        return (json.dumps({**told, "check": check}, indent=1) + "\n").encode()


def read_stamp(data: bytes, culprit: object) -> Stamp:
    """The stamp of its bytes.

    Raises DermisError for what is none.
    """
    told = parse_json(data, culprit, "what a whole shard says of itself")
    with understood(culprit, "what a whole shard says of itself", KeyError, TypeError, AttributeError):
        index, first, stop = (told[name] for name in ("index", "first", "stop"))
        texts = [told["spec"], told["sha256"], *told["made_with"], *told["made_with"].values()]
        left_out = tuple((number, reason) for number, reason in told["left_out"])
        numbers = [index, first, stop, *(number for number, _ in left_out)]
        texts += [reason for _, reason in left_out]
        if any(type(one) is not int or one < 0 for one in numbers) or not all(
            isinstance(text, str) for text in texts
        ):
            raise ValueError("its values are of other kinds")
        found = Stamp(told["spec"], index, first, stop, left_out, told["sha256"], dict(told["made_with"]))
        if found.data() != data:
            raise ValueError("its hash is that of another text")
        return found


@cache
def versions() -> dict[str, str]:
    """Of what draws."""
    return {"dermis": version("dermis"), "wgpu": version("wgpu"), "python": platform.python_version()}


def made_with(adapter: str) -> dict[str, str]:
    """What a shard is made with."""
    return {"adapter": adapter, **versions()}
