"""Values of USD attributes, of the type that their schema gives them: a file may write any."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.errors import AssetError
from artsim.loading.mesh_files.surface import quote_name
from artsim.model.kinematics import Array
from artsim.model.transforms import rotation_of_quaternion


def number(attribute: Any, default: float) -> float:
    """The number that an attribute holds, which may be infinite; the default where it is not there, or has no value.

    Raises
    ------
    AssetError
        When it holds anything else. So do the other functions.
    """
    found = _value(attribute)
    if found is None:
        return default
    if isinstance(found, bool) or not isinstance(found, (int, float)) or np.isnan(found):
        raise _error(attribute, found, "a number")
    return float(found)


def flag(attribute: Any, default: bool) -> bool:
    """Whether an attribute is true."""
    found = _value(attribute)
    if found is None:
        return default
    if not isinstance(found, (bool, int)):
        raise _error(attribute, found, "true or false")
    return bool(found)


def token(attribute: Any, default: str, known: tuple[str, ...] = ()) -> str:
    """The word that an attribute holds: one of those that are known, if any are named."""
    found = _value(attribute)
    if found is None:
        return default
    if not isinstance(found, str) or (known and found not in known):
        raise _error(attribute, found, f"one of {', '.join(known)}" if known else "a word")
    return found


def vectors(attribute: Any) -> Array:
    """(N, 3) float: the vectors of an array, or the one vector of an attribute; none where it has no value."""
    return _converted(attribute, "vectors", lambda v: np.asarray(v, dtype=np.float64).reshape(-1, 3))


def numbers(attribute: Any) -> Array:
    """(N,) numbers of an array; none where it has no value."""
    return _converted(attribute, "numbers", lambda v: np.asarray(v, dtype=np.float64).ravel())


def integers(attribute: Any) -> NDArray[np.int64]:
    """(N,) whole numbers of an array; none where it has no value."""
    return _converted(attribute, "whole numbers", lambda v: np.asarray(v).astype(np.int64, casting="safe").ravel())


def rotation(attribute: Any) -> Array:
    """(3, 3) rotation of a quaternion of any length; the identity where there is none, or it has no length."""
    found = _value(attribute)
    if found is None:
        return np.eye(3)
    try:
        values = np.array([*found.GetImaginary(), found.GetReal()], dtype=np.float64)
    except (AttributeError, TypeError, ValueError) as error:
        raise _error(attribute, found, "a quaternion") from error
    length = float(np.linalg.norm(values))
    return rotation_of_quaternion(values / length) if np.isfinite(length) and length > 1e-6 else np.eye(3)


def _converted(attribute: Any, wanted: str, convert: Callable[[Any], NDArray[Any]]) -> NDArray[Any]:
    found = _value(attribute)
    try:
        return convert(np.zeros(0, np.int8) if found is None else found)
    except (TypeError, ValueError) as error:
        raise _error(attribute, found, wanted) from error


def _value(attribute: Any) -> Any:
    return attribute.Get() if attribute else None


def _error(attribute: Any, found: Any, wanted: str) -> AssetError:
    return AssetError(
        f"{attribute.GetName()} is {quote_name(str(found))}, which is not {wanted}",
        f"prim {attribute.GetPrim().GetPath()}",
        "write a value of the type that its schema says",
    )
