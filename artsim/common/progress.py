"""Progress of long work: a bar where somebody watches, a line now and then where a log is kept."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sized
from time import monotonic
from types import TracebackType
from typing import Any, TypeAlias

from tqdm import tqdm

from artsim.common.messages import messages_shown, note

FIRST, EVERY = 10.0, 60.0
"""Seconds until the first line of a log, so that nobody takes the work for stuck; and between two lines."""


class Lines:
    """What is used here of a tqdm bar, for a log: a line after ten seconds, then one a minute, on standard error."""

    def __init__(self, description: str, items: Iterable[Any] | None, total: int | None, initial: int, unit: str):
        self.n: float = initial
        self._items, self._postfix = items, ""
        self._said: float = initial
        self._start = monotonic()
        self._next = self._start + FIRST
        self._shape = {"total": total, "initial": initial, "prefix": description, "unit": unit, "ncols": 0}

    def __iter__(self) -> Iterator[Any]:
        for item in self._items or ():
            yield item
            self.update()
        self.close()

    def __enter__(self) -> Lines:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def set_postfix_str(self, text: str) -> None:
        """What the next line ends with."""
        self._postfix = text

    def update(self, n: float = 1) -> None:
        """So much more is done."""
        self.n += n
        if monotonic() >= self._next:
            self._say()

    def close(self) -> None:
        """Say how far it came, if lines were said before."""
        if self._next > self._start + FIRST and self.n != self._said:
            self._say()

    def _say(self) -> None:
        elapsed = monotonic() - self._start
        self._next, self._said = self._start + elapsed + EVERY, self.n
        line = tqdm.format_meter(n=self.n, elapsed=elapsed, postfix=self._postfix or None, **self._shape)
        note(line.strip())


Progress: TypeAlias = "tqdm[Any] | Lines"


def track(
    description: str, items: Iterable[Any] | None = None, *, total: int | None = None, initial: int = 0,
    unit: str = "it", smoothing: float = 0.3, leave: bool = True, shown: bool = True,
) -> Progress:  # fmt: skip
    """A bar on a terminal and in a notebook, lines elsewhere and in JSON; nothing with ``--quiet``.

    Parameters
    ----------
    description : str
        What is done.
    items : iterable, optional
        What to go through; without, ``update`` says how much is done.
    total, initial : int
        How much there is to do, by default the number of items; how much was done before.
    unit : str
        What is counted.
    smoothing : float
        Of the rate on a bar: 0 is the mean so far, 1 that of the last step.
    leave : bool
        Whether a bar stays when all is done.
    shown : bool
        False says nothing anywhere.
    """
    messages = messages_shown()
    shown = shown and not (messages and messages.quiet)
    if shown and ((messages and messages.log_json) or not (sys.stderr.isatty() or "ipykernel" in sys.modules)):
        if total is None and isinstance(items, Sized):
            total = len(items)
        return Lines(description, items, total, initial, unit)
    return tqdm(
        items, description, total, initial=initial, unit=unit, smoothing=smoothing, leave=leave, disable=not shown
    )


def say(text: str) -> None:
    """Print a result at once, above the bars that there are."""
    tqdm.write(text)
    sys.stdout.flush()
