"""Checks that numbers from callers or files are finite and in a range, and conversion to Python types."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NoReturn

from dermis.base.errors import format_value, refuse

if TYPE_CHECKING:  # importing NumPy takes longer than printing --help
    import numpy as np
    from numpy.typing import NDArray


def checked_number(error_subject: object, value: object, low: float, high: float, reason: str = "") -> float:
    """Return a value as a float after checking that it lies in a range.

    error_subject : option or field with the value, for errors
    low, high : limits of the range, both included
    reason : reason for the limits, or unit of the value, to be added to errors

    Raises DermisError for text, booleans, arrays, NaN, infinity and numbers outside the range.
    """
    found = _number_in_range(value, low, high)
    if found is None:
        _refuse_number(error_subject, "a number", value, low, high, reason)
    return float(found)


def checked_integer(error_subject: object, value: object, low: float, high: float, reason: str = "") -> int:
    """Return a value as an int after checking that it is a whole number in a range; 4.0 becomes 4.

    For parameters and errors see `checked_number`.
    """
    found = _number_in_range(value, low, high)
    if found is None or found != int(found):
        _refuse_number(error_subject, "a whole number", value, low, high, reason)
    return int(found)


def checked_array(
    error_subject: object, values: object, shape: tuple[int, ...], low: float, high: float, reason: str = ""
) -> NDArray[np.float64]:
    """Return values as a float64 array after checking the shape and the range of all elements.

    error_subject : option or field with the values, for errors
    shape : expected shape, with 0 for an axis of any length
    low, high : limits of the range, both included
    reason : reason for the limits, or unit of the value, to be added to errors

    Raises DermisError for another shape, and when an element is not a number in the range.
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
        expected = f"{form} numbers from {low:.10g} to {high:.10g}{f' ({reason})' if reason else ''}"
        refuse(error_subject, expected, f"got {format_value(values)}", "Correct it")
    return found


def check_fields(
    checked_object: object, range_of_field: Mapping[str, tuple[float, float]], prefix: str = ""
) -> None:
    """Check that the values of an object's attributes lie in given ranges.

    range_of_field : dictionary from the name of an attribute to its lowest and highest value; if both are
        ints, the attribute must be a whole number
    prefix : text that is put before the names of attributes in errors

    Raises DermisError as `checked_number` does.
    """
    for name, (low, high) in range_of_field.items():
        check = checked_integer if isinstance(low, int) and isinstance(high, int) else checked_number
        check(f"{prefix}{name}", getattr(checked_object, name), low, high)


def _number_in_range(value: object, low: float, high: float) -> int | float | None:
    """Return a value as a Python number, or None if the value is not a number in the range."""
    found: Any = value
    if type(value) not in (int, float):  # plain numbers need no NumPy
        import numpy as np

        found = value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value
    is_number = isinstance(found, int | float) and not isinstance(found, bool)
    return found if is_number and low <= found <= high else None


def _has_text(values: Any, dimension_count: int) -> bool:
    """Return whether nested lists or arrays contain text or booleans, or are nested too deeply.

    NumPy would convert text and booleans to numbers.

    dimension_count : number of dimensions of the expected array, and largest permitted depth of nested lists
    """
    import numpy as np

    if dimension_count and isinstance(values, list | tuple):
        return any(_has_text(value, dimension_count - 1) for value in values)
    return isinstance(values, list | tuple | str | bytes | bool | np.bool_) or (
        isinstance(values, np.ndarray) and values.dtype.kind not in "iuf"
    )


def _refuse_number(
    error_subject: object, number_noun: str, value: object, low: float, high: float, reason: str
) -> NoReturn:
    suffix = f" ({reason})" if reason else ""
    expected = f"{number_noun} from {low:.10g} to {high:.10g}{suffix}"
    refuse(error_subject, expected, f"got {format_value(value)}", "Choose one in this range")
