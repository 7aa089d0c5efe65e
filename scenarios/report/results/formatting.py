"""Numbers as a reader wants them: the digits that mean something, a real minus sign, thin spaces."""

import math

_MINUS, _THIN = "\N{MINUS SIGN}", "\N{NARROW NO-BREAK SPACE}"
_SCALED = {"m": (1e3, "mm"), "rad": (1e3, "mrad"), "s": (1e3, "ms")}


def fixed(x: float | None, digits: int) -> str:
    """A number with so many decimals, zero without a sign; a dash where there is none."""
    if x is None or not math.isfinite(x):
        return "–"
    return f"{x:z,.{digits}f}".replace("-", _MINUS).replace(",", _THIN)


def significant(x: float | None, digits: int = 3) -> str:
    """A number with so many significant digits, without an exponent between 1e-4 and 1e6."""
    if x is None or not math.isfinite(x):
        return "–"
    if x == 0.0:
        return "0"
    power = math.floor(math.log10(abs(float(f"{x:.{digits - 1}e}"))))
    if not -5 < power < 6:
        mantissa, exponent = f"{x:.{digits - 1}e}".split("e")
        return f"{mantissa}e{int(exponent)}".replace("-", _MINUS)
    return fixed(x, max(0, digits - 1 - power))


def error(x: float | None) -> str:
    """An error with three significant digits, of them at most two decimals."""
    if x is None or not math.isfinite(x):
        return "–"
    return significant(x) if abs(x) >= 1.0 else fixed(x, 2)


def cell(x: float | None) -> str:
    """An error in a table: two decimals, three where two would say next to nothing."""
    return fixed(x, 3 if x is not None and 0.0 < abs(x) < 0.095 else 2)


def count(n: int) -> str:
    """A whole number, thousands apart."""
    return f"{n:,}".replace(",", _THIN)


def decimals(sigma: float | None) -> int:
    """Decimals that show two significant digits of a standard deviation, at most 6."""
    if sigma is None or sigma <= 0.0 or not math.isfinite(sigma):
        return 3
    return min(6, max(0, 1 - math.floor(math.log10(float(f"{sigma:.1e}")))))


def readable(name: str, unit: str) -> tuple[float, str]:
    """Factor and unit in which a parameter is easy to read."""
    if unit == "-" and name.startswith("clock."):
        return 1e6, "ppm"
    return _SCALED.get(unit, (1.0, unit))
