"""Estimates of many clouds, in several processes."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from numpy.typing import ArrayLike

from artperl.core.estimate import Estimate
from artperl.methods.protocol import Method
from artsim.errors import ArtsimError
from artsim.runs.each import each

UNEXPECTED = (ArithmeticError, IndexError, RuntimeError, ValueError)
"""What a strange cloud may raise that no check has caught: one of a thousand must not lose the others."""


def estimate_many(
    method: Method, clouds: Iterable[ArrayLike], workers: int = 1
) -> Iterator[Estimate | ArtsimError]:  # fmt: skip
    """Estimates of clouds in their order: the same as one by one, whatever the number of processes.

    Parameters
    ----------
    method : Method
    clouds : iterable of (N, 3) float
        Camera frame, metres. They are taken as they are needed.
    workers : int
        Processes. An estimate takes one core.

    Yields
    ------
    Estimate, or ArtsimError where a cloud has none
        The error says why.
    """
    return each(_Estimating(method), clouds, workers)


@dataclass(frozen=True)
class _Estimating:
    """Makes the function of each process; an estimator is pickled with it."""

    method: Method

    def __call__(self) -> Callable[[ArrayLike], Estimate | ArtsimError]:
        return self._estimate

    def _estimate(self, points: ArrayLike) -> Estimate | ArtsimError:
        try:
            return self.method(points)
        except ArtsimError as error:
            return error
        except UNEXPECTED as error:
            return ArtsimError(f"no estimate ({type(error).__name__}: {error})", "points")
