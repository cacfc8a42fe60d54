"""Numbers, names and texts that often break programs."""

from __future__ import annotations

from random import Random

PLAUSIBLE = ("0.5", "1", "2", "3", "10", "0.01", "100", "255")
NUMBERS = (
    *("nan", "inf", "-inf", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "1e39", "1e20", "-0.0"),
    *("-1", "0", "127", "128", "255", "256", "32768", "65535", "65536", "16777217"),
    *("2147483647", "2147483648", "-2147483648", "4294967295", "4294967296"),
    *("9223372036854775807", "9223372036854775808", "18446744073709551616"),
    *("9" * 400, "9" * 5000, "1." + "3" * 5000, "0x10", "1_000", "+1", "1e", "٣"),
)
PIPE = "pipe"
"""A FIFO without a writer that lies beside every input."""
NAMES = (
    *("/dev/zero", "/dev/stdin", "/dev/full", "/proc/kmsg", "/proc/self/mem", "/proc/self/environ", "/"),
    *(
        PIPE,
        f"../{PIPE}",
        ".",
        "..",
        "",
        " ",
        "../../../../etc/passwd",
        "/etc/passwd",
        "~",
        "%s%d%n",
        "*",
        "#",
    ),
    *("a" * 300, "a" * 5000, "a/" * 3000, "nobody.png", "a\0b", "a\nb", "\u202e\u0301\U0001f9b4", "\ud800"),
    *("http://127.0.0.1:9/a.png", "file:///etc/passwd", "data:,", "data:image/png;base64,@@@@"),
)
WHOLE = (
    0,
    1,
    2,
    127,
    128,
    255,
    256,
    32767,
    65535,
    65536,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**63,
    2**64 - 1,
)
"""Counts, sizes and offsets for fields of bytes."""
DEPTHS = (50, 1000, 20_000, 200_000)
LENGTHS = (300, 70_000, 1_000_000)


def number(rng: Random) -> str:
    """Return the text of a number, hostile three times out of four."""
    return rng.choice(NUMBERS if rng.random() < 0.75 else PLAUSIBLE)


def name(rng: Random) -> str:
    """Return a file name that should not be read."""
    return rng.choice(NAMES)


def word(rng: Random) -> str:
    """Return any text."""
    if rng.random() < 0.3:
        return rng.choice("aé\0 \"'\\[{#") * rng.choice(LENGTHS)
    return number(rng) if rng.random() < 0.5 else name(rng)


def whole(rng: Random, size: int) -> int:
    """Return an integer for a field of the given number of bytes."""
    return rng.choice(WHOLE) % (1 << 8 * size)
