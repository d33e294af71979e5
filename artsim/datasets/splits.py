"""Which objects are trained on and which are tested with, what they are called, and in which order they are shown."""

import hashlib
import re
from collections import Counter, defaultdict
from collections.abc import Sequence

import numpy as np

from artsim.errors import ConfigError

SPLITS = ("train", "val", "test")


def assign_splits(objects: Sequence[tuple[str, str]], fractions: tuple[float, float, float], seed: int) -> list[str]:
    """Split of each object: by object, never by view, stratified by category.

    Objects of one identity always share a split, whatever they and their categories are called. Each category has at
    least one object in train, unless its share is 0.

    Parameters
    ----------
    objects : sequence of (category, identity)
        The identity is the digest of what an object is named by: category and seed of a procedural one, the bytes of
        the files of a loaded one. It never depends on geometry, whose last bits differ between processors.
    fractions : 3 float
        Shares of train, val and test; their sum is taken as 1.
    seed : int
    """
    check_shares(fractions)
    category_of: dict[str, str] = {}
    for category, identity in objects:
        category_of[identity] = min(category, category_of.get(identity, category))
    members: dict[str, list[str]] = defaultdict(list)
    for identity, category in category_of.items():
        members[category].append(identity)
    shares = np.cumsum(fractions) / sum(fractions)
    split_of: dict[str, str] = {}
    for identities in members.values():
        order = sorted(identities, key=lambda d: hashlib.sha256(f"{seed}:{d}".encode()).hexdigest())
        ends = np.floor(shares * len(order) + 0.5)
        if fractions[0] > 0:
            ends = np.maximum(ends, 1)  # a category of one object can at least be trained on
        for place, identity in enumerate(order):
            split_of[identity] = SPLITS[int(np.searchsorted(ends, place, side="right"))]
    return [split_of[identity] for _, identity in objects]


def check_shares(fractions: tuple[float, float, float]) -> None:
    """Refuse shares of train, val and test that make no sense.

    Raises
    ------
    ConfigError
    """
    if not np.isfinite(fractions).all() or min(fractions) < 0 or sum(fractions) <= 0:
        raise ConfigError(f"{tuple(fractions)} are not shares", "splits", "write three numbers such as 0.8 0.1 0.1")


def unique_keys(objects: Sequence[tuple[str, str, str]]) -> list[str]:
    """A file-safe unique key for each (category, object_id, identity), also where file names ignore case."""
    names = [re.sub(r"[^A-Za-z0-9_-]+", "_", f"{category}-{object_id}")[:100] for category, object_id, _ in objects]
    count = Counter(name.lower() for name in names)
    return [
        f"{name}-{hashlib.sha256(repr(obj).encode()).hexdigest()[:12]}" if count[name.lower()] > 1 else name
        for name, obj in zip(names, objects, strict=True)
    ]


def showing_order(objects: Sequence[tuple[str, str]]) -> list[int]:
    """Order in which objects take turns: the first few are of every category and split, each by its share.

    Parameters
    ----------
    objects : sequence of (category, split)

    Returns
    -------
    list of int
        Each number once.
    """
    total, seen = Counter(objects), Counter[tuple[str, str]]()
    ranks: list[tuple[float, int, int, int]] = []
    categories = list(dict.fromkeys(category for category, _ in objects))
    for number, (category, split) in enumerate(objects):
        # The members of a stratum are spread evenly over the whole order.
        ranks.append(
            (
                (seen[category, split] + 0.5) / total[category, split],
                categories.index(category),
                SPLITS.index(split),
                number,
            )
        )
        seen[category, split] += 1
    return [rank[-1] for rank in sorted(ranks)]
