"""Elementary functions that give the same bits on every processor.

NumPy and the C library choose their sines, logarithms and powers by the processor that they find (AVX2, AVX-512, FMA),
and these differ in the last bit. An object or a sample made with them would have another digest on another machine.
The functions here use only operations that IEEE 754 defines to the last bit: + - * /, square roots, rounding, and the
exponent's bits. A number and an array of it give the same bits too. Results are within 2 units in the last place.

Everything that ends in the bytes of an object or of a dataset uses these, and :mod:`artsim.common.products` in place of
BLAS.
"""

import math
from collections.abc import Callable
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Reals = NDArray[np.floating[Any]]
Number = Any  # a float or an array of them: the series below are the same text for both

_FEW = 16  # so many numbers are faster one by one
_BLOCK = 8192  # numbers worked on at once: what lies between two operations stays in the cache

# pi/2 in three parts. Multiples of the first two, of 33 bits each, are exact up to 2^20.
_HALF_PI = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
_FARTHEST = 2.0**20
_LN2 = (0.6931471803691238, 1.9082149292705877e-10)  # the first of 32 bits
_ROOT_HALF = math.sqrt(0.5)

# Taylor's series, each cut where the rest is below a tenth of the last place within the range it is used in.
_SINE = tuple((-1.0) ** (n // 2) / math.factorial(n) for n in range(17, 2, -2))  # |x| <= pi / 4
_COSINE = tuple((-1.0) ** (n // 2) / math.factorial(n) for n in range(18, 3, -2))  # |x| <= pi / 4
_EXPONENTIAL = tuple(1.0 / math.factorial(n) for n in range(14, 1, -1))  # |x| <= ln(2) / 2
_ARTANH = tuple(2.0 / n for n in range(23, 2, -2))  # |x| <= 3 - 2 sqrt(2)
_ARCTAN = tuple((-1.0) ** (n // 2) / n for n in range(15, 2, -2))  # |x| <= 1 / 16

# Arc tangents of 0, 1/8, ..., 1: the double, and what is left of the true number.
_ARCTAN_EIGHTHS = np.array(
    [
        (0.0, 0.0),
        (0.12435499454676144, -3.1253241424539383e-18),
        (0.24497866312686414, 1.0698755618734451e-17),
        (0.35877067027057225, -2.4623815582638635e-17),
        (0.4636476090008061, 2.2698777452961687e-17),
        (0.5585993153435624, -5.4556305485916264e-18),
        (0.6435011087932844, 1.5834785051444286e-17),
        (0.7188299996216245, -2.1478388444456983e-17),
        (0.7853981633974483, 3.061616997868383e-17),
    ]
)
_PI = (math.pi, 1.2246467991473532e-16)


def _series(coefficients: tuple[float, ...], x: Number) -> Number:
    """Horner's scheme, the highest power's coefficient first; in place where ``x`` is an array."""
    total: Number = coefficients[0]
    if isinstance(x, float):
        for coefficient in coefficients[1:]:
            total = total * x + coefficient
        return total
    total = x * total
    for coefficient in coefficients[1:-1]:
        total += coefficient
        total *= x
    total += coefficients[-1]
    return total


def _apply(of_number: Callable[..., float], of_array: Callable[..., Array], *arguments: Number) -> Number:
    """A function of numbers, or of arrays of one shape: few numbers one by one, many of them block by block."""
    first = arguments[0]
    if isinstance(first, float):
        return of_number(*arguments)
    if first.size <= _FEW:
        return np.array(list(map(of_number, *(a.ravel().tolist() for a in arguments)))).reshape(first.shape)
    if first.size <= _BLOCK:
        return of_array(*arguments)
    flat = [a.ravel() for a in arguments]
    blocks = [of_array(*(a[i : i + _BLOCK] for a in flat)) for i in range(0, first.size, _BLOCK)]
    return np.concatenate(blocks).reshape(first.shape)


def _is_number(x: object) -> bool:
    return isinstance(x, float | int | np.floating | np.integer)


# --- sine, cosine, tangent -------------------------------------------------------------------------------------------


def _less_quarters(x: Number, turns: Number) -> tuple[Number, Number]:
    """Angle less so many quarter turns, in two parts, the second below the last place of the first (Cody and Waite)."""
    first = x - turns * _HALF_PI[0]
    step = turns * _HALF_PI[1]
    second = first - step
    lost = turns * _HALF_PI[2] - ((first - second) - step)
    angle = second - lost
    return angle, (second - angle) - lost


def _sine_of(angle: Number, rest: Number) -> Number:
    square = angle * angle
    cubic = _series(_SINE, square)
    cubic *= square
    cubic *= angle
    return angle + (cubic + rest * (1.0 - 0.5 * square))


def _cosine_of(angle: Number, rest: Number) -> Number:
    square = angle * angle
    half = 0.5 * square
    nearly = 1.0 - half
    quartic = _series(_COSINE, square)
    quartic *= square
    quartic *= square
    return nearly + (((1.0 - nearly) - half) + (quartic - angle * rest))


def _near(x: Number) -> Number:
    """Angles brought within reach of the reduction; NaN where they are not finite."""
    # The remainder is exact; that the double 2 pi is not the true one moves x by less than its own last place.
    if _is_number(x):
        if abs(x) <= _FARTHEST:
            return float(x)
        return math.fmod(x, 2.0 * math.pi) if math.isfinite(x) else math.nan
    x = np.asarray(x, dtype=np.float64)
    far = ~(np.abs(x) <= _FARTHEST)
    if far.any():
        with np.errstate(invalid="ignore"):
            x = np.where(far, np.fmod(x, 2.0 * math.pi), x)
    return x


def _sin_number(x: float, ahead: int = 0) -> float:
    """Sine of an angle, so many quarter turns ahead."""
    if x == 0.0 or math.isnan(x):
        return x + ahead
    turns = round(x * (2.0 / math.pi))
    angle, rest = _less_quarters(x, turns) if turns else (x, 0.0)
    sine: float = _cosine_of(angle, rest) if (turns + ahead) & 1 else _sine_of(angle, rest)
    return -sine if (turns + ahead) & 2 else sine


def _sin_array(x: Array, ahead: int = 0) -> Array:
    turns = np.rint(x * (2.0 / math.pi))
    angle, rest = _less_quarters(x, turns)
    with np.errstate(invalid="ignore"):
        quarter = turns.astype(np.int64) + ahead
    of_even: Array = _sine_of(angle, rest)
    of_odd: Array = _cosine_of(angle, rest)
    sine = np.where((quarter & 1).astype(np.bool_), of_odd, of_even)
    sine *= 1 - (quarter & 2)
    return sine


def _cos_number(x: float) -> float:
    return _sin_number(x, 1)


def _cos_array(x: Array) -> Array:
    return _sin_array(x, 1)


@overload
def sin(x: float) -> float: ...
@overload
def sin(x: Reals) -> Array: ...
def sin(x: Number) -> Number:
    """Sine of angles in radians."""
    return _apply(_sin_number, _sin_array, _near(x))


@overload
def cos(x: float) -> float: ...
@overload
def cos(x: Reals) -> Array: ...
def cos(x: Number) -> Number:
    """Cosine of angles in radians."""
    return _apply(_cos_number, _cos_array, _near(x))


@overload
def tan(x: float) -> float: ...
@overload
def tan(x: Reals) -> Array: ...
def tan(x: Number) -> Number:
    """Tangent of angles in radians."""
    return sin(x) / cos(x)


# --- arc functions ---------------------------------------------------------------------------------------------------


def _arctan_of(low: Number, high: Number, eighth: Number, known: Number, left: Number) -> Number:
    """Arc tangent of ``low / high`` in [0, 1], given that of the nearest eighth."""
    x = (low - eighth * high) / (high + eighth * low)
    square = x * x
    return known + (x + (x * square * _series(_ARCTAN, square) + left))


def _arctan2_number(y: float, x: float) -> float:
    if math.isnan(x) or math.isnan(y):
        return math.nan
    up, across = abs(y), abs(x)
    if math.isinf(up):
        up, across = 1.0, float(math.isinf(across))
    elif math.isinf(across):
        up, across = 0.0, 1.0
    low, high = (across, up) if up > across else (up, across)
    number = round(8.0 * (low / high)) if high > 0.0 else 0
    known, left = _ARCTAN_ROWS[number]
    angle = _arctan_of(low, high if high > 0.0 else 1.0, 0.125 * number, known, left)
    if up > across:
        angle = 0.5 * _PI[0] - (angle - 0.5 * _PI[1])
    if math.copysign(1.0, x) < 0.0:
        angle = _PI[0] - (angle - _PI[1])
    return math.copysign(angle, y)


_ARCTAN_ROWS: list[tuple[float, float]] = [(known, left) for known, left in _ARCTAN_EIGHTHS.tolist()]


def _arctan2_array(y: Array, x: Array) -> Array:
    up, across = np.abs(y), np.abs(x)
    endless = np.isinf(up) | np.isinf(across)
    if endless.any():
        up, across = np.where(endless, np.isinf(up), up), np.where(endless, np.isinf(across), across)
    steep = up > across
    low, high = np.where(steep, across, up), np.where(steep, up, across)
    high = np.where(high > 0.0, high, 1.0)
    with np.errstate(invalid="ignore"):
        number = np.rint(8.0 * (low / high)).astype(np.int64)
    known, left = (column.take(number, mode="clip") for column in _ARCTAN_EIGHTHS.T)  # NaN becomes any number
    angle: Array = _arctan_of(low, high, 0.125 * number, known, left)
    angle = np.where(steep, 0.5 * _PI[0] - (angle - 0.5 * _PI[1]), angle)
    angle = np.where(np.signbit(x), _PI[0] - (angle - _PI[1]), angle)
    angle = np.where(np.isnan(x) | np.isnan(y), np.nan, angle)
    return np.copysign(angle, y)


@overload
def arctan2(y: float, x: float) -> float: ...
@overload
def arctan2(y: Reals, x: Reals | float) -> Array: ...
@overload
def arctan2(y: Reals | float, x: Reals) -> Array: ...
def arctan2(y: Number, x: Number) -> Number:
    """Angle of the direction (x, y) in radians, within [-pi, pi]."""
    if _is_number(y) and _is_number(x):
        return _arctan2_number(float(y), float(x))
    first, second = np.broadcast_arrays(np.asarray(y, dtype=np.float64), np.asarray(x, dtype=np.float64))
    return _apply(_arctan2_number, _arctan2_array, first, second)


@overload
def arctan(x: float) -> float: ...
@overload
def arctan(x: Reals) -> Array: ...
def arctan(x: Number) -> Number:
    """Arc tangent in radians."""
    return arctan2(x, 1.0)


@overload
def arcsin(x: float) -> float: ...
@overload
def arcsin(x: Reals) -> Array: ...
def arcsin(x: Number) -> Number:
    """Arc sine in radians of numbers within [-1, 1]; NaN outside."""
    return arctan2(x, _root((1.0 - x) * (1.0 + x)))


@overload
def arccos(x: float) -> float: ...
@overload
def arccos(x: Reals) -> Array: ...
def arccos(x: Number) -> Number:
    """Arc cosine in radians of numbers within [-1, 1]; NaN outside."""
    return 2.0 * arctan2(_root(1.0 - x), _root(1.0 + x))


def _root(x: Number) -> Number:
    """Square root, NaN below 0; a number's is a number."""
    if _is_number(x):
        return math.sqrt(x) if x >= 0.0 else math.nan
    with np.errstate(invalid="ignore"):
        return np.sqrt(x)


def hypot(x: Number, y: Number) -> Number:
    """Length of (x, y)."""
    return _root(x * x + y * y)


# --- logarithm, exponential, power -----------------------------------------------------------------------------------


def _log_of(mantissa: Number, exponent: Number) -> Number:
    """Logarithm of a mantissa within [sqrt(1/2), sqrt(2)) times a power of two: twice an area tangent."""
    beyond = mantissa - 1.0
    s = beyond / (2.0 + beyond)
    square = s * s
    half = 0.5 * beyond * beyond
    tail = s * (half + square * _series(_ARTANH, square)) + exponent * _LN2[1]
    return exponent * _LN2[0] + (beyond - (half - tail))


def _log_number(x: float) -> float:
    if not 0.0 < x < math.inf:
        return -math.inf if x == 0.0 else (x if x > 0.0 else math.nan)
    mantissa, exponent = math.frexp(x)
    if mantissa < _ROOT_HALF:
        mantissa, exponent = 2.0 * mantissa, exponent - 1
    return float(_log_of(mantissa, float(exponent)))


def _log_array(x: Array) -> Array:
    inside = (x > 0.0) & (x < np.inf)
    usual = inside.all()
    mantissa, exponent = np.frexp(x if usual else np.where(inside, x, 1.0))
    small = (mantissa < _ROOT_HALF).astype(np.float64)
    result: Array = _log_of(mantissa * (1.0 + small), exponent - small)
    return result if usual else np.where(inside, result, np.where(x == 0.0, -np.inf, np.where(x > 0.0, x, np.nan)))


@overload
def log(x: float) -> float: ...
@overload
def log(x: Reals) -> Array: ...
def log(x: Number) -> Number:
    """Natural logarithm: -inf of 0, NaN below."""
    return _apply(_log_number, _log_array, float(x) if _is_number(x) else np.asarray(x, dtype=np.float64))


def _exp_of(x: Number, twos: Number) -> Number:
    """Exponential of ``x - twos * ln(2)``, which lies within half of ln(2) around 0."""
    high, low = x - twos * _LN2[0], twos * _LN2[1]
    reduced = high - low
    rest = (high - reduced) - low
    return 1.0 + (reduced + (reduced * reduced * _series(_EXPONENTIAL, reduced) + rest))


def _exp_number(x: float) -> float:
    if not -750.0 < x < 709.78:
        return math.nan if math.isnan(x) else (0.0 if x < 0.0 else math.inf)
    twos = round(x * (1.0 / _LN2[0]))
    return math.ldexp(_exp_of(x, float(twos)), twos)


def _exp_array(x: Array) -> Array:
    inside = np.clip(x, -750.0, 709.78)
    twos = np.rint(inside * (1.0 / _LN2[0]))
    with np.errstate(invalid="ignore", over="ignore"):
        result: Array = np.ldexp(_exp_of(inside, twos), twos.astype(np.int64))
    return np.where(x >= 709.78, np.inf, np.where(x <= -750.0, 0.0, result))


@overload
def exp(x: float) -> float: ...
@overload
def exp(x: Reals) -> Array: ...
def exp(x: Number) -> Number:
    """Exponential: infinite from 709.78 on."""
    return _apply(_exp_number, _exp_array, float(x) if _is_number(x) else np.asarray(x, dtype=np.float64))


@overload
def power(base: float, exponent: float) -> float: ...
@overload
def power(base: Reals, exponent: float) -> Array: ...
def power(base: Number, exponent: float) -> Number:
    r"""Positive power of numbers of at least 0, wrong by up to 1 + \|exponent log(base)\| units in the last place."""
    return exp(exponent * log(base))
