"""Objects of a dataset in memory, the last ones used."""

from collections import OrderedDict
from typing import Any

from artsim.common.array_files import MAX_ARRAY_BYTES
from artsim.model.object_file import parse_object
from artsim.model.objects import ArticulatedObject
from artsim.runs.storage import Place, storage_of

_CACHE_BYTES = 250_000_000


class ObjectCache:
    """Compiled objects by the names of their files, the least recently used dropped once they take too much memory.

    Parameters
    ----------
    place : path, str or Storage
        Folder or URL.
    max_bytes : int
        Of memory.
    """

    def __init__(self, place: Place, max_bytes: int = _CACHE_BYTES):
        self.storage, self.max_bytes = storage_of(place), max_bytes
        self._objects: OrderedDict[str, ArticulatedObject] = OrderedDict()

    def __reduce__(self) -> tuple[Any, ...]:
        return ObjectCache, (self.storage, self.max_bytes)

    def __getitem__(self, name: str) -> ArticulatedObject:
        obj = self._objects.get(name)
        if obj is None:
            where = f"{self.storage.place}/{name}"
            obj = self._objects[name] = parse_object(self.storage.read(name, MAX_ARRAY_BYTES), where)
            while len(self._objects) > 1 and sum(map(_memory, self._objects.values())) > self.max_bytes:
                self._objects.popitem(last=False)
        self._objects.move_to_end(name)
        return obj


def _memory(obj: ArticulatedObject) -> int:
    """Bytes that an object takes with its acceleration structures (measured: about 180 for each triangle)."""
    return 40_000 + 180 * obj.num_faces
