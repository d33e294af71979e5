"""Whether an estimate says in which ways a part may open: ``python -m benchmarks.ways``.

Real objects of the dev half, or procedural test objects, before the camera; the estimator ``generic``. Of moving parts
that are told apart from others: in how many the true way (:data:`artperl.core.ways.WAYS`) is the likeliest, or one of
the likeliest two; how often *the joint* of the estimate opens that way; *off* is the calibration error of the
likeliest. *shut* is of parts less than 2 % open alone. The last line is one JSON object.

``--fit`` prints the constants of :mod:`artperl.core.ways` from procedural furniture that nothing is learnt from.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import tyro
from scipy.optimize import minimize
from scipy.special import log_softmax

from artperl.core.clock import Clock
from artperl.core.clouds import Clouds, joint_rows
from artperl.core.ways import WAYS, way_chances, ways_of
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.reliability import calibration_error
from artperl.evaluation.samples import VALIDATION_SEEDS, frozen_samples
from artperl.methods.full import Estimator
from artperl.perception.network import Perceived
from artperl.perception.part_grouping import PerceivedTree
from artperl.perception.preprocess import Cloud
from artsim.common.progress import track
from artsim.errors import ArtsimError
from artsim.observing.sample import Sample
from benchmarks.furniture import SEEN, SHUT, Array, Views, openness, tested

FITTED = ("storage_furniture", "drawer", "dishwasher")
"""Categories with fronts that the estimator has learnt."""
_HELD = 0.3
"""How firmly constants are held at 0."""


@dataclass(frozen=True)
class Options(Views):
    """Views, or what to fit to."""

    views: int = 4
    fit: int = 0
    """Procedural objects of each of :data:`FITTED` to fit constants to, instead of measuring."""


@dataclass(frozen=True)
class Part:
    """A part that is told apart."""

    true: int
    """Its way."""
    joint: int
    """That of the estimate's joint."""
    open: float
    distances: Array
    """(W, 2) of votes."""


@dataclass(kw_only=True)
class Telling(Estimator):
    """An estimator that keeps what it has perceived."""

    seen: Perceived | None = None

    def _perceive_own(self, cloud: Cloud, clock: Clock) -> tuple[Cloud, Clouds, Perceived, float]:
        cloud, clouds, self.seen, share = super()._perceive_own(cloud, clock)
        return cloud, clouds, self.seen, share


def parts_told(estimator: Telling, samples: Iterable[Sample]) -> Iterator[Part]:
    """Moving parts that estimates tell apart from others."""
    for sample in track("estimating", samples, unit="view", leave=False):
        try:
            estimate = estimator(sample.points)
        except ArtsimError:
            continue
        assert isinstance(estimator.seen, PerceivedTree)
        true = ways_of(
            joint_rows(sample.joint_type, sample.joint_axis, sample.joint_origin, sample.box_center, sample.diagonal)
        )
        back = np.swapaxes(estimate.rotation, 1, 2)
        axis, origin, center = (
            (back @ values[..., None])[..., 0]
            for values in (estimate.joint_axis, estimate.joint_origin, estimate.translation)
        )
        own = ways_of(joint_rows(estimate.joint_type, axis, origin, center, sample.diagonal))
        for k in range(1, len(true)):
            taken = estimate.part[sample.part == k]
            m = int(np.bincount(taken[taken >= 0], minlength=1).argmax())
            if m and true[k] >= 0 and len(taken) >= SEEN and 2 * (taken == m).sum() >= (estimate.part == m).sum():
                yield Part(true[k], own[m], openness(sample, k), estimator.seen.way_distance[0, m].double().numpy())


def measure(parts: list[Part]) -> dict[str, Any]:
    """Shares of parts, in percent."""
    true, chance = np.array([part.true for part in parts]), way_chances(np.stack([part.distances for part in parts]))
    place = (chance > chance[np.arange(len(true)), true][:, None]).sum(axis=1)
    row = {
        "parts": len(parts), "the joint": np.mean([part.joint == part.true for part in parts]),
        "likeliest": np.mean(place == 0), "likeliest two": np.mean(place < 2),
        "off": calibration_error(chance.max(axis=1), place == 0),
    }  # fmt: skip
    shut = np.array([part.open < SHUT for part in parts])
    if shut.any():
        row |= {"shut": int(shut.sum()), "shut, likeliest": np.mean(place[shut] == 0)}
        row |= {"shut, likeliest two": np.mean(place[shut] < 2)}
    return {name: value if isinstance(value, int) else round(100 * float(value), 1) for name, value in row.items()}


def fit(parts: list[Part]) -> tuple[Array, Array]:
    """Sharpness (2,) and log-odds (W,): multinomial logistic regression."""
    true, distances = np.array([part.true for part in parts]), np.stack([part.distances for part in parts])

    def cost(values: Array) -> float:
        chance = log_softmax(values[2:] - distances @ values[:2], axis=1)
        return float(-chance[np.arange(len(true)), true].sum() + 0.5 * _HELD * (values[2:] ** 2).sum())

    found: Array = minimize(cost, np.concatenate([np.ones(2), np.zeros(len(WAYS))])).x
    return found[:2], found[2:]


def main(options: Options) -> None:
    """Measure, or fit, and print."""
    estimator = find_estimator(None, options.estimator)
    telling = Telling(**vars(estimator))
    if options.fit:
        rows = estimator.perception.num_rows
        samples = frozen_samples(FITTED, options.fit, 2, None, VALIDATION_SEEDS, "any", rows)
        parts = list(parts_told(telling, samples))
        for name, values in zip(("sharpness", "usual"), fit(parts), strict=True):
            print(f"{name}: {values.round(1).tolist()}")
        return
    result: dict[str, dict[str, Any]] = {}
    columns = ("parts", "the joint", "likeliest", "likeliest two", "off", "shut", "shut, likeliest",
               "shut, likeliest two")  # fmt: skip
    print(f"{'%':20s}" + "".join(f"{name:>21s}" for name in columns))
    for category in options.categories:
        found = list(parts_told(telling, tested(category, options)[0]))
        row = result[category] = measure(found)
        print(f"{category:20s}" + "".join(f"{row.get(name, 0):21g}" for name in columns), flush=True)
    print(json.dumps(result))


if __name__ == "__main__":
    torch.set_grad_enabled(False)
    main(tyro.cli(Options, description=__doc__))
