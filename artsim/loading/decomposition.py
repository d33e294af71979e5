"""Convex decomposition of loaded parts: bodies that things can be put into, such as an opened drawer.

A part's surface falls into pieces that share no corner. A piece that nearly fills its convex hull becomes the hull; any
other is cut into convex ones by CoACD (Wei et al., Approximate Convex Decomposition for 3D Meshes with Collision-Aware
Concavity and Tree Search, SIGGRAPH 2022). Results are kept in a folder, as that takes seconds for each piece.
"""

import hashlib
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.array_files import read_npz
from artsim.common.extras import require_extra
from artsim.common.files import write_atomic
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.model.convex_bodies import DEFAULT_DENSITY, convex_hull
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Body, Mesh

THIN = 1e-3
"""Least thickness of a piece, over the object's diagonal."""
_GRID = 1e-6
"""Corners nearer than this, over the diagonal, are one."""
_SEARCH = {"resolution": 500, "mcts_nodes": 10, "mcts_iterations": 10, "mcts_max_depth": 1, "seed": 0}
"""Settings of CoACD's search, which looks one cut ahead. Its defaults look three ahead, for many times the cost and a
third fewer pieces of the same concavity."""
_FINER = (1.0, 0.5, 0.25)
"""Factors on the concavity that are tried, until the volume of a closed surface is held."""
_OF_SIZE = 0.08
"""Concavity of a closed surface at most, over its longest side."""
VOLUME = 0.05
"""Share of the volume that a surface encloses, by which pieces may miss it."""
_MAX_FILE = 1 << 26


@dataclass(frozen=True)
class DecompositionOptions:
    """How closely convex pieces follow a surface."""

    concavity: float = 0.02
    """How deep a hull may bridge a hollow, over the object's diagonal: a small drawer is a twentieth of it deep."""
    most_pieces: int = 32
    """Of each piece of surface that is cut."""
    cache: Path | None = None
    """Folder of results; by default artsim in the user's folder of caches."""

    def __post_init__(self) -> None:
        if not 0.0 < self.concavity <= 1.0:
            raise ConfigError(f"{self.concavity} is no concavity", "concavity", "use more than 0 and up to 1")
        if self.most_pieces < 1:
            raise ConfigError(f"{self.most_pieces} is not a count", "most_pieces", "use 1 or more")


DEFAULTS = DecompositionOptions()


def decompose(
    obj: ArticulatedObject, options: DecompositionOptions = DEFAULTS, progress: bool = True
) -> ArticulatedObject:
    """The object with convex pieces as the body of each part that has none.

    Parameters
    ----------
    obj : ArticulatedObject
        Loaded: parts of procedural objects have bodies.
    options : DecompositionOptions, optional
    progress : bool
        Show a progress bar.

    Raises
    ------
    ConfigError
        When a piece must be cut and CoACD is not installed.
    """
    parts = list(obj.parts)
    waiting = [k for k, part in enumerate(parts) if part.body is None and len(part.faces)]
    for k in track("decomposing", waiting, unit="part", shown=progress, leave=False):
        part, diagonal = parts[k], obj.diagonal / obj.scale
        pieces = convex_pieces(part.vertices / diagonal, part.faces, options)
        meshes = tuple((vertices * diagonal, faces) for vertices, faces in pieces)
        solid = convex_hull(part.vertices[np.unique(part.faces)], THIN * diagonal)
        parts[k] = replace(part, body=Body(meshes, DEFAULT_DENSITY, solid))
    return replace(obj, parts=tuple(parts))


def convex_pieces(
    vertices: Array, faces: NDArray[np.int32], options: DecompositionOptions = DEFAULTS
) -> tuple[Mesh, ...]:
    """Convex pieces of a surface, in whose units an object's diagonal is 1.

    Parameters
    ----------
    vertices : (V, 3) float
    faces : (F, 3) int
    options : DecompositionOptions, optional
    """
    pieces: list[Mesh] = []
    for own in connected_surfaces(vertices, faces):
        used, index = np.unique(faces[own], return_inverse=True)
        corners, triangles = vertices[used], index.reshape(-1, 3).astype(np.int32)
        hull, volume = convex_hull(corners, THIN), closed_volume(corners, triangles)
        holds = volume is None or union_volume([hull]) <= (1.0 + VOLUME) * volume
        if holds and hollow(corners, triangles) <= options.concavity:
            pieces.append(hull)
        else:
            pieces += _cut(corners, triangles, volume, options)
    return tuple(pieces)


