"""What renderers keep loaded stays within bounds, and what was used last stays longest."""

from __future__ import annotations

from dataclasses import dataclass, field

from artsim.renderers.geometry_cache import MAX_FACES, GeometryCache


@dataclass
class Geometry:
    num_faces: int
    closed: list[int] = field(default_factory=list)

    def close(self) -> None:
        self.closed.append(self.num_faces)


def test_the_least_recently_used_is_dropped_before_another_is_loaded() -> None:
    closed: list[int] = []
    kept: GeometryCache[Geometry] = GeometryCache(2)

    def use(faces: int) -> list[int]:
        """Loads, and the geometry that was let go before it had loaded."""
        before: list[int] = []
        kept.get(faces, faces, lambda: before.extend([faces, *closed]) or Geometry(faces, closed))
        return before

    assert use(1) == [1]
    assert use(2) == [2]
    assert use(1) == []  # still there, and now the latest
    assert use(3) == [3, 2]
    assert use(1) == []
    assert use(2) == [2, 2, 3]
    assert len(kept) == 2
    kept.close()
    assert len(kept) == 0
    assert sorted(closed) == [1, 2, 2, 3]


def test_triangles_are_bounded_but_one_large_object_is_loaded_all_the_same() -> None:
    closed: list[int] = []
    kept: GeometryCache[Geometry] = GeometryCache(100)
    for key, faces in enumerate((MAX_FACES // 2, MAX_FACES // 2, 10)):
        kept.get(key, faces, lambda faces=faces: Geometry(faces, closed))
    assert closed == [MAX_FACES // 2]
    kept.get("large", 2 * MAX_FACES, lambda: Geometry(2 * MAX_FACES, closed))
    assert len(kept) == 1
