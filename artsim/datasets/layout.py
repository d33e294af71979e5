"""In which order the samples of a split lie on disk: close together where they show the same object.

Objects take turns, so that each has been shown equally often at any time, give or take once. To load an object costs as
much as dozens of samples of it, so on disk a few objects have several turns in a row, then the next few. That happens
within laps of a fixed number of turns each: what a finished lap holds does not depend on the size of the dataset.
"""

_OBJECTS_AT_ONCE = 16
"""A worker keeps so many objects in memory, and every shard mixes so many."""

_LAP = 16
"""Turns of each object in a lap."""

_SHORT_LAP = 8
"""The same of the first turns: once each object has 8 views, a dataset that grows keeps at least half of it."""


def at_place(place: int, objects: int, rounds: int | None = None) -> tuple[int, int]:
    """What lies at a place of a split.

    Parameters
    ----------
    place : int
    objects : int
        How many the split has.
    rounds : int, optional
        How often each object is shown, at least; a few may be shown once more, which lie last. Endless by default.

    Returns
    -------
    round : int
        How often the object has been shown before.
    turn : int
        Number of the object within its split.
    """
    if rounds is not None and place >= rounds * objects:
        return rounds, place - rounds * objects
    lap = _SHORT_LAP if place // objects < _LAP else _LAP
    first = place // objects // lap * lap
    end = first + lap if rounds is None else min(first + lap, rounds)
    in_a_row, left = end - first, place - first * objects
    few = left // (_OBJECTS_AT_ONCE * in_a_row) * _OBJECTS_AT_ONCE
    turn, object_of_few = divmod(left - few * in_a_row, min(_OBJECTS_AT_ONCE, objects - few))
    return first + turn, few + object_of_few
