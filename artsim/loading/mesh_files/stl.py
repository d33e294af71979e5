"""STL: triangles, in bytes or in text."""

import re

import numpy as np

from artsim.loading.mesh_files.polygons import triangulate
from artsim.loading.mesh_files.surface import Bounds, Draft, Surface, UnusableMeshError
from artsim.loading.mesh_files.text import Rows, first_numbers, plain_text, substitute

_HEADER = 84
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_UNKNOWN_COUNTS = (0, 2**32 - 1)
"""What programs write that do not know yet how many triangles will follow."""

_WORDS = (b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid")


def read_stl(data: bytes, bounds: Bounds) -> Surface:
    """The surface of an STL file; raises as ``read_mesh``."""
    count = int.from_bytes(data[80:_HEADER], "little") if len(data) >= _HEADER else None
    # Bytes may begin with "solid" too, so their number decides.
    if count is not None and len(data) == _HEADER + _TRIANGLE.itemsize * count:
        return _read_bytes(data, count, bounds)
    start = data[:1000].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    if (start.startswith((b"solid", b"facet"))) and (b"facet" in data or b"FACET" in data.upper()):
        return _read_text(data, bounds)
    if count is None:
        raise UnusableMeshError("is shorter than the header of an STL file")
    return _read_bytes(data, count, bounds)


def _read_bytes(data: bytes, count: int, bounds: Bounds) -> Surface:
    draft = Draft()
    room, over = divmod(len(data) - _HEADER, _TRIANGLE.itemsize)
    if count in _UNKNOWN_COUNTS and room and not over:
        draft.note(f"does not say how many triangles it holds: all {room} are taken")
        count = room
    if count > room:
        raise UnusableMeshError(f"declares {count} triangles, but ends after {room}")
    bounds.check(count, "triangles")
    if room > count or over:
        draft.note(f"has {len(data) - _HEADER - _TRIANGLE.itemsize * count} bytes after its {count} triangles")
    vertices = np.frombuffer(data, _TRIANGLE, count, _HEADER)["vertices"].reshape(-1, 3).astype(np.float64)
    draft.add(vertices, np.arange(3 * count).reshape(-1, 3))
    draft.declared = draft.accounted = count
    return draft.surface()


def _read_text(data: bytes, bounds: Bounds) -> Surface:
    text = plain_text(data).lower()
    draft = Draft(declared=_declaration(data))
    rows = Rows(text)
    if rows.which(b"vertex").sum() != text.count(b"vertex"):
        # Any word may be the name of a solid.
        rows = Rows(substitute(rb"(?m)^((?:end)?solid)[^\n]*", rb"\1", text))
    found = int(rows.which(b"vertex").sum())
    if found == 0 or found != rows.data.count(b"vertex"):
        # Blanks are as good as newlines.
        rows = Rows(re.sub(rb"\s+(?=(?:" + b"|".join(_WORDS) + rb")\b)", b"\n", text))
    corners, closed = rows.which(b"vertex"), rows.which(b"endloop")
    bounds.check(int(closed.sum()), "triangles")
    bounds.check(int(corners.sum()) // 3, "triangles")
    points = first_numbers(rows.rest(corners, b"vertex"), 3)
    so_far = np.cumsum(corners)
    counts = np.diff(so_far[closed], prepend=0)
    unclosed = len(points) - int(counts.sum())
    made = triangulate(points, np.arange(len(points) - unclosed), counts)
    bounds.check(len(made.corners), "triangles")
    made.tell(draft)
    draft.left_out(unclosed, "vertices", "their loop does not end")
    draft.accounted = len(counts)
    if not rows.which(b"endsolid").any():
        draft.note("ends without 'endsolid': it may have been cut off")
    draft.add(points, made.corners)
    return draft.surface()


def _declaration(data: bytes) -> int:
    """How many facets a text declares."""
    return len(re.findall(rb"(?i)\bfacet\s+normal\b", data)) or data.lower().count(b"endfacet")
