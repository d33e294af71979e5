"""Particulate: a cloud of the whole surface with parts, their tree and their joints, one ``.npz`` for each object.

These are the names of the ground truth that its evaluation reads. The frame is the rest frame, Z up, scaled so that the
longest side of the object's box is 1.
"""

import io
from collections.abc import Iterator

import numpy as np

from artsim.formats.base import ObjectFormat
from artsim.model.joints import ROTATING
from artsim.model.objects import ArticulatedObject

_POINTS = 100_000
"""Particulate's own evaluation has as many."""


class ParticulateFormat(ObjectFormat):
    """``<key>/gt.npz``."""

    def object_files(self, obj: ArticulatedObject) -> Iterator[tuple[str, bytes]]:
        """The arrays of an object."""
        yield "gt.npz", particulate_npz(obj)


def particulate_npz(obj: ArticulatedObject, num_points: int = _POINTS) -> bytes:
    """An object as the arrays of Particulate's ground truth.

    Notes
    -----
    With K parts and N points: ``points`` (N, 3) float32, ``part_ids`` (N,), ``motion_hierarchy`` (K - 1, 2) parent and
    child; (K,) ``is_part_revolute`` and ``is_part_prismatic``; ``revolute_plucker`` (K, 6), direction l and l x p of a
    point p of the axis; ``prismatic_axis`` (K, 3); ranges (K, 2) from the rest state, radians and lengths. A screw is
    both.
    """
    import trimesh

    size = 1.0 / float((obj.bounds[1] - obj.bounds[0]).max())
    middle = obj.bounds.mean(axis=0)
    mesh = trimesh.util.concatenate([obj.part_mesh(k) for k in range(len(obj))])
    part_of_face = np.repeat(np.arange(len(obj)), [len(part.faces) for part in obj.parts])
    points, faces = trimesh.sample.sample_surface(mesh, num_points, seed=0)[:2]
    tree, kinds = obj.tree, np.array(obj.tree.types)
    turns, slides = np.isin(kinds, ROTATING), np.isin(kinds, ("prismatic", "screw"))
    span = tree.limits - tree.rest[:, None]
    radians = np.where(np.isfinite(span), span, np.array([-np.pi, np.pi]))
    lengths = span * np.where(kinds == "screw", [joint.pitch for joint in tree.joints], 1.0)[:, None] * size
    arrays = {
        "points": ((points - middle) * size).astype(np.float32),
        "part_ids": part_of_face[faces],
        "motion_hierarchy": np.array([(tree.parents[k], k) for k in range(1, len(obj))], np.int64).reshape(-1, 2),
        "is_part_revolute": turns,
        "is_part_prismatic": slides,
        "revolute_plucker": np.concatenate([tree.axes, np.cross(tree.axes, (tree.origins - middle) * size)], 1)
        * turns[:, None],
        "revolute_range": np.where(turns[:, None], radians, 0.0),
        "prismatic_axis": tree.axes * slides[:, None],
        "prismatic_range": np.where(slides[:, None] & np.isfinite(lengths), lengths, 0.0),
    }
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
    return buffer.getvalue()
