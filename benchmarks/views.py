"""What more views of an object tell: ``python -m benchmarks.views``.

Real objects of the dev half, the estimator ``generic``. Each object stands in random joint states before four cameras,
and in others before a fifth.

- *parts found*: mean share of parts within 10 degrees and 5 % of the diagonal, of all that there are or are said to be.
  Of one view; of clouds *merged* in the first camera's frame; and of ``estimator.views``, which takes the surest of
  the estimates of each view and of all together.
- *type*, *axis*: of parts that show in both frames and have moved by 10 degrees or 5 % of the diagonal, the share whose
  joint turns or slides as it should, and whose axis is within 10 degrees as well. Of single frames; of the *surer* one;
  and of ``estimator.frames`` in it. A part is the estimated one that most of its points go to; the root has no joint.

The last line is one JSON object.
"""

import json
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro
from numpy.typing import ArrayLike

from artperl.core.estimate import Estimate
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.metrics import axis_error
from artperl.evaluation.samples import NUM_POINTS, TEST_SEEDS
from artperl.evaluation.scoring import found_share, match_parts, object_symmetries
from artperl.methods.full import Estimator
from artperl.methods.views import as_one_object, estimate_views
from artsim.common.progress import track
from artsim.errors import ArtsimError
from artsim.model.draws import sample_state, sample_view
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.capture import observe
from artsim.observing.sample import Sample
from benchmarks.furniture import CATEGORIES, real

COUNTS = (1, 2, 4)
_SEEN = 20
_DEGREES, _DIAGONALS = 10.0, 0.05


@dataclass(frozen=True)
class Options:
    """Which objects, and how many of their poses."""

    categories: tuple[str, ...] = CATEGORIES
    estimator: str = "generic"
    draws: int = 1
    """Pairs of joint states of each object."""


def views_of(obj: ArticulatedObject, seed: Sequence[int]) -> tuple[list[Sample], Sample]:
    """Views of an object in the same joint states, and one in others."""
    rng = np.random.default_rng(seed)
    before, after = sample_state(obj, None, rng), sample_state(obj, None, rng)
    states = [before] * max(COUNTS) + [after]
    views = [observe(obj, q, sample_view(obj, q, None, rng), num_points=NUM_POINTS, rng=rng) for q in states]
    return views[:-1], views[-1]


def remembering(estimator: Estimator) -> Callable[[ArrayLike], Estimate]:
    """The estimator, which looks at each cloud once."""
    known: dict[bytes, Estimate] = {}

    def estimate(points: ArrayLike) -> Estimate:
        key = np.asarray(points, np.float64).tobytes()
        if key not in known:
            known[key] = estimator(points)
        return known[key]

    return estimate


def still(estimator: Callable[[ArrayLike], Estimate], views: Sequence[Sample], found: Any) -> dict[str, list[float]]:
    """Share of parts found, by the way of estimating; ``found`` gives it of an estimate in the first camera's frame."""
    poses = np.stack([view.T_world_camera for view in views])
    clouds = [view.points for view in views]
    shares = {"1 view": [found(estimator, clouds[0])]}
    for count in COUNTS[1:]:
        T = invert_transform(poses[0]) @ poses[:count]
        merged = np.concatenate([transform_points(t, cloud) for t, cloud in zip(T, clouds, strict=False)])
        shares[f"{count} merged"] = [found(estimator, merged)]
        shares[f"{count} views"] = [
            found(lambda own: estimate_views(estimator, own, poses[: len(own)]), clouds[:count])
        ]
    return shares


def joints(estimate: Estimate, view: Sample, other: Sample) -> list[tuple[bool, bool]]:
    """Of each true part that moved, whether the type of its joint is right, and whether the axis is, too."""
    right = []
    for k in range(1, len(view.joint_type)):
        slides = view.joint_type[k] == "prismatic"
        moved = abs(view.joint_state[k] - other.joint_state[k])
        if min((view.part == k).sum(), (other.part == k).sum()) < _SEEN:
            continue
        if moved < (_DIAGONALS * view.diagonal if slides else np.deg2rad(_DEGREES)):
            continue
        taken = estimate.part[view.part == k]
        m = int(np.bincount(taken[taken >= 0], minlength=1).argmax())
        kind = m > 0 and (estimate.joint_type[m] == "prismatic") == slides
        near = float(axis_error(estimate.joint_axis[m], view.joint_axis_camera[k])) <= _DEGREES
        right.append((kind, kind and near))
    return right


def moved(estimator: Callable[[ArrayLike], Estimate], frames: Sequence[Sample]) -> dict[str, list[tuple[bool, bool]]]:
    """:func:`joints` by the way of estimating."""
    try:
        alone = [estimator(frame.points) for frame in frames]
    except ArtsimError:
        return {}
    surer = int(np.argmax([estimate.part_confidence.mean() for estimate in alone]))
    this, that = frames[surer], frames[1 - surer]
    return {
        "1 frame": joints(alone[0], *frames) + joints(alone[1], *frames[::-1]),
        "surer frame": joints(alone[surer], this, that),
        "2 frames": joints(as_one_object(alone)[surer], this, that),
    }


def measure(estimator: Estimator, category: str, draws: int) -> dict[str, Any]:
    """Percentages of a category's objects, and how many views and joints they are of."""
    shares: dict[str, list[float]] = defaultdict(list)
    right: dict[str, list[tuple[bool, bool]]] = defaultdict(list)
    objects = real(category)
    same = object_symmetries(objects)
    for n, obj in enumerate(track(category, objects, unit="object", leave=False)):
        for draw in range(draws):
            once = remembering(estimator)
            views, after = views_of(obj, [TEST_SEEDS, n, draw])

            def found(estimate: Any, cloud: Any, first: Sample = views[0]) -> float:
                try:
                    return found_share(match_parts(estimate(cloud), first, same[first.object_sha256]), first)
                except ArtsimError:
                    return 0.0

            for way, own in still(once, views, found).items():
                shares[way] += own
            for way, known in moved(once, [views[0], after]).items():
                right[way] += known
    return {
        "objects": len(objects), "poses": draws * len(objects), "joints": len(right["surer frame"]),
        "found": {way: round(100 * float(np.mean(own)), 1) for way, own in shares.items()},
        "type": {way: round(100 * float(np.mean([kind for kind, _ in own])), 1) for way, own in right.items()},
        "axis": {way: round(100 * float(np.mean([near for _, near in own])), 1) for way, own in right.items()},
    }  # fmt: skip


def mean(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Over poses, or joints, of all categories."""
    total = {name: sum(row[name] for row in rows) for name in ("objects", "poses", "joints")}
    for name, by in (("found", "poses"), ("type", "joints"), ("axis", "joints")):
        weights = [row[by] for row in rows]
        total[name] = {
            way: round(float(np.average([row[name][way] for row in rows], weights=weights)), 1) for way in rows[0][name]
        }
    return total


def main(options: Options) -> None:
    """Measure and print."""
    estimator = find_estimator(None, options.estimator)
    result: dict[str, Any] = {}
    for category in options.categories:
        row = result[category] = measure(estimator, category, options.draws)
        print(line(category, row), flush=True)
    result["all"] = mean(list(result.values()))
    print(line("all", result["all"]))
    print(json.dumps(result))


def line(name: str, row: dict[str, Any]) -> str:
    """One row of the table."""
    told = [f"{what} {way} {value:g}" for what in ("found", "type", "axis") for way, value in row[what].items()]
    return f"{name} ({row['poses']} poses, {row['joints']} joints), %: " + ", ".join(told)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