def connected_surfaces(vertices: Array, faces: NDArray[np.int32]) -> list[NDArray[np.int64]]:
    """Faces of each piece of a surface that shares no corner with the others, by place."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    _, place = np.unique(np.round(vertices / _GRID), axis=0, return_inverse=True)
    joined = place.ravel()[faces]
    count = int(joined.max(initial=-1)) + 1
    ends = (np.r_[joined[:, 0], joined[:, 1]], np.r_[joined[:, 1], joined[:, 2]])
    _, label = connected_components(coo_array((np.ones(len(ends[0])), ends), shape=(count, count)), directed=False)
    of_face = label[joined[:, 0]]
    return [np.flatnonzero(of_face == number) for number in np.unique(of_face)]


def hollow(vertices: Array, faces: NDArray[np.int32]) -> float:
    """How far a convex hull is from its surface at most: from 2,000 places on it to 10,000 on the surface."""
    import trimesh
    from scipy.spatial import QhullError, cKDTree

    surface = trimesh.Trimesh(vertices, faces, process=False)
    try:
        hull = trimesh.convex.convex_hull(vertices)
    except (QhullError, ValueError):  # flat
        return 0.0
    if surface.area == 0.0:
        return 0.0
    outside, _ = trimesh.sample.sample_surface(hull, 2000, seed=0)
    inside, _ = trimesh.sample.sample_surface(surface, 10_000, seed=0)
    distance, _ = cKDTree(np.concatenate([inside, vertices])).query(outside)
    return float(distance.max())


def _cut(
    vertices: Array, faces: NDArray[np.int32], volume: float | None, options: DecompositionOptions
) -> Sequence[Mesh]:
    """Convex pieces by CoACD, out of the cache where they are known."""
    recipe = repr((sorted(_SEARCH.items()), "real metric", options.concavity, options.most_pieces, _version()))
    recipe += "" if volume is None else repr((_FINER, _OF_SIZE, VOLUME))
    digest = hashlib.sha256(recipe.encode() + vertices.tobytes() + faces.tobytes()).hexdigest()
    file = _cache(options) / f"{digest}.npz"
    known = _read(file)
    if known is not None:
        return known
    pieces = _searched(vertices, faces, volume, options)
    buffer = io.BytesIO()
    arrays: dict[str, Any] = {
        f"{kind}{i}": array for i, piece in enumerate(pieces) for kind, array in zip("vf", piece, strict=True)
    }
    np.savez_compressed(buffer, **arrays)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(file, buffer.getvalue())
    return pieces


def _searched(
    vertices: Array, faces: NDArray[np.int32], volume: float | None, options: DecompositionOptions
) -> list[Mesh]:
    """Convex pieces that hold the volume of a closed surface: of what is small or thin, by a finer concavity."""
    if volume is None:
        return _run_coacd(vertices, faces, options.concavity, options.most_pieces)
    start = min(options.concavity, _OF_SIZE * float(np.ptp(vertices, axis=0).max()))
    best: list[Mesh] = []
    least = np.inf
    for finer in _FINER:
        pieces = _run_coacd(vertices, faces, finer * start, options.most_pieces)
        error = abs(union_volume(pieces) / volume - 1.0)
        if error < least:
            best, least = pieces, error
        if least <= VOLUME:
            break
    return best


def _run_coacd(vertices: Array, faces: NDArray[np.int32], concavity: float, most: int) -> list[Mesh]:
    with require_extra("convex decomposition", extra="sim"):
        import coacd

    coacd.set_log_level("off")
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces),
        threshold=concavity,
        real_metric=True,  # the threshold in units of the mesh: else it would be a share of the piece's own size
        max_convex_hull=most,
        **_SEARCH,
    )
    return [convex_hull(np.asarray(corners, dtype=np.float64), THIN) for corners, _ in found]


def closed_volume(vertices: Array, faces: NDArray[np.int32]) -> float | None:
    """What a surface encloses, in units of the object's diagonal; None where it is open, or encloses a mere sheet."""
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    if not (mesh.is_watertight and mesh.is_winding_consistent):
        return None
    volume = abs(float(mesh.volume))  # some are turned inside out
    return volume if 2.0 * volume >= THIN * float(mesh.area) else None


def union_volume(pieces: Sequence[Mesh]) -> float:
    """What convex pieces hold together."""
    with require_extra("convex decomposition", extra="sim"):
        from manifold3d import Manifold, OpType

    hulls = [Manifold.hull_points(vertices) for vertices, _ in pieces]
    return float(Manifold.batch_boolean(hulls, OpType.Add).volume())


def _version() -> str:
    from importlib.metadata import version

    return version("coacd")


def _cache(options: DecompositionOptions) -> Path:
    if options.cache is not None:
        return options.cache
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "artsim" / "convex"


def _read(file: Path) -> list[Mesh] | None:
    """Pieces of a cached file; None where there is none, or it is damaged."""
    try:
        arrays = read_npz(file, max_bytes=_MAX_FILE)
    except ArtsimError:
        return None
    try:
        pieces = [(arrays[f"v{i}"], arrays[f"f{i}"]) for i in range(len(arrays) // 2)]
    except KeyError:
        return None
    good = all(v.ndim == f.ndim == 2 and f.size and f.max() < len(v) and np.isfinite(v).all() for v, f in pieces)
    return pieces if good and pieces else None
