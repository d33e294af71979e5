"""The shape base: objects in canonical space that serve as references, and the nearest of them by an embedding."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.clouds import joint_rows
from artperl.core.pose import KINDS, AxisPrior, Trees
from artperl.core.shapes import Shapes
from artsim.common.files import atomic_file, parse_json, read_npz
from artsim.errors import ConfigError, DatasetError, KinematicsError
from artsim.model.kinematics import Joint, KinematicTree
from artsim.model.objects import MAX_PARTS, ArticulatedObject

FORMAT = 2
_ALIKE = 0.02
"""Radians: axes that differ by less are alike."""
_OTHER_SORT = 0.35
"""Radians: axes that differ by more are no two versions of one another, as those of doors and flaps."""
_PIVOT = 2.0
"""What a difference of one diagonal in the place of an axis counts for against one of 1 in its direction."""
_ALONG = 0.9
"""Cosine from which an axis is taken for another one, at least as it is perceived."""
_LIKE = 0.3
"""Differences of directions, and of places over the part's sides, up to which joints are of one sort."""
_SURE = 0.3
"""Length of a mean of votes for unit vectors, below which they do not agree."""
_CLOUDS = ("box_center", "box_size", "points", "normals", "spacing", "diagonal")


@dataclass(frozen=True, eq=False)
class ShapeBase:
    """Reference objects at diagonal 1 in their rest frames, with what is needed to find and to fit them.

    Attributes
    ----------
    object_ids, categories : tuple of str, length B
    trees : tuple of KinematicTree, length B
    shapes : Shapes
        B rows, padded to the most parts of any object.
    embeddings : (B, E) float or None
        One for each object, of whatever network searches the base.
    """

    object_ids: tuple[str, ...]
    categories: tuple[str, ...]
    trees: tuple[KinematicTree, ...]
    shapes: Shapes
    embeddings: Tensor | None = None

    def __len__(self) -> int:
        return len(self.object_ids)

    @cached_property
    def mean_axis(self) -> Tensor:
        """(B, P, 3) mean axis of each joint among all objects of the same kind."""
        axis = self.shapes.trees.axis
        means = [axis[self.kind == kind].mean(0) for kind in range(int(self.kind.max()) + 1)]
        return torch.nn.functional.normalize(torch.stack(means), dim=-1)[self.kind]

    def axis_prior(self, row: int) -> AxisPrior | None:
        """How far the axes of an observed object may lean from those of a reference; None where they hardly lean."""
        return self._axis_priors[int(self.kind[row])]

    @cached_property
    def _axis_priors(self) -> list[AxisPrior | None]:
        """One for each kind.

        As those of all objects of the reference's kind do about their mean, and twice as far: retrieved axes are right
        more often than not, and otherwise they may be those of the other extreme. Axes that differ by so much that
        they are of another sort, as those of doors and flaps, stay.
        """
        every = torch.linalg.cross(self.mean_axis, self.shapes.trees.axis)
        priors: list[AxisPrior | None] = []
        for kind in range(int(self.kind.max()) + 1):
            lean = every[self.kind == kind]
            spread = lean.square().sum(-1).mean(0).sqrt()
            leans = (spread > _ALIKE) & (spread < _OTHER_SORT)
            twice = 2.0 * (lean * leans[:, None]).flatten(1)
            priors.append(AxisPrior((twice.T @ twice / len(twice))[None], leans[None]) if bool(leans.any()) else None)
        return priors

    @cached_property
    def kind(self) -> Tensor:
        """(B,) int64 number that objects of one category with the same kinematic tree share."""
        kinds = [(c, t.types, tuple(t.parents)) for c, t in zip(self.categories, self.trees, strict=True)]
        numbers = {kind: number for number, kind in enumerate(dict.fromkeys(kinds))}
        return torch.tensor([numbers[kind] for kind in kinds], device=self.shapes.diagonal.device)

    def has_other_axes(self, row: int) -> Tensor:
        """(B,) bool: objects of an object's kind of which some axis leans away from it beyond the mean."""
        axis, mean = self.shapes.trees.axis, self.mean_axis[row]
        apart, usual = _angle(axis, axis[row]), _angle(axis[row], mean)
        return (self.kind == self.kind[row]) & (apart > usual.clamp(min=_ALIKE)).any(1)

    @staticmethod
    def of(objects: Sequence[ArticulatedObject], points_per_part: int = 512, num_rows: int | None = None) -> ShapeBase:
        """A base of any set of objects, each brought to diagonal 1, with limits as wide as any object's of its kind.

        There are ``num_rows`` rows for parts, by default as many as any object has.
        """
        if not objects:
            raise ConfigError("a shape base needs objects", fix="pass at least one")
        units = widen_limits([obj.with_diagonal(1.0) for obj in objects])
        return ShapeBase(
            tuple(obj.object_id for obj in units),
            tuple(obj.category for obj in units),
            tuple(obj.tree for obj in units),
            Shapes.from_objects(units, points_per_part, num_rows),
        )

    def with_embeddings(self, embeddings: Tensor) -> ShapeBase:
        """The same objects, found by other embeddings (B, E)."""
        if len(embeddings) != len(self):
            raise ConfigError(f"{len(embeddings)} embeddings do not fit {len(self)} objects", "embeddings")
        return replace(self, embeddings=embeddings.detach())

    def to(self, device: torch.device | str) -> ShapeBase:
        """The base on another device."""
        embeddings = None if self.embeddings is None else self.embeddings.to(device)
        return replace(self, shapes=self.shapes.to(device), embeddings=embeddings)

    def name(self, row: int) -> str:
        """Category and name of an object."""
        return f"{self.categories[row]}:{self.object_ids[row]}"

    def of_category(self, category: str) -> Tensor:
        """(B,) bool: objects of a category."""
        return torch.tensor([name == category for name in self.categories], device=self.shapes.diagonal.device)

    @cached_property
    def joints(self) -> Tensor:
        """(B, P, 9) joints as :func:`artperl.core.clouds.joint_rows` has them."""
        trees, shapes = self.shapes.trees, self.shapes
        parts = zip(trees.axis, trees.origin, shapes.box_center, shapes.diagonal, strict=True)
        rows = [
            joint_rows([KINDS[k] for k in kinds], *(values.cpu().double().numpy() for values in own))
            for kinds, own in zip(trees.kind.tolist(), parts, strict=True)
        ]
        return torch.from_numpy(np.stack(rows)).to(shapes.box_center)

    def nearest_objects(
        self, queries: Tensor, count: int = 1, allowed: Tensor | None = None, further: Tensor | None = None
    ) -> tuple[Tensor, Tensor]:
        """The objects whose embeddings are nearest (section 4.2: Euclidean distance), nearest first.

        Parameters
        ----------
        queries : (Q, E) float
        count : int
            Objects for each query.
        allowed : (B,) or (Q, B) bool, optional
            Objects to choose among, for example those of a category; at least ``count`` for each query.
        further : (Q, B) float, optional
            Distances in other regards.

        Returns
        -------
        rows : (Q, count) int64
        distance : (Q, count) float

        Raises
        ------
        ConfigError
            When the base has no embeddings, or too few objects.
        """
        if self.embeddings is None:
            raise ConfigError("the shape base has no embeddings", fix="give it some: with_embeddings")
        apart = torch.cdist(queries, self.embeddings.to(queries))
        if further is not None:
            apart = torch.hypot(apart, further)
        if allowed is not None:
            apart = apart.masked_fill(~allowed.to(apart.device), torch.inf)
        if count > len(self) or not bool(torch.isfinite(apart).sum(1).ge(count).all()):
            raise ConfigError(f"fewer than {count} objects to choose among", "count", "ask for fewer, or allow more")
        distance, rows = apart.topk(count, largest=False)
        return rows, distance

    def compose(self, center: Tensor, size: Tensor, joint: Tensor, parent: Tensor) -> tuple[int, Shapes]:
        """An object whose parts and joints are those of any objects that are most like the ones asked for.

        No base holds every mix of doors and drawers, but a few objects have a door and a drawer of every kind. A part
        is that with the box most like the one asked for, and moves as that part does whose joint is most like it.

        Parameters
        ----------
        center, size : (K, 3) float
            Boxes of the parts, in diagonals, the root's first.
        joint : (K, 9) float
            Their joints, as :attr:`joints` has them.
        parent : (K,) int64

        Returns
        -------
        int, Shapes
            The object that the root is of; and one row, of K parts.
        """
        trees, P = self.shapes.trees, self.shapes.trees.num_rows
        unit = self.shapes.diagonal[:, None, None]
        boxes = torch.cat([self.shapes.box_center / unit, self.shapes.box_size / unit], dim=-1).flatten(0, 1)
        known = joint_features(self.joints).flatten(0, 1)
        # Roots for the root; for other parts those that move alike, and any where there is none.
        likely = 1 + (motion(self.joints).flatten()[:, None] == motion(joint))
        likely[::P] = 0
        likely[:, 0] = torch.arange(len(likely), device=likely.device) % P == 0
        likely = likely * trees.valid.flatten()[:, None]
        possible = likely == likely.amax(0)
        shape = torch.cdist(boxes, torch.cat([center, size], dim=-1)).masked_fill(~possible, torch.inf).argmin(0)
        mover = torch.cdist(known, joint_features(joint)).masked_fill(~possible, torch.inf).argmin(0)
        rows, parts = shape // P, shape % P
        root = int(rows[0])
        joints = [self.trees[root].joints[0]]
        for n in range(1, len(center)):
            b, k = divmod(int(mover[n]), P)
            place, side = self.shapes.box_center[rows[n], parts[n]], self.shapes.box_size[rows[n], parts[n]]
            joints.append(self._joint_like(b, k, place, side, joint[n], int(parent[n]), f"{n}"))
        chosen = self.shapes[root : root + 1]
        fields = {}
        for name in ("box_center", "box_size", "points", "normals", "spacing"):
            values = getattr(self.shapes, name)
            fields[name] = torch.full_like(values[:1], torch.inf if name == "spacing" else 0.0)
            fields[name][0, : len(joints)] = values[rows, parts]
        tree = Trees.stack([KinematicTree(joints)], P, size.dtype).to(size.device)
        return root, replace(chosen, trees=tree, **fields)

    def _joint_like(
        self, row: int, part: int, center: Tensor, side: Tensor, perceived: Tensor, parent: int, name: str
    ) -> Joint:
        """A joint like that of a part, at the same place of another box; as it is perceived if that differs."""
        own, trees = self.joints[row, part], self.shapes.trees
        pattern = replace(self.trees[row].joints[part], parent=parent, name=name, mimic=None)
        if not bool(same_axes(own, perceived)):
            slides = int(motion(perceived)) == 1
            axis = torch.nn.functional.normalize(perceived[:3] if slides else perceived[3:6], dim=0)
            far = 1.0 if slides else np.pi
            return replace(
                pattern, type="prismatic" if slides else "revolute", axis=_tuple(axis),
                origin=_tuple(center + perceived[6:]), lower=-far, upper=far, rest=0.0,
            )  # fmt: skip
        place = self.joints[..., 6:] / self.shapes.box_size.clamp(min=1e-6)
        like = trees.kind == trees.kind[row, part]
        like &= torch.linalg.vector_norm(self.joints[..., :6] - own[:6], dim=-1) < _LIKE
        like &= torch.linalg.vector_norm(place - place[row, part], dim=-1) < _LIKE
        return replace(
            pattern, origin=_tuple(center + place[row, part] * side), lower=float(trees.lower[like].amin()),
            upper=float(trees.upper[like].amax()),
        )  # fmt: skip

    def references(self, rows: Tensor) -> Shapes:
        """Shapes of the chosen objects, with no more rows for parts than they need."""
        return self.shapes[rows].trim()

    def save(self, path: str | Path) -> None:
        """Write everything into one ``.npz`` file, without pickle."""
        description = {
            "format": FORMAT,
            "object_ids": self.object_ids,
            "categories": self.categories,
            "trees": [tree.to_dict() for tree in self.trees],
        }
        arrays = {name: getattr(self.shapes, name).cpu().numpy() for name in _CLOUDS}
        # To 0.02 % of a diagonal and 0.4 deg: small files, and surfaces are not known any better.
        arrays["points"] = arrays["points"].astype(np.float16)
        arrays["normals"] = np.rint(127.0 * arrays["normals"]).astype(np.int8)
        if self.embeddings is not None:
            arrays["embeddings"] = self.embeddings.cpu().numpy()
        text = np.frombuffer(json.dumps(description).encode(), dtype=np.uint8)
        with atomic_file(Path(path)) as file:
            np.savez_compressed(file, description=text, **arrays)

    @staticmethod
    def load(path: str | Path) -> ShapeBase:
        """Read a file that :meth:`save` wrote.

        Raises
        ------
        DatasetError
            When it is missing, damaged or of another format.
        """
        arrays = read_npz(Path(path), "shape base", DatasetError)
        try:
            return _base(arrays)
        except (ValueError, KinematicsError) as error:
            reason = error.what if isinstance(error, KinematicsError) else error
            raise DatasetError(f"no shape base can be read ({reason})", path, "build it again") from error


