"""Families that no training has seen: ``python -m benchmarks.held_out``.

The rule, set before any figure: a family is held out when it has real objects in the dev half and the recipe of
``generic`` does not name it. The runs that the shipped weights come from name the same families. Near relatives of
these are left out: other furniture and appliances with fronts (``RELATIVES``). Fourteen families stay.

Each object is seen once, from the front, without noise, its joints anywhere. A moving part counts that at least 20 of
8,192 points show and that is at least 2 % open. Its partner is the estimated part that :func:`joint_errors` matches it
with. Figures, over all such parts:

- *type*: its joint slides or turns as the true one. Not right are *unmatched* parts, those taken for the *body*, and
  those of the *other type*. *turning* is the share of the true joints that turn: what one word would get.
- *axis*, *origin*: medians, degrees and per cent of the diagonal, the latter of joints that turn. A part without a
  moving partner counts 90 degrees and half the diagonal. *axis if right*: of parts whose type is right alone.
- *IoU* of its points, per cent; 0 without a partner.

*gIoU* and *chamfer*, as seen and opened, are of whole objects with the root among the parts, as Particulate's public
evaluation has them; see :mod:`artperl.evaluation.articulation`. It states no errors of axes.

Two baselines see the same clouds. *planes*: RANSAC finds up to ten planes. The largest and those at right angles to it
are the root. A plane parallel to one of these slides along its normal; another one turns about the line, nearest to it,
where it meets one of them. No limits are known. *nearest*: of 504 views of objects of the families trained on, the one
of least chamfer distance, both clouds centred and at one size. ICP aligns it. Points take the part of its nearest
point; joints are its own. The last line is one JSON object.
"""

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from artperl.data.categories import objects_of
from artperl.evaluation.articulation import Articulation, joint_errors, part_distances
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.samples import TEST_SEEDS, samples_of
from artperl.fitting.umeyama import umeyama
from artsim.checks.realism import REAL, read_split, real_objects
from artsim.common.files import read_json
from artsim.common.progress import track
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ArtsimError, ConfigError
from artsim.observing.sample import Sample

Array = NDArray[np.float64]
Way = Callable[[Array], Articulation]
"""From the points (N, 3) of a cloud, camera frame, metres."""

ROOT = Path(__file__).parents[1]
RELATIVES = ("microwave", "oven", "refrigerator", "safe", "table", "washing_machine")
"""Of drawers, storage furniture and dishwashers."""
_SHUT = 0.02
_PARALLEL = np.deg2rad(10.0)
"""Planes that lean less are parallel; those that lean less from a right angle stand on each other."""
_PLANES, _LEAST, _THICK = 10, 0.03, 0.01
"""Most planes, least share of the points of one, and how far its points may be off, in diagonals."""
_TRIED, _JUDGED = 200, 1024
"""Planes through three points that are tried for each plane, and the points that they are judged by."""
_REFERENCES = (12, 6)
"""Objects of each family trained on, and views of each: as many as two minutes make."""
_FITTED, _ITERATIONS = 256, 20
"""Points that clouds are compared and aligned by, and iterations of ICP."""


@dataclass(frozen=True)
class Options:
    """How much is measured."""

    procedural: int = 10
    """Procedural objects of each family."""
    estimator: str = "generic"
    categories: tuple[str, ...] = ()
    """By default those held out."""


def trained() -> tuple[str, ...]:
    """Families of the recipe."""
    recipe = read_json(ROOT / "artperl" / "recipes" / "generic.json", "recipe")
    return tuple(recipe["options"]["categories"])


def held_out() -> tuple[str, ...]:
    """Families of real objects that are neither trained on nor near relatives, in the order of the alphabet."""
    return tuple(name for name in sorted(REAL) if name not in trained() + RELATIVES)


