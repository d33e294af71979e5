"""MSH: MuJoCo's old format of meshes, in bytes. Four counts, then vertices, normals, texture coordinates, triangles."""

import numpy as np

from artsim.loading.mesh_files.surface import Bounds, Draft, Surface, UnusableMeshError

_HEADER = 16


def read_msh(data: bytes, bounds: Bounds) -> Surface:
    """The surface of an MSH file; raises as ``read_mesh``."""
    if len(data) < _HEADER:
        raise UnusableMeshError("is shorter than the header of an MSH file")
    vertices, normals, textures, faces = (int(n) for n in np.frombuffer(data, "<i4", 4))
    if min(vertices, normals, textures, faces) < 0:
        raise UnusableMeshError("declares a number of vertices or triangles below 0")
    bounds.check(faces, "triangles")
    before = _HEADER + 12 * vertices + 12 * normals + 8 * textures
    if len(data) != before + 12 * faces:
        raise UnusableMeshError(f"has {len(data)} bytes where its counts make {before + 12 * faces}")
    draft = Draft()
    points = np.frombuffer(data, "<f4", 3 * vertices, _HEADER).reshape(-1, 3).astype(np.float64)
    draft.add(points, np.frombuffer(data, "<i4", 3 * faces, before).reshape(-1, 3).astype(np.int64))
    draft.declared = draft.accounted = faces
    return draft.surface()