_MAX_PAIRS = 30_000_000
"""Bytes of the pairs of parts of all objects, of which one carries the other: 460 objects of 254 parts."""

_LARGEST = 1e6
"""Objects have a diagonal of 1, and a half-precision number reaches 65504."""


def _base(arrays: Mapping[str, NDArray[Any]]) -> ShapeBase:
    """The base that the arrays of a file describe; a ValueError or KinematicsError says why there is none."""
    lacking = {"description", *_CLOUDS} - arrays.keys()
    if lacking:
        raise ValueError(f"it lacks {', '.join(sorted(lacking))}")
    description = parse_json(arrays["description"].tobytes())
    if not isinstance(description, dict):
        raise ValueError("its description is not a set of named values")
    if description.get("format") != FORMAT:
        raise ValueError(f"its format is {description.get('format')!r:.20}, not {FORMAT}")
    ids, categories, trees = (description.get(name) for name in ("object_ids", "categories", "trees"))
    if not (isinstance(ids, list) and isinstance(categories, list) and isinstance(trees, list)):
        raise ValueError("its objects are no lists")
    if not len(ids) == len(categories) == len(trees) > 0 or not all(isinstance(n, str) for n in [*ids, *categories]):
        raise ValueError("its lists of objects do not fit each other")
    tensors = _clouds(arrays, len(ids))
    num_rows = tensors["box_size"].shape[1]
    if num_rows > MAX_PARTS or len(ids) * num_rows**2 > _MAX_PAIRS:
        raise ValueError(f"{len(ids)} objects of {num_rows} parts are too many")
    known = tuple(KinematicTree.from_dict(tree) for tree in trees)
    embeddings = arrays.get("embeddings")
    if embeddings is not None:
        embeddings = _check_array(embeddings, (len(ids), None), "embeddings")
    return ShapeBase(
        tuple(ids),
        tuple(categories),
        known,
        Shapes(trees=Trees.stack(known, num_rows, torch.float32), **tensors),
        None if embeddings is None else torch.from_numpy(embeddings),
    )


