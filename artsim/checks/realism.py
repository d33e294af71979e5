"""How near procedural objects come to real ones: distances between objects, and what follows from them.

Objects are compared in their rest frames at a diagonal of 1, by five measures that are all lengths in diagonals:

- ``surface``: chamfer distance between the surfaces of the whole objects, at rest;
- ``parts``: the same between the surfaces of matched parts, averaged over parts;
- ``boxes``: how far the boxes of matched parts are apart, in centre and in size, averaged over parts;
- ``joints``: placement of matched joints: distance of the axes, and what the angle between them does to a point half
  a diagonal away, averaged over joints;
- ``ranges``: difference of the joint limits, for a turning joint again at a point half a diagonal away.

Surfaces are what cameras all round see of an object in several of its joint states, carried back to the rest state:
the inner faces that real meshes have here and there do not count. Moving parts are matched one to one such that their
boxes are as near as possible, those that move alike first; root goes with root. Where one object has more moving
parts, each that is left counts as if its partner were a point at its centre with a joint of the other kind.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from artsim.errors import AssetError
from artsim.loading.urdf import load
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.capture import observe

MEASURES = ("surface", "parts", "boxes", "joints", "ranges")

Half = Literal["dev", "test"]

_VIEWS = ViewOptions(preset="sphere", width=320, height=320)
_NUM_VIEWS = 12
_POINTS_PER_VIEW = 2000
_CELL = 0.01  # points are thinned to one in each cube of this side, which evens out their density
_WHOLE, _PART = 512, 128  # points of an object and of a part whose distance from another's whole cloud is averaged
_LEVER = 0.5  # diagonals: where angles are turned into lengths
_ODD_JOINT = 1.0  # placement and range of joints that move differently, or of one without a partner


# --- real objects ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RealSource:
    """Where the real objects of a category are."""

    folders: tuple[str, ...]
    """PartNet-Mobility categories."""
    moves: tuple[str, ...] = ()
    """Joint types that all moving parts must have; any, when empty."""


_NAMED_ALIKE = (
    "box", "bucket", "coffee_machine", "dishwasher", "door", "eyeglasses", "faucet", "kitchen_pot", "laptop",
    "microwave", "oven", "refrigerator", "safe", "stapler", "storage_furniture", "suitcase", "switch", "table",
    "toaster", "trash_can", "washing_machine", "window",
)  # fmt: skip
REAL: dict[str, RealSource] = {
    **{name: RealSource((name.title().replace("_", ""),)) for name in _NAMED_ALIKE},
    "cutter": RealSource(("Knife",), ("prismatic",)),
    "drawer": RealSource(("StorageFurniture", "Table"), ("prismatic",)),
    "folding_knife": RealSource(("Knife",), ("revolute", "continuous")),
}
"""Real objects to compare each category with."""

Split = dict[str, dict[str, dict[str, str]]]
"""PartNet-Mobility category -> "dev" or "test" -> object id -> SHA-256 of its URDF file."""


def draw_split(folder: Path) -> Split:
    """Divide the objects of a PartNet-Mobility folder: a third of each category, by a hash of the id, is for testing.

    Of two objects one is; a single one is not.
    """
    split: Split = {}
    for category in sorted(path for path in folder.iterdir() if path.is_dir()):
        files = list(category.glob("*/mobility.urdf"))
        files.sort(key=lambda path: hashlib.sha256(path.parent.name.encode()).hexdigest())
        held_out = round(len(files) / 3)
        halves = {"test": files[:held_out], "dev": files[held_out:]}
        split[category.name] = {
            half: {path.parent.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(paths)}
            for half, paths in halves.items()
        }
    return {category: halves for category, halves in split.items() if halves["dev"]}


def read_split(path: Path) -> Split:
    """Read a frozen split."""
    split: Split = json.loads(path.read_text())
    return split


def real_objects(category: str, folder: Path, split: Split, half: Half) -> Iterator[ArticulatedObject]:
    """The real objects of one half of a category of ours.

    Raises
    ------
    AssetError
        When an object of the split is missing or is not the one that was split.
    """
    source = REAL[category]
    for name in source.folders:
        for object_id, digest in split.get(name, {}).get(half, {}).items():
            path = folder / name / object_id / "mobility.urdf"
            if not path.is_file():
                raise AssetError("an object of the split is missing", path, "complete the folder")
            if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
                raise AssetError("differs from the file that was split", path, "restore it, or make a new split")
            obj = load(path)
            moves = {obj.tree.types[k] for k in range(1, len(obj))}
            if not source.moves or moves <= set(source.moves):
                yield obj


# --- distances -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Likeness:
    """What two objects are compared by, in the rest frame at a diagonal of 1; K parts, the root first."""

    cloud: Array
    """(N, 3) float. Dense points of the whole surface, at rest."""
    part_clouds: tuple[Array, ...]
    """Dense points of each part's surface, at rest."""
    box_center: Array
    box_size: Array
    """(K, 3) float."""
    turns: NDArray[np.bool_]
    """(K,) bool. Whether the part's joint turns (revolute, continuous, screw)."""
    axis: Array
    origin: Array
    """(K, 3) float. Of the joints, at rest."""
    limits: Array
    """(K, 2) float. From the rest state on, in radians or diagonals; a full turn either way where there are none."""

    @cached_property
    def surface(self) -> Surface:
        """Of the whole object."""
        return Surface(self.cloud[:_WHOLE], cKDTree(self.cloud))

    @cached_property
    def part_surfaces(self) -> tuple[Surface, ...]:
        """Of each part."""
        return tuple(Surface(cloud[:_PART], cKDTree(cloud)) for cloud in self.part_clouds)