def planes(points: Array) -> list[tuple[Array, NDArray[np.int64]]]:
    """Unit normals (3,) of planes, the largest first, and the numbers of their points."""
    rng = np.random.default_rng(0)
    thick = _THICK * float(np.linalg.norm(np.ptp(points, axis=0)))
    left, found = np.arange(len(points)), list[tuple[Array, NDArray[np.int64]]]()
    while len(found) < _PLANES and len(left) >= _LEAST * len(points):
        some = rng.permutation(left)
        corner, *ends = points[some[: min(len(some) // 3, _TRIED) * 3].reshape(3, -1)]
        normal = np.cross(*(end - corner for end in ends))
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        off = points[some[:_JUDGED]] @ normal.T - (corner * normal).sum(1)
        best = int((np.abs(off) < thick).sum(0).argmax())
        near = points[left[np.abs((points[left] - corner[best]) @ normal[best]) < thick]]
        own = np.linalg.svd(near - near.mean(axis=0), full_matrices=False)[2][2]
        of_it = np.abs((points[left] - near.mean(axis=0)) @ own) < thick
        if of_it.sum() < _LEAST * len(points):
            break
        found.append((own, left[of_it]))
        left = left[~of_it]
    return sorted(found, key=lambda plane: -len(plane[1]))


def of_planes(points: Array) -> Articulation:
    """See the module."""
    found = planes(points)
    if not found:
        raise ArtsimError("there is no plane", "points", "see more of the object")
    part, first = np.full(len(points), -1), found[0][0]
    joints = [("free", np.zeros(3), np.zeros(3))]
    root = [plane for n, plane in enumerate(found) if n == 0 or abs(plane[0] @ first) < np.sin(_PARALLEL)]
    part[np.concatenate([own for _, own in root])] = 0
    for normal, own in found:
        if part[own[0]] == 0:
            continue
        part[own], middle = len(joints), points[own].mean(axis=0)
        if any(abs(normal @ other) > np.cos(_PARALLEL) for other, _ in root):
            joints.append(("prismatic", normal, middle))
        else:
            lines = [_meeting(normal, middle, other, points[points_of].mean(axis=0)) for other, points_of in root]
            joints.append(("revolute", *min(lines, key=lambda line: float(np.linalg.norm(line[1] - middle)))))
    part = part[known := np.flatnonzero(part >= 0)][cKDTree(points[known]).query(points)[1]]
    kinds, axes, origins = zip(*joints, strict=True)
    parents = np.array([-1] + [0] * (len(joints) - 1))
    return Articulation(part, kinds, parents, np.array(axes), np.array(origins), np.zeros(len(joints)))


def _meeting(normal_a: Array, point_a: Array, normal_b: Array, point_b: Array) -> tuple[Array, Array]:
    """Direction of the line where two planes meet, and the point of it that is nearest to ``point_a``."""
    along = np.cross(normal_a, normal_b)
    along /= np.linalg.norm(along)
    rows = np.array([normal_a, normal_b, along])
    return along, np.linalg.solve(rows, [normal_a @ point_a, normal_b @ point_b, along @ point_a])


class Nearest:
    """The nearest view of the families trained on; see the module."""

    def __init__(self) -> None:
        objects, views = _REFERENCES
        options = SampleOptions(num_points=4 * _FITTED)
        self.samples = [
            sample
            for name in track("references", trained(), unit="family", leave=False)
            for sample in samples_of(objects_of([name], objects, 0, "any"), views, options, 0)
        ]
        self.clouds = np.array([self.at_size_1(sample.points[::4]) for sample in self.samples])
        self.trees = [cKDTree(cloud) for cloud in self.clouds]

    @staticmethod
    def at_size_1(points: NDArray[np.floating]) -> Array:
        """Points (N, 3) about their mean, at a root mean square distance of 1."""
        about = points.astype(np.float64) - points.mean(axis=0)
        return about / np.sqrt((about**2).sum(axis=1).mean())

    def __call__(self, points: Array) -> Articulation:
        """The articulation of the view that is nearest to a cloud."""
        some = points[:: len(points) // _FITTED]
        alike = self.at_size_1(some)
        there = np.array([tree.query(alike)[0].mean() for tree in self.trees])
        sample = self.samples[int((there + cKDTree(alike).query(self.clouds)[0].mean(axis=1)).argmin())]
        truth, cloud = Articulation.of(sample), sample.points.astype(np.float64)
        placed, aim = self.at_size_1(cloud), alike
        for _ in range(_ITERATIONS):  # the first pairs are those at size 1
            fit = umeyama(cloud[cKDTree(placed).query(aim)[1]], some)
            placed, aim = fit(cloud), some
        grown = np.where(np.array(truth.joint_type) == "prismatic", fit.scale, 1.0)
        return Articulation(
            truth.part[cKDTree(placed).query(points)[1]], truth.joint_type, truth.joint_parent,
            truth.joint_axis @ fit.rotation.T, fit(truth.joint_origin), grown * truth.travel,
        )  # fmt: skip


def tested(category: str, options: Options) -> dict[str, list[Sample]]:
    """A view of each object of the dev half, and of each procedural one."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if category not in REAL:
        raise ConfigError(f"there is no real {category!r}", "--categories", f"use some of {', '.join(sorted(REAL))}")
    if folder is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    split = read_split(Path(__file__).parent / "splits" / "partnet_dev.json")
    return {
        "real": samples_of(real_objects(category, Path(folder), split, "dev"), 1),
        "procedural": samples_of(objects_of([category], options.procedural, TEST_SEEDS, "any"), 1),
    }


def score(way: Way, samples: Sequence[Sample]) -> tuple[Array, Array]:
    """Compare what one way says of some views.

    Returns
    -------
    parts : (P, 7) float
        Of each moving part that counts: type right, body, unmatched, axis, origin, IoU, whether the true joint turns.
    views : (V, 4) float
        :class:`PartDistances` of each view.
    """
    parts, views = [np.zeros((0, 7))], []
    for sample in samples:
        points, truth = sample.points.astype(np.float64), Articulation.of(sample)
        try:
            estimate = way(points)
        except ArtsimError:
            estimate = None
        views.append(part_distances(estimate, truth, points, sample.T_camera_part[0, :3, :3]))
        k, partner, iou, right, axis, origin = joint_errors(estimate, truth, points)
        span, away = np.ptp(sample.joint_limits[k], axis=1), np.abs(sample.joint_state[k] - sample.joint_rest[k])
        moved = (span > 0) & (~np.isfinite(span) | (away >= _SHUT * span))
        turns = [not truth.slides(part) for part in k]
        rows = np.column_stack([right, ~right & (partner == 0), partner < 0, axis, origin, iou, turns])
        parts.append(rows[moved])
    return np.concatenate(parts), np.array(views)


def figures(scores: Sequence[tuple[Array, Array]]) -> dict[str, float | None]:
    """What the table shows of some scores; None where there is no such part."""
    parts, views = (np.concatenate(arrays) for arrays in zip(*scores, strict=True))
    right, body, unmatched, axis, origin, iou, turns = parts.T

    def median(values: Array) -> float:
        return float(np.median(values)) if len(values) else np.nan

    shares = {"type": right, "unmatched": unmatched, "body": body, "other type": 1 - right - unmatched - body,
              "IoU": iou, "turning": turns}  # fmt: skip
    found = {name: 100 * float(share.mean()) if len(share) else np.nan for name, share in shares.items()}
    found |= {"axis": median(axis), "axis if right": median(axis[right > 0]), "origin": 100 * median(origin[turns > 0])}
    distances = zip(("gIoU", "gIoU open", "chamfer", "chamfer open"), views.mean(axis=0), strict=True)
    rounded = {name: round(value, 1) if np.isfinite(value) else None for name, value in found.items()}
    return {"views": len(views), "parts": len(parts), **rounded, **{name: round(float(v), 3) for name, v in distances}}


def main(options: Options) -> None:
    """Measure and print."""
    names = options.categories or held_out()
    samples = {name: tested(name, options) for name in track("objects", names, unit="family")}
    estimator = find_estimator(None, options.estimator)
    ways: dict[str, Way] = {
        options.estimator: lambda points: Articulation.of(estimator(points)), "planes": of_planes, "nearest": Nearest()
    }  # fmt: skip
    scored = {
        name: {row: {way: score(ways[way], own) for way in ways} for row, own in samples[name].items()}
        for name in track("families", names, unit="family")
    }
    result: dict[str, dict[str, dict[str, Any]]] = {}
    for row, way in product(("real", "procedural"), ways):
        of_each = {name: [by_row[row][way]] for name, by_row in scored.items()}
        named = {"all": [one for (one,) in of_each.values()], **(of_each if way == options.estimator else {})}
        found = {name: figures(scores) for name, scores in named.items()}
        result.setdefault(row, {})[way] = found
        if len(result) == 1 and way == options.estimator:
            print(" " * 38 + "".join(f"{column:>{len(column) + 3}s}" for column in found["all"]))
        for name, values in found.items():
            cells = [f"{'-' if value is None else value:>{len(column) + 3}}" for column, value in values.items()]
            print(f"{row:12s}{way:10s}{name:16s}{''.join(cells)}")
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