def _clouds(arrays: Mapping[str, NDArray[Any]], count: int) -> dict[str, Tensor]:
    """Boxes and clouds of the parts of ``count`` objects, checked."""
    points = arrays["points"]
    if points.ndim != 4 or 0 in points.shape:
        raise ValueError(f"its points are of shape {points.shape}")
    B, P, M, _ = points.shape
    shapes = {
        "box_center": (B, P, 3),
        "box_size": (B, P, 3),
        "points": (B, P, M, 3),
        "normals": (B, P, M, 3),
        "spacing": (B, P),
        "diagonal": (B,),
    }
    if count != B:
        raise ValueError(f"it has points of {B} objects, and names {count}")
    if arrays["spacing"].dtype.kind != "f":
        raise ValueError(f"its spacing is {arrays['spacing'].dtype}")
    # Parts without a surface have no spacing: it is infinite.
    unbounded = arrays["spacing"] == np.inf
    finite = dict(arrays) | {"spacing": np.where(unbounded, 1.0, arrays["spacing"])}
    checked = {name: _check_array(finite[name], shape, name) for name, shape in shapes.items()}
    if not (checked["diagonal"] > 0).all() or not (checked["spacing"] >= 0).all() or (checked["box_size"] < 0).any():
        raise ValueError("a length is negative")
    checked["spacing"][unbounded] = np.inf
    tensors = {name: torch.from_numpy(values) for name, values in checked.items()}
    tensors["normals"] = torch.nn.functional.normalize(tensors["normals"], dim=-1)
    return tensors