@dataclass(frozen=True, eq=False)
class Surface:
    """A few points of a surface to measure distances from, and many to measure distances to."""

    points: Array
    """(N, 3) float."""
    tree: cKDTree


def likeness(obj: ArticulatedObject) -> Likeness:
    """Look at an object from all sides and write down what it is compared by; the same every time."""
    rng = np.random.default_rng(0)
    obj = obj.with_diagonal(1.0)
    points, part = _visible_surface(obj, rng)
    order = rng.permutation(len(points))
    points, part = points[order], part[order]
    clouds = [points[part == k] for k in range(len(obj))]
    tree = obj.tree
    limits = tree.limits - tree.rest[:, None]
    return Likeness(
        cloud=points,
        # What is hidden in all states is stood for by the corners of its box.
        part_clouds=tuple(cloud if len(cloud) else obj.part_bounds[k] for k, cloud in enumerate(clouds)),
        box_center=obj.box_center,
        box_size=obj.box_size,
        turns=np.array([kind in ("revolute", "continuous", "screw") for kind in tree.types]),
        axis=tree.axes,
        origin=tree.origins,
        limits=np.where(np.isfinite(limits), limits, [-2.0 * np.pi, 2.0 * np.pi]),
    )


def _visible_surface(obj: ArticulatedObject, rng: np.random.Generator) -> tuple[Array, NDArray[np.int64]]:
    """Points (N, 3) in the rest frame, at rest, and part ids (N,), seen at rest and in random states by turns."""
    clouds, ids = [], []
    for view in range(_NUM_VIEWS):
        q = obj.tree.rest if view % 2 == 0 else sample_state(obj, StateOptions(), rng)
        camera = sample_view(obj, q, _VIEWS, rng)
        sample = observe(obj, q, camera, num_points=_POINTS_PER_VIEW, rng=rng)
        T_part_camera = invert_transform(sample.T_camera_part)
        for k in np.unique(sample.part):
            seen = sample.points[sample.part == k].astype(np.float64)
            clouds.append(transform_points(T_part_camera[k], seen))
            ids.append(np.full(len(seen), k))
    points, part = np.concatenate(clouds), np.concatenate(ids)
    order = rng.permutation(len(points))
    cells = np.floor(points[order] / _CELL).astype(np.int64)
    cells -= cells.min(axis=0)
    number = np.ravel_multi_index((*cells.T, part[order]), (*(cells.max(axis=0) + 1), len(obj)))
    kept = order[np.unique(number, return_index=True)[1]]
    return points[kept], part[kept]


def distances(a: Likeness, b: Likeness) -> Array:
    """(5,) distance of two objects by each of ``MEASURES``; symmetric."""
    pairs, alone = _match(a, b)
    surface = _chamfer(a.surface, b.surface)
    parts = [_chamfer(a.part_surfaces[i], b.part_surfaces[j]) for i, j in pairs]
    parts += [_chamfer_to_center(side, k) for side, k in alone]
    boxes = [_box_distance(a, i, b, j) for i, j in pairs] + [float(np.linalg.norm(s.box_size[k])) for s, k in alone]
    joints = [_joint_distances(a, i, b, j) for i, j in pairs if i > 0] + [(_ODD_JOINT, _ODD_JOINT) for _ in alone]
    placement, ranges = np.mean(joints, axis=0) if joints else (0.0, 0.0)
    return np.array([surface, np.mean(parts), np.mean(boxes), placement, ranges])


