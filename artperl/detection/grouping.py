"""From votes of pixels for the middles of their objects to objects."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.spatial import cKDTree

Array = NDArray[np.float32]

Places = NDArray[np.float64]

_AGREE = 0.12
"""Of the voter's object's diagonal, within which votes agree."""
_REACH = 0.35
"""Of that diagonal, within which a vote belongs to a middle: middles of two things that touch are farther apart."""
_FEWEST = 8
"""Votes that an object has at least."""
_VOTERS = 3000
"""Votes that are heard, evenly spread over more: middles are as good, and time does not grow with the square."""


def find_middles(votes: Array, sizes: Array, weights: Array) -> Places:
    """Middles that many votes agree on, the strongest first.

    The vote that has the most weight around it begins an object. All votes that belong to it are spent, and the next
    begins. A vote belongs by the size that it tells itself: a thing before a large box is not the box's.

    Parameters
    ----------
    votes : (N, 3) float
    sizes : (N,) float
        Diagonals of their objects, as the voters tell them.
    weights : (N,) float

    Returns
    -------
    (M, 3) float
    """
    found = list[NDArray[np.float64]]()
    if len(votes) >= _FEWEST:
        heard = np.linspace(0, len(votes) - 1, min(len(votes), _VOTERS)).astype(int)
        votes, sizes, weights = votes[heard].astype(np.float64), sizes[heard], weights[heard]
        lists = cKDTree(votes).query_ball_point(votes, _AGREE * sizes)
        ends = np.cumsum([0, *map(len, lists)])
        members = np.concatenate([np.asarray(near, dtype=np.int64) for near in lists])
        near_of = csr_matrix((np.ones(len(members)), members, ends), shape=(len(votes), len(votes)))
        left = np.ones(len(votes), dtype=bool)
        while True:
            support = (near_of @ np.where(left, weights, 0.0)) * left
            best = int(support.argmax())
            near = members[ends[best] : ends[best + 1]]
            near = near[left[near]]
            if len(near) < _FEWEST:
                break
            place = np.average(votes[near], axis=0, weights=weights[near])
            left &= np.linalg.norm(votes - place, axis=1) > _REACH * sizes
            left[best] = False
            found.append(place)
    return np.array(found).reshape(-1, 3)


def assign(votes: Array, sizes: Array, middles: Places) -> NDArray[np.int64]:
    """(N,) which middle each vote belongs to, the nearest; -1 where none is within its reach.

    Parameters
    ----------
    votes : (N, 3) float
    sizes : (N,) float
    middles : (M, 3) float
    """
    if len(middles) == 0:
        return np.full(len(votes), -1)
    distance, nearest = cKDTree(middles).query(votes)
    return np.where(distance <= _REACH * sizes, nearest, -1)