def _check_array(values: NDArray[Any], shape: tuple[int | None, ...], name: str) -> NDArray[np.float32]:
    """Finite numbers of that shape (None: any length), in single precision."""
    fits = len(shape) == values.ndim and all(want in (None, has) for want, has in zip(shape, values.shape, strict=True))
    if not fits or values.dtype.kind not in "iuf":
        raise ValueError(f"its {name} are {values.dtype} of shape {values.shape}")
    # The least and the largest take no memory; where a value is not a number, they are none, too.
    if values.size and not -_LARGEST <= float(values.min()) <= float(values.max()) <= _LARGEST:
        raise ValueError(f"its {name} are not finite, or out of range")
    return values.astype(np.float32)


def motion(joint: Tensor) -> Tensor:
    """(...) int64 of joints (..., 9): 0 where nothing moves, 1 for slides, 2 where a part turns."""
    slides, turns = (torch.linalg.vector_norm(axis, dim=-1) for axis in (joint[..., :3], joint[..., 3:6]))
    return torch.where(turns > slides, 2, torch.where(slides > 0.0, 1, 0))


def same_axes(joint: Tensor, perceived: Tensor) -> Tensor:
    """(...) bool: whether joints (..., 9) of objects have the perceived axes, as far as these are sure."""
    along = (joint[..., :6] * perceived[..., :6]).sum(-1)
    length = torch.linalg.vector_norm(perceived[..., :6], dim=-1)
    return (along >= _ALONG * length) | (length < _SURE)


