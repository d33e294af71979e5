"""Loops that numba compiles: the one place that decides how.

A function is compiled when it is first called, and the machine code is kept on the disk, so that only the first process
on a machine compiles. Nothing here imports numba before that call.

Functions that call one another belong in one file: numba's cache notices changes of the file of the function that was
called, not of others.
"""

import functools
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from typing_extensions import ParamSpec

from artsim.common.messages import note

P = ParamSpec("P")
R = TypeVar("R")

_MATHS = {"contract", "reassoc", "nsz"}
"""Liberties that do not touch infinities and NaN: sums in any order, and fused products, so that loops use wide
registers."""


@functools.cache
def _say_compiling() -> None:
    """Have standard error told, once in a process, that loops are compiled; none are where the disk has them."""
    from numba.core import event

    class Said(event.Listener):
        said = False

        def on_start(self, event: Any) -> None:
            if not self.said:
                note("artsim compiles its loops for this processor: some seconds, once")
            self.said = True

        def on_end(self, event: Any) -> None: ...

    event.register("numba:compile", Said())


class Compiled(Generic[P, R]):
    """A function that numba compiles once it is called, without Python's lock.

    Parameters
    ----------
    function : callable
        Loops over NumPy arrays and numbers; it may call other compiled functions of its module.
    exact : bool
        Whether every operation is rounded as IEEE 754 says, in the order in which it stands: the same bytes as in
        Python, on every processor.

    Attributes
    ----------
    python : callable
        The function as it is written, for tests.
    """

    def __init__(self, function: Callable[P, R], exact: bool = False):
        self.python, self._exact = function, exact
        self.__doc__, self.__name__, self.__module__ = function.__doc__, function.__name__, function.__module__
        self._dispatcher: Any = None
        self._called = False

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        if self._called:
            result: R = self._dispatcher(*args, **kwargs)
            return result
        self._called = True
        result = self._prepare()(*args, **kwargs)
        return result

    def _prepare(self) -> Any:
        """Numba's own function, which others of the module then call by the same name."""
        if self._dispatcher is None:
            import numba

            _say_compiling()

            how: dict[str, Any] = {"nogil": True, "fastmath": not self._exact and _MATHS, "error_model": "numpy"}
            try:
                self._dispatcher = numba.njit(cache=True, **how)(self.python)
            except RuntimeError:  # no folder can be written to
                self._dispatcher = numba.njit(**how)(self.python)
            known = self.python.__globals__
            for name, value in list(known.items()):
                if isinstance(value, Compiled):
                    known[name] = value._prepare()
        return self._dispatcher


def compiled(function: Callable[P, R]) -> Compiled[P, R]:
    """Decorate a function to be compiled: see :class:`Compiled`."""
    return Compiled(function)


def compiled_exactly(function: Callable[P, R]) -> Compiled[P, R]:
    """Decorate a function to be compiled without liberties: see :class:`Compiled`."""
    return Compiled(function, exact=True)
