"""Why parts of furniture and appliances are not found: ``python -m benchmarks.furniture``.

Real objects of the dev half, or procedural test objects, before the camera; the estimator ``generic``. Each moving part
counts once, by the first of these that holds:

- *right*: a part of the estimate is within 10 degrees and 5 % of the diagonal of it;
- *hidden*: fewer than 20 of 8,192 points show it; *shut*: it is seen, but less than 2 % open;
- *body*: most of its points are taken for the root;
- *merged*: the estimated part that most of its points go to has more points of others;
- *type*, *axis*, *turn*, *box*: it is a part of its own, whose joint is of another type or more than 10 degrees off,
  that is turned by more than 10 degrees, or whose box is elsewhere.

``--told`` says what an estimate would reach if perception said one thing right: *level* (which points are of the root,
of what hangs on it ...), *box*, *joint*, or all three (*votes*). *found* is the mean share of parts that are right, of
all that there are or are said to be. *AUROC* and *off* are of the confidence of parts: whether it tells right ones
from wrong ones, and its expected calibration error. The last line is one JSON object.
"""

import json
import os
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import torch
import tyro
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate
from artperl.data.categories import objects_of
from artperl.data.truth import to_batch, training_rows
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.metrics import direction_error, rotation_error, translation_error, true_poses
from artperl.evaluation.reliability import confidence_figures
from artperl.evaluation.samples import TEST_SEEDS, samples_of
from artperl.evaluation.scoring import LooksSame, found_share, match_parts, object_symmetries
from artperl.methods.full import Estimator
from artperl.perception.network import Perceived, Votes
from artsim.checks.realism import read_split, real_objects
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

Array = NDArray[np.float64]
Told = Literal["nothing", "level", "box", "joint", "votes"]
CATEGORIES = ("storage_furniture", "table", "refrigerator", "safe", "microwave", "oven")
CAUSES = ("right", "hidden", "shut", "body", "merged", "type", "axis", "turn", "box", "failed")
SEEN, SHUT = 20, 0.02
"""Points from which a part is seen, and share of its range below which it is shut."""
_DEGREES, _DIAGONALS = 10.0, 0.05


@dataclass(frozen=True)
class Views:
    """Which objects, and how often each is seen."""

    categories: tuple[str, ...] = CATEGORIES
    estimator: str = "generic"
    views: int = 2
    """Of each object."""
    procedural: int = 0
    """Procedural test objects of each category, instead of the real ones of the dev half."""


@dataclass(frozen=True)
class Options(Views):
    """Views, and what the estimator is told."""

    told: tuple[Told, ...] = get_args(Told)


@dataclass(kw_only=True)
class Oracle(Estimator):
    """An estimator whose votes are mended by the truth of one sample."""

    sample: Sample
    told: Told

    def perceive(self, clouds: Clouds, clock: Clock) -> tuple[Perceived | Votes, NDArray[np.float64]]:
        """What is perceived, but for what is told."""
        seen, own = super().perceive(clouds, clock)
        assert isinstance(seen, Votes)
        rows = training_rows(
            self.sample, len(self.sample.points), max(self.perception.num_rows, len(self.sample.box_size))
        )
        _, truth = to_batch({name: torch.as_tensor(np.asarray(value))[None] for name, value in rows.items()})
        metres = (clouds.points[0] * clouds.scale + clouds.center).cpu().numpy()
        nearest = cKDTree(self.sample.points).query(metres)[1]
        part = truth.part[0][torch.as_tensor(nearest)]
        box = torch.cat([truth.box_center[0], truth.box_size[0]], dim=-1)[part][None]
        level = truth.level[0][part].clamp(max=seen.level_logits.shape[-1] - 1)
        told: dict[str, Any] = {
            "box": box.to(seen.box), "joint": truth.joint[0][part][None].to(seen.joint),
            "level_logits": 12.0 * torch.nn.functional.one_hot(level, seen.level_logits.shape[-1])[None].to(seen.box),
        }  # fmt: skip
        names = tuple(told) if self.told == "votes" else ("level_logits" if self.told == "level" else self.told,)
        return replace(seen, **{name: told[name] for name in names}), own


def openness(sample: Sample, k: int) -> float:
    """Share of its range that a part is open by; 1 of what turns without end."""
    low, high = sample.joint_limits[k]
    return float(abs(sample.joint_state[k] - sample.joint_rest[k]) / (high - low)) if np.isfinite(high - low) else 1.0