def _match(a: Likeness, b: Likeness) -> tuple[list[tuple[int, int]], list[tuple[Likeness, int]]]:
    """Pairs of parts, and the parts that have no partner."""
    center = np.linalg.norm(a.box_center[1:, None] - b.box_center[None, 1:], axis=-1)
    size = np.linalg.norm(a.box_size[1:, None] - b.box_size[None, 1:], axis=-1)
    odd = a.turns[1:, None] != b.turns[None, 1:]
    first, second = linear_sum_assignment(center + size + odd)
    pairs = [(0, 0)] + [(int(i) + 1, int(j) + 1) for i, j in zip(first, second, strict=True)]
    alone = [(a, k) for k in range(1, len(a.turns)) if k - 1 not in first]
    alone += [(b, k) for k in range(1, len(b.turns)) if k - 1 not in second]
    return pairs, alone


def _chamfer(a: Surface, b: Surface) -> float:
    """Mean distance to the other's nearest point, averaged over both directions."""
    return 0.5 * float(b.tree.query(a.points)[0].mean() + a.tree.query(b.points)[0].mean())


def _chamfer_to_center(side: Likeness, k: int) -> float:
    away = np.linalg.norm(side.part_surfaces[k].points - side.box_center[k], axis=1)
    return 0.5 * float(away.mean() + away.min())


def _box_distance(a: Likeness, i: int, b: Likeness, j: int) -> float:
    center = np.linalg.norm(a.box_center[i] - b.box_center[j])
    return float(center + np.linalg.norm(a.box_size[i] - b.box_size[j]))


def _joint_distances(a: Likeness, i: int, b: Likeness, j: int) -> tuple[float, float]:
    """Placement and range difference of two joints."""
    if a.turns[i] != b.turns[j]:
        return _ODD_JOINT, _ODD_JOINT
    cosine = float(a.axis[i] @ b.axis[j])
    placement = _LEVER * float(np.arccos(min(1.0, abs(cosine))))
    limits = b.limits[j] if cosine >= 0 else -b.limits[j, ::-1]
    difference = float(np.abs(a.limits[i] - limits).sum())
    if not a.turns[i]:
        return placement, difference
    gap = 0.5 * (_axis_distance(a, i, b, j) + _axis_distance(b, j, a, i))
    return placement + gap, _LEVER * difference


def _axis_distance(a: Likeness, i: int, b: Likeness, j: int) -> float:
    """Distance of one axis, where it passes its part's box centre, from the other axis."""
    beside = a.origin[i] + (a.box_center[i] - a.origin[i]) @ a.axis[i] * a.axis[i]
    offset = beside - b.origin[j]
    return float(np.linalg.norm(offset - (offset @ b.axis[j]) * b.axis[j]))


# --- what follows ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Realism:
    """How a category's procedural objects stand to its real ones; N procedural, R real, in diagonals."""

    to_real: Array
    """(N, R, 5) float. Distances by each of ``MEASURES``."""
    between_real: Array
    """(P, 5) float. Distances of all pairs of real objects that serve as the yardstick."""

    @property
    def coverage(self) -> Array:
        """(5,) share of real objects that are the nearest real one of some procedural object."""
        nearest = self.to_real.argmin(axis=1)
        real = self.to_real.shape[1]
        return np.array([len(np.unique(column)) / real for column in nearest.T])

    @property
    def neighbour(self) -> Array:
        """(R, 5) distance of each real object's nearest procedural one."""
        distance: Array = self.to_real.min(axis=0)
        return distance

    @property
    def minimum_matching_distance(self) -> Array:
        """(5,) mean of ``neighbour``."""
        distance: Array = self.neighbour.mean(axis=0)
        return distance

    @property
    def yardstick(self) -> Array:
        """(5,) median distance between two real objects; NaN without a pair."""
        if len(self.between_real) == 0:
            return np.full(len(MEASURES), np.nan)
        return np.median(self.between_real, axis=0)

    @property
    def near(self) -> NDArray[np.bool_]:
        """(R, 5) whether the nearest procedural object is no farther than the yardstick."""
        return np.asarray(self.neighbour <= self.yardstick)

    @property
    def near_at_once(self) -> NDArray[np.bool_]:
        """(R,) whether one and the same procedural object is within the yardstick by every measure."""
        return np.asarray((self.to_real <= self.yardstick).all(axis=2).any(axis=0))


def pair_distances(likenesses: Sequence[Likeness]) -> Array:
    """(P, 5) distances of all pairs."""
    found = [distances(a, b) for n, a in enumerate(likenesses) for b in likenesses[:n]]
    return np.array(found).reshape(-1, len(MEASURES))
