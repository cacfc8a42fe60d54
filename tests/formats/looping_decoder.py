"""Program that decodes nothing: it crashes, loops or fills the memory, as the request says."""

from __future__ import annotations

import os
import signal
import sys

import numpy as np

from dermis.base.errors import DermisError
from dermis.base.native_decoding import answer_request


def decode(request: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    (fault,) = request
    if fault == "crash":
        os.kill(os.getpid(), signal.SIGSEGV)
    while fault == "loop":
        pass
    if fault == "memory":
        return {"ones": np.ones(1 << 29)}
    if fault == "refuse":
        raise DermisError("a.x: expected one, but it has two. Remove it.")
    if fault == "fail":
        raise KeyError("lost")
    print("libraries print")
    os.write(1, b"messages")
    return request | {"path": np.frombuffer("\n".join(sys.path).encode(), np.uint8)}


if __name__ == "__main__":
    answer_request(decode)
