"""Steps of learning: their rate, and how they are stopped."""

from __future__ import annotations

import signal
import threading
from math import cos, pi

import torch

_WARM_UP = 0.1
_LAST_RATE = 0.01


class Stop:
    """Ctrl-C as a wish, so that no step is left half done."""

    def __init__(self) -> None:
        self.asked = False

    def __enter__(self) -> Stop:
        self._before = signal.signal(signal.SIGINT, self._ask) if self._in_charge() else None
        return self

    def __exit__(self, *_: object) -> None:
        if self._in_charge():
            signal.signal(signal.SIGINT, self._before)

    def _ask(self, *_: object) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def _in_charge(self) -> bool:
        """Only the main thread hears signals."""
        return threading.current_thread() is threading.main_thread()


def one_cycle(step: int, total: int) -> float:
    """Share of the highest learning rate: a linear rise, then half a cosine down to a hundredth (Smith 2018)."""
    rise = max(1.0, _WARM_UP * total)
    if step < rise:
        return (step + 1) / rise if rise > step + 1 else 1.0
    return _LAST_RATE + 0.5 * (1.0 - _LAST_RATE) * (1.0 + cos(pi * (step - rise) / max(1.0, total - rise)))


def set_rate(optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Use a learning rate from now on."""
    for group in optimizer.param_groups:
        group["lr"] = rate