def joint_features(joint: Tensor) -> Tensor:
    """Joints (..., 9) whose Euclidean distance counts against that of boxes."""
    return torch.cat([joint[..., :6], _PIVOT * joint[..., 6:]], dim=-1)


def _tuple(values: Tensor) -> tuple[float, float, float]:
    x, y, z = values.double().tolist()
    return x, y, z


def _angle(axis: Tensor, other: Tensor) -> Tensor:
    """Radians between unit vectors."""
    return torch.linalg.vector_norm(torch.linalg.cross(axis, other.expand_as(axis)), dim=-1).clamp(max=1.0).asin()


def widen_limits(objects: Sequence[ArticulatedObject]) -> list[ArticulatedObject]:
    """Objects whose joints go as far as those of any other one of the same category and kinematic tree.

    How far the joints of an observed object go is not known, and a reference that stops earlier could not follow it.
    """
    kinds = [(obj.category, obj.tree.types, tuple(obj.tree.parents)) for obj in objects]
    limits = {
        kind: np.stack([obj.tree.limits for obj, own in zip(objects, kinds, strict=True) if own == kind])
        for kind in dict.fromkeys(kinds)
    }
    result = []
    for obj, kind in zip(objects, kinds, strict=True):
        low, high = limits[kind][..., 0].min(axis=0), limits[kind][..., 1].max(axis=0)
        joints = [
            replace(joint, lower=float(low[k]), upper=float(high[k])) if k else joint
            for k, joint in enumerate(obj.tree.joints)
        ]
        result.append(replace(obj, native_tree=KinematicTree(joints).scaled(1.0 / obj.scale)))
    return result
