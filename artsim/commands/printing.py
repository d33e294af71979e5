"""What verbs print of long runs."""

import contextlib
from collections.abc import Iterator, Sequence

_LISTED = 50
"""Lines of a list before the rest is only counted."""


@contextlib.contextmanager
def resumable(kept: str, place: object) -> Iterator[None]:
    """Say what is kept of a run that Ctrl-C stops."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{kept} in {place}: rerun the command to resume") from None


def print_made(place: object, whole: str, made: int, unit: str, seconds: float) -> None:
    """Say what a run has come to."""
    now = f"{made} {unit} made now, {made / seconds:.3g} {unit}/s"
    print(f"{place}: {whole}, {now}" if made else f"{place}: already complete, {whole}")


def print_some(lines: Sequence[object]) -> None:
    """Print the first lines of a list, and how many more there are."""
    for line in lines[:_LISTED]:
        print(line)
    if len(lines) > _LISTED:
        print(f"... and {len(lines) - _LISTED} more")
