"""What verbs say of long runs."""

import logging
from collections.abc import Callable, Sequence

log = logging.getLogger(__name__)

_LISTED = 50
"""Lines of a list before the rest is only counted."""


def log_made(place: object, whole: str, made: int, unit: str, seconds: float) -> None:
    """Say what a run has come to."""
    now = f"{made} {unit} made now, {made / seconds:.3g} {unit}/s"
    log.info(f"{place}: {whole}, {now}" if made else f"{place}: already complete, {whole}")


def say_some(lines: Sequence[object], say: Callable[[str], None]) -> None:
    """Say the first lines of a list, and how many more there are."""
    for line in lines[:_LISTED]:
        say(str(line))
    if len(lines) > _LISTED:
        say(f"... and {len(lines) - _LISTED} more")
