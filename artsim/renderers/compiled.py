"""When loops around the rays are compiled: once a process has made so many clouds that it pays.

numba compiles them for the processor at hand, and keeps the result beside the module: seconds the first time on a
machine, some tenths from then on. A process that makes a few clouds never imports it. The bytes of a cloud are the same
either way, with numba and without.
"""

from __future__ import annotations

import contextlib
import importlib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from artsim.common.compiled import said_if_slow

_KERNELS = "artsim.renderers.ray_kernels"
_PAYS, _PAYS_UNCACHED = 400, 6000
"""Clouds after which kernels pay: each saves about a millisecond. To load them takes 0.4 s, to compile them 6 s."""


class _Switch:
    """The kernels of this process, once there are any."""

    kernels: ModuleType | None = None
    clouds = 0
    pays: float | None = None


def kernels() -> ModuleType | None:
    """The compiled loops; None as long as NumPy's are to be used."""
    return _Switch.kernels


def count_cloud() -> None:
    """One more cloud is being made: kernels are loaded when they pay."""
    if _Switch.kernels is not None:
        return
    if _Switch.pays is None:
        _Switch.pays = _threshold()
    _Switch.clouds += 1
    if _Switch.clouds > _Switch.pays:
        compile_now()


def compile_now() -> bool:
    """Load the kernels, or compile them; False where that is not possible, and NumPy goes on."""
    _Switch.pays = float("inf")  # one attempt
    try:
        with said_if_slow():
            loaded = importlib.import_module(_KERNELS)
            loaded.warm_up()
    except Exception:  # numba is missing, or does not fit this NumPy or this processor: all work without it
        return False
    _Switch.kernels = loaded
    return True


def _threshold() -> float:
    if find_spec("numba") is None:
        return float("inf")
    return _PAYS if _is_cached() else _PAYS_UNCACHED


def _is_cached() -> bool:
    # numba may keep them elsewhere, where this folder cannot be written to: then they are loaded later than they could.
    return any((Path(__file__).parent / "__pycache__").glob("ray_kernels.*.nbi"))


@contextlib.contextmanager
def use(compiled: bool) -> Iterator[bool]:
    """Use the compiled loops, or NumPy's, whatever was used before; False where there are none."""
    before = _Switch.kernels, _Switch.pays
    try:
        if compiled and _Switch.kernels is None:
            compile_now()
        if not compiled:
            _Switch.kernels, _Switch.pays = None, float("inf")
        yield _Switch.kernels is not None
    finally:
        _Switch.kernels, _Switch.pays = before
