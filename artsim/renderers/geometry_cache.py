"""What renderers that load geometry keep loaded: the latest few objects and scenes."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, Protocol, TypeVar

MAX_FACES = 1_500_000
"""Triangles kept loaded."""


class LoadedGeometry(Protocol):
    """Geometry that a backend holds."""

    num_faces: int

    def close(self) -> None:
        """Let go of it."""
        ...


L = TypeVar("L", bound=LoadedGeometry)


class GeometryCache(Generic[L]):
    """Loaded geometry by key; the least recently used is dropped.

    Parameters
    ----------
    most : int
        How many are kept at once.
    """

    def __init__(self, most: int):
        self._most = most
        self._loaded: OrderedDict[Hashable, L] = OrderedDict()

    def __len__(self) -> int:
        return len(self._loaded)

    def get(self, key: Hashable, num_faces: int, load: Callable[[], L]) -> L:
        """What was loaded under this key; if nothing was, room is made for its triangles first, and it is loaded."""
        if key in self._loaded:
            self._loaded.move_to_end(key)
            return self._loaded[key]
        while self._loaded and (len(self) >= self._most or self._num_faces() + num_faces > MAX_FACES):
            self._loaded.popitem(last=False)[1].close()
        loaded = self._loaded[key] = load()
        return loaded

    def _num_faces(self) -> int:
        return sum(loaded.num_faces for loaded in self._loaded.values())

    def close(self) -> None:
        """Drop everything."""
        while self._loaded:
            self._loaded.popitem()[1].close()
