"""Gates of convex pieces: they fill what a part's surface encloses, and let joints move as the surface does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import Manifold, Mesh64, OpType
from numpy.typing import NDArray

from artsim.loading.decomposition import (
    VOLUME,
    closed_volume,
    connected_surfaces,
)
from artsim.model.collision import Collision, Sweep
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Mesh, Part

DEPTH = 0.01
"""Mean thickness of an overlap that pieces make and surfaces do not, over the object's diagonal: half the concavity of
the pieces, which may stand that far out of the surface."""


@dataclass(frozen=True)
class PieceGates:
    """What was found of the pieces of an object.

    Attributes
    ----------
    volume_errors : dict of int to float
        Of each part all of whose surface is closed: by what share of the volume that it encloses its pieces hold more.
    overlaps : tuple of Collision
        Pairs of parts whose pieces run into each other in a state in which their surfaces do not.
    """

    volume_errors: dict[int, float]
    overlaps: tuple[Collision, ...]

    @property
    def same_volume(self) -> bool:
        """Whether the pieces of every part with a closed surface hold its volume."""
        return all(abs(error) <= VOLUME for error in self.volume_errors.values())

    @property
    def free(self) -> bool:
        """Whether joints move as far as before."""
        return not self.overlaps


def check_pieces(obj: ArticulatedObject, decomposed: ArticulatedObject) -> PieceGates:
    """The gates of an object whose parts have convex pieces.

    Parameters
    ----------
    obj : ArticulatedObject
        With its own surfaces.
    decomposed : ArticulatedObject
        The same, with pieces (:func:`artsim.loading.decomposition.decompose`).
    """
    diagonal = obj.diagonal / obj.scale
    errors = {}
    wholes = []
    for k, part in enumerate(decomposed.parts):
        pieces = () if part.body is None else part.body.pieces
        if not pieces:
            wholes.append(part)
            continue
        whole = union(pieces)
        wholes.append(_surfaced(part, whole))
        own = obj.parts[k]
        groups = connected_surfaces(own.vertices / diagonal, own.faces)
        volumes = [closed_volume(own.vertices / diagonal, own.faces[group]) for group in groups]
        if volumes and None not in volumes:
            solids = [_solid(own.vertices, own.faces[group]) for group in groups]
            enclosed = Manifold.batch_boolean(solids, OpType.Add).volume()  # surfaces may overlap
            errors[k] = float(whole.volume() / enclosed) - 1.0 if enclosed > 0 else np.inf
    surfaced = Sweep(replace(decomposed, parts=tuple(wholes)))
    overlaps = tuple(surfaced.added_overlaps(Sweep(obj), DEPTH * obj.diagonal))
    return PieceGates(errors, overlaps)


def _solid(vertices: Array, faces: NDArray[np.int32]) -> Manifold:
    import trimesh

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    triangles = mesh.faces if mesh.volume > 0 else mesh.faces[:, ::-1]
    return Manifold(Mesh64(np.asarray(mesh.vertices, np.float64), triangles.astype(np.uint64)))


def union(pieces: Sequence[Mesh]) -> Manifold:
    """What convex pieces fill together."""
    return Manifold.batch_boolean([Manifold.hull_points(vertices) for vertices, _ in pieces], OpType.Add)


def _surfaced(part: Part, whole: Manifold) -> Part:
    mesh = whole.to_mesh64()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=np.float64)
    return replace(part, vertices=vertices, faces=np.asarray(mesh.tri_verts, dtype=np.int32))
