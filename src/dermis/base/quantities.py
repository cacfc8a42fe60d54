"""Numbers that callers and files give: finite, within what can be, and Python's own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from dermis.base.errors import refuse, shown_value

if TYPE_CHECKING:  # loading it takes longer than all of --help
    import numpy as np
    from numpy.typing import NDArray


def number(culprit: object, value: object, low: float, high: float, why: str = "") -> float:
    """The value as a float, from `low` to `high`.

    culprit : named in messages
    why : the reason of the bounds

    DermisError : it is text, a truth value, an array, not finite, or out of the range
    """
    found = _within(value, low, high)
    if found is None:
        _refuse_number(culprit, "a number", value, low, high, why)
    return float(found)


def whole_number(culprit: object, value: object, low: float, high: float, why: str = "") -> int:
    """As `number`, for counts and seeds; 4.0 is 4."""
    found = _within(value, low, high)
    if found is None or found != int(found):
        _refuse_number(culprit, "a whole number", value, low, high, why)
    return int(found)


def numbers(
    culprit: object, values: object, shape: tuple[int, ...], low: float, high: float, why: str = ""
) -> NDArray[np.float64]:
    """The values as an array of a shape, each from `low` to `high`.

    shape : with 0 for a side of any length

    DermisError : they have another shape, or one is no such number
    """
    import numpy as np

    try:
        if _has_text(values, len(shape)):
            raise TypeError
        found = np.asarray(values, np.float64)
        fits = found.ndim == len(shape) and bool(((low <= found) & (found <= high)).all())
        fits = fits and all(side in (0, own) for side, own in zip(shape, found.shape, strict=True))
    except (TypeError, ValueError, OverflowError):
        fits = False
    if not fits:
        form = " x ".join(str(side or "n") for side in shape)
        expected = f"{form} numbers from {low:.10g} to {high:.10g}{f' ({why})' if why else ''}"
        refuse(culprit, expected, f"{shown_value(values)} came", "Correct it")
    return found


def check_numbers(owner: object, ranges: Mapping[str, tuple[float, float]], prefix: str = "") -> None:
    """Refuse fields of an object that are not within their ranges; those with whole bounds are whole.

    DermisError : as `number`
    """
    for name, (low, high) in ranges.items():
        check = whole_number if isinstance(low, int) and isinstance(high, int) else number
        check(f"{prefix}{name}", getattr(owner, name), low, high)


def _within(value: object, low: float, high: float) -> int | float | None:
    """The value as Python's number; None for what is none, or not in the range."""
    found: Any = value
    if type(value) not in (int, float):  # numbers of a default need no NumPy
        import numpy as np

        found = value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value
    is_number = isinstance(found, int | float) and not isinstance(found, bool)
    return found if is_number and low <= found <= high else None


def _has_text(values: Any, sides: int) -> bool:
    """Whether texts or truth values are among the values, which NumPy would read as numbers.

    sides : of the array that they should be; deeper lists count as text
    """
    import numpy as np

    if sides and isinstance(values, list | tuple):
        return any(_has_text(one, sides - 1) for one in values)
    return isinstance(values, list | tuple | str | bytes | bool | np.bool_) or (
        isinstance(values, np.ndarray) and values.dtype.kind not in "iuf"
    )


def _refuse_number(culprit: object, kind: str, value: object, low: float, high: float, why: str) -> NoReturn:
    reason = f" ({why})" if why else ""
    expected = f"{kind} from {low:.10g} to {high:.10g}{reason}"
    refuse(culprit, expected, f"{shown_value(value)} came", "Choose within")
