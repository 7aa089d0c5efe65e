"""Frozen dataclasses of numbers and arrays as plain JSON values, and back by their type hints.

Arrays are nested lists, NaN is null; their shapes are those that the class's documentation states: `(n, 3)` has two
axes, the second one 3 long. A class needs no code of its own to stand in estimate.json.
"""

import re
from dataclasses import MISSING, fields, is_dataclass
from types import UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from calibration.errors import InputError, ShapeError

T = TypeVar("T")

_STATED = re.compile(r"^ +(\w+): (?:\w{1,8} )?\((\w+,[\w, ]*)\)", re.MULTILINE)  # attribute, its axes


def plain(value: Any) -> Any:
    """A value as JSON holds it.

    Raises:
        TypeError: It is of a kind that has no plain form.
    """
    if value is None or isinstance(value, (bool, int, str)):
        return value
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (tuple, list)):
        return [plain(x) for x in value]
    if is_dataclass(value):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    raise TypeError(f"{type(value).__name__} has no plain form")


def restored(kind: type[T], value: Any, at: str = "") -> T:
    """A value of a kind from its plain form.

    Raises:
        InputError: A field is missing or of another kind; `at` is where.
    """
    try:
        return _restored(kind, value)
    except (KeyError, TypeError, ValueError, AttributeError, ShapeError) as error:
        raise InputError(at, f"its values do not fit a {getattr(kind, '__name__', kind)}: {error!r}") from error


def _restored(kind: Any, value: Any) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if kind is np.ndarray:
        return _numbers(value)
    if kind is float:
        return float(_numbers(value))
    if origin in (Union, UnionType):
        return None if value is None else _restored(next(a for a in arguments if a is not type(None)), value)
    if isinstance(kind, type) and issubclass(kind, tuple):
        return kind(*value)
    if origin is tuple:
        kinds = [arguments[0]] * len(value) if arguments[-1:] == (Ellipsis,) else arguments
        return tuple(_restored(k, x) for k, x in zip(kinds, value, strict=True))
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        given = [f.name for f in fields(kind) if f.name in value or f.default is f.default_factory is MISSING]
        known = {name: None for name in given if type(None) in get_args(hints[name])} | value
        found = {name: _restored(hints[name], known[name]) for name in given}
        _check_shapes(kind, found)
        return kind(**found)  # type: ignore[operator]
    if origin is Literal and value not in arguments:
        raise ValueError(f"{value!r} is none of {arguments}")
    if kind in (str, int) and not isinstance(value, kind):
        raise TypeError(f"{value!r} is no {kind.__name__}")
    return value


def _check_shapes(kind: Any, found: dict[str, Any]) -> None:
    """See that arrays have the axes their documentation states; a letter is the same number in all of a class."""
    known: dict[str, int] = {}
    for name, axes in _STATED.findall(kind.__doc__ or ""):
        if isinstance(array := found.get(name), np.ndarray):
            stated = [axis for axis in re.split(", *", axes) if axis]
            sizes = [
                int(n) if n.isdigit() else known.setdefault(n, m) for n, m in zip(stated, array.shape, strict=False)
            ]
            if array.shape != tuple(sizes) or array.ndim != len(stated):
                raise ShapeError(name, array.shape, stated)


def _numbers(value: Any) -> np.ndarray:
    found = np.array(_with_nan(value), dtype=float)
    if np.isinf(found).any():
        raise ValueError("an infinite number")
    return found


def _with_nan(value: Any) -> Any:
    return [_with_nan(x) for x in value] if isinstance(value, list) else np.nan if value is None else value