def causes(estimate: Estimate | None, sample: Sample, symmetric: LooksSame) -> list[str]:
    """Of each moving part, why it is not found."""
    moving = [k for k in range(1, len(sample.joint_type)) if np.ptp(sample.joint_limits[k]) > 0]
    if estimate is None:
        return ["failed"] * len(moving)
    right = match_parts(estimate, sample, symmetric)
    rotation, center = true_poses(sample)
    off = rotation_error(estimate.rotation[:, None], rotation[None])
    away = translation_error(estimate.translation[:, None], center[None], sample.diagonal)
    near = (off <= _DEGREES) & (away <= _DIAGONALS) & right[:, None]
    found = []
    for k in moving:
        points = sample.part == k
        taken = estimate.part[points]
        m = int(np.bincount(taken[taken >= 0], minlength=1).argmax())
        own = estimate.part == m
        if near[:, k].any():
            cause = "right"
        elif points.sum() < SEEN:
            cause = "hidden"
        elif openness(sample, k) < SHUT:
            cause = "shut"
        elif m == 0:
            cause = "body"
        elif 2 * (own & points).sum() < own.sum():
            cause = "merged"
        elif estimate.joint_type[m] != sample.joint_type[k]:
            cause = "type"
        elif (
            direction_error(estimate.joint_axis[m] * _sense(estimate, m, sample, k), sample.joint_axis_camera[k])
            > _DEGREES
        ):
            cause = "axis"
        else:
            cause = "turn" if off[m, k] > _DEGREES else "box"
        found.append(cause)
    return found


def _sense(estimate: Estimate, m: int, sample: Sample, k: int) -> float:
    """1 or -1: the way along an axis is a matter of taste."""
    return 1.0 if estimate.joint_axis[m] @ sample.joint_axis_camera[k] >= 0 else -1.0


def real(category: str) -> list[ArticulatedObject]:
    """The real objects of a category's dev half."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if folder is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    split = read_split(Path(__file__).parent / "splits" / "partnet_dev.json")
    return list(real_objects(category, Path(folder), split, "dev"))


def tested(category: str, options: Views) -> tuple[list[Sample], dict[str, LooksSame]]:
    """Views of a category's objects, and how they look the same."""
    made = options.procedural
    objects = objects_of([category], made, TEST_SEEDS, "any") if made else real(category)
    return samples_of(objects, options.views), object_symmetries(objects)


def measure(estimator: Estimator, samples: Sequence[Sample], same: dict[str, LooksSame], told: Told) -> dict[str, Any]:
    """Shares of causes, of views with every part right, and of views with another number of parts."""
    counts: Counter[str] = Counter()
    whole = number = 0
    found = 0.0
    confidence: list[NDArray[np.float64]] = []
    near: list[NDArray[np.bool_]] = []
    for sample in track(f"{samples[0].category}, told {told}", samples, unit="view", leave=False):
        asked = estimator if told == "nothing" else Oracle(**vars(estimator), sample=sample, told=told)
        try:
            estimate = asked(sample.points)
        except ArtsimError:
            estimate = None
        alike_ways = same.get(sample.object_sha256, LooksSame())
        own = causes(estimate, sample, alike_ways)
        if estimate is not None:
            near.append(match_parts(estimate, sample, alike_ways))
            confidence.append(estimate.part_confidence)
            found += found_share(near[-1], sample)
        counts.update(own)
        alike = estimate is not None and len(estimate.state) == len(sample.joint_type)
        number += not alike
        whole += alike and all(cause == "right" for cause in own)
    total = max(sum(counts.values()), 1)
    shares = {cause: round(100 * counts[cause] / total, 1) for cause in CAUSES if counts[cause]}
    views = len(samples)
    sure = confidence_figures(np.concatenate(confidence), np.concatenate(near))
    curve, off = sure["confidence_auroc"], round(100 * sure["calibration_error"], 1)
    return {
        "parts": total, "views": views, **shares, "found": round(100 * found / views, 1),
        "views right": round(100 * whole / views, 1), "other number": round(100 * number / views, 1),
        **({} if curve is None else {"AUROC": round(curve, 2)}), "off": off,
    }  # fmt: skip


def main(options: Options) -> None:
    """Measure and print."""
    estimator = find_estimator(None, options.estimator)
    result: dict[str, dict[str, Any]] = defaultdict(dict)
    columns = ("parts", *CAUSES, "found", "views right", "other number", "AUROC", "off")
    print(f"{'%':20s}{'told':9s}" + "".join(f"{name:>13s}" for name in columns))
    for category in options.categories:
        samples, same = tested(category, options)
        for told in options.told:
            row = result[category][told] = measure(estimator, samples, same, told)
            print(f"{category:20s}{told:9s}" + "".join(f"{row.get(name, 0):13g}" for name in columns), flush=True)
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
