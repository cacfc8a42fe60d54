"""Decoding of untrusted data by native libraries, in a separate process with limits.

A decoder is a module of this package that calls `answer_request` when it is run as a program. Request and
answer consist of named arrays: a line of JSON with the names, types and shapes of the arrays, followed by the
bytes of the arrays. A crash, a hang, or the use of too much memory ends the process and becomes a
`DermisError`.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from tempfile import TemporaryDirectory, TemporaryFile

import numpy as np

from dermis.base.arrays import Bytes
from dermis.base.disk import Arrays
from dermis.base.errors import DermisError, refuse, shorten

_BASE_CPU_LIMIT_S, _BASE_CPU_LIMIT_BYTES = 8.0, 64 << 20
"""Limit of CPU time [s] for data of up to `_BASE_CPU_LIMIT_BYTES` bytes. For larger data, the limit is
proportional to the size."""
# limit of elapsed time, as a multiple of the limit of CPU time: the machine may be busy
_MAX_WAIT_PER_CPU_TIME = 3.0
_MAX_MEMORY_BYTES = 2 << 30  # limit of the address space; the libraries of USD use a third of it
_MAX_ANSWER_BYTES = 1 << 30  # limit of the answer, and of each temporary file
_REFUSED_KEY, _FAILED_KEY = "refused", "failed"
_MAX_MESSAGE_LENGTH = 2000  # characters
_DAMAGED_ADVICE = "The file is damaged: export it again"
_DECODER_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1"}
_REMOVED_ENVIRONMENT_VARIABLES = ("PXR_AR_DEFAULT_SEARCH_PATH", "PXR_PLUGINPATH_NAME", "PYTHONSTARTUP")


def run_decoder(
    decoder_module: str, request_arrays: Arrays, data_bytes: int, error_subject: object, expected_content: str
) -> Arrays:
    """Run a decoder in a separate process and return its answer.

    decoder_module : module of the decoder, which runs in an empty temporary folder
    request_arrays : dictionary from name to numeric array
    data_bytes : size of the data to decode [bytes]; determines the time limit
    error_subject : name of the file, for errors
    expected_content : what the file should be, for errors

    Raises DermisError when the decoder refuses the data, fails, or exceeds a limit.
    """
    cpu_s = _BASE_CPU_LIMIT_S * max(1.0, data_bytes / _BASE_CPU_LIMIT_BYTES)
    command = [sys.executable, "-P", "-m", decoder_module, str(math.ceil(cpu_s))]
    kept = {name: value for name, value in os.environ.items() if name not in _REMOVED_ENVIRONMENT_VARIABLES}
    with TemporaryDirectory() as folder, TemporaryFile() as output:
        try:
            status = subprocess.run(
                command,
                input=_pack_arrays(request_arrays),
                stdout=output,
                stderr=subprocess.DEVNULL,
                cwd=folder,
                env=kept | _DECODER_ENVIRONMENT,
                timeout=_MAX_WAIT_PER_CPU_TIME * cpu_s,
                check=False,
            ).returncode
        except subprocess.TimeoutExpired:
            refuse(
                error_subject, expected_content, f"its decoder takes more than {cpu_s:.0f} s", _DAMAGED_ADVICE
            )
        if status != 0 or output.seek(0, os.SEEK_END) > _MAX_ANSWER_BYTES:
            actual = f"its decoder stopped ({_stop_reason(status)})"
            refuse(error_subject, expected_content, actual, _DAMAGED_ADVICE)
        output.seek(0)
        answer = _unpack_arrays(output.read())
    if _REFUSED_KEY in answer:
        raise DermisError(shorten(text_from_array(answer[_REFUSED_KEY]), _MAX_MESSAGE_LENGTH))
    if _FAILED_KEY in answer:
        refuse(
            error_subject,
            expected_content,
            f"it cannot be decoded ({text_from_array(answer[_FAILED_KEY])})",
            _DAMAGED_ADVICE,
        )
    return answer


def answer_request(decode: Callable[[Arrays], Arrays]) -> None:
    """Read a request from stdin, decode it, and write the answer to stdout.

    A decoder calls this function when it is run as a program, in its own process.

    decode : function that takes the request and returns the answer; raises DermisError to refuse the data,
        and any other exception if the data are damaged
    """
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries print messages
    _limit_process(int(sys.argv[1]))
    try:
        answer = _pack_arrays(decode(_unpack_arrays(sys.stdin.buffer.read())))
    except DermisError as error:
        answer = _pack_arrays({_REFUSED_KEY: array_from_text(str(error))})
    except Exception as error:
        text = " ".join(f"{type(error).__name__}: {error}"[:_MAX_MESSAGE_LENGTH].split())
        answer = _pack_arrays({_FAILED_KEY: array_from_text(shorten(text, 200))})
    with output:
        output.write(answer)


def text_from_array(array: Bytes) -> str:
    """Decode the text in a UTF-8 array, which belongs to the request to a decoder or to its answer."""
    return array.tobytes().decode("utf-8", "replace")


def array_from_text(text: str) -> Bytes:
    """Encode a text as a UTF-8 array for a request to a decoder, or for the decoder's answer."""
    return np.frombuffer(text.encode("utf-8", "replace"), np.uint8)


def _pack_arrays(arrays: Mapping[str, Bytes]) -> bytes:
    header = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    return b"".join([json.dumps(header).encode(), b"\n", *(array.tobytes() for array in arrays.values())])


def _unpack_arrays(packed_arrays: bytes) -> Arrays:
    line, _, body = packed_arrays.partition(b"\n")
    arrays, start = Arrays(), 0
    for name, (dtype, shape) in json.loads(line).items():
        flat = np.frombuffer(body, dtype, math.prod(shape), start)
        arrays[name], start = flat.reshape(shape), start + flat.nbytes
    return arrays


def _limit_process(cpu_s: int) -> None:
    """Limit memory, CPU time and files of this process, where the operating system supports such limits.

    cpu_s : largest CPU time [s]
    """
    try:
        import resource
    except ImportError:  # Windows, where only the elapsed time is limited
        return
    limits = {
        resource.RLIMIT_AS: _MAX_MEMORY_BYTES,
        resource.RLIMIT_CPU: cpu_s,
        resource.RLIMIT_FSIZE: _MAX_ANSWER_BYTES,
        resource.RLIMIT_CORE: 0,
    }
    for kind, value in limits.items():
        hard = resource.getrlimit(kind)[1]
        allowed = value if hard == resource.RLIM_INFINITY else min(value, hard)
        resource.setrlimit(kind, (allowed, allowed))


def _stop_reason(exit_status: int) -> str:
    return (
        f"signal {-exit_status}"
        if exit_status < 0
        else f"status {exit_status}"
        if exit_status
        else "its answer is too large"
    )
