"""Conditions under which an estimator is tested: how objects stand, how they are seen, and what spoils the cloud."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from artperl.evaluation.samples import NUM_POINTS, TEST_SEEDS, samples_of
from artsim.datasets.plan import SampleOptions
from artsim.datasets.sample_options import SensorName
from artsim.model.draws import StateMode, StateOptions, ViewOptions, ViewPreset
from artsim.model.objects import ArticulatedObject
from artsim.observing.interference import interfere
from artsim.observing.sample import Sample


@dataclass(frozen=True)
class Condition:
    """A condition."""

    about: str
    """What it is, for people."""
    noise: SensorName = "none"
    """Depth sensor."""
    states: StateMode = "uniform"
    preset: ViewPreset = "artimage"
    """From where objects are seen."""
    hidden: float = 0.0
    """Share of the points that are cut away on one side."""
    outlier_share: float = 0.0
    """Share of the cloud's points that are of a table, a wall or a neighbour."""
    num_points: int = NUM_POINTS
    """Points of a cloud before it is cut."""


CONDITIONS: dict[str, Condition] = {
    "clean": Condition("from the front, states anywhere"),
    "d435": Condition("as a RealSense D435 sees it", noise="d435"),
    "azure": Condition("as an Azure Kinect sees it", noise="azure"),
    "kinect_v1": Condition("as a Kinect v1 sees it", noise="kinect_v1"),
    "occluded_20": Condition("20 % cut away on one side", hidden=0.2),
    "occluded_40": Condition("40 % cut away on one side", hidden=0.4),
    "occluded_60": Condition("60 % cut away on one side", hidden=0.6),
    "occluded_80": Condition("80 % cut away on one side", hidden=0.8),
    "leak_7": Condition("7 % of the points are of other things", outlier_share=0.07),
    "leak_10": Condition("10 % of the points are of other things", outlier_share=0.1),
    "points_512": Condition("512 points", num_points=512),
    "points_1024": Condition("1,024 points", num_points=1024),
    "points_2048": Condition("2,048 points", num_points=2048),
    "rest": Condition("at rest", states="rest"),
    "sphere": Condition("from all round", preset="sphere"),
}
"""By name, in the order of the table."""


def condition_samples(name: str, objects: Sequence[ArticulatedObject], views: int) -> list[Sample]:
    """Views of objects under a condition: always the same ones.

    Views under conditions with the same states and viewpoints show the same objects from the same places.

    Parameters
    ----------
    name : str
    objects : sequence of ArticulatedObject
    views : int
        In all, at least.
    """
    condition = CONDITIONS[name]
    options = SampleOptions(
        num_points=condition.num_points, noise=condition.noise, states=StateOptions(condition.states),
        views=ViewOptions(preset=condition.preset),
    )  # fmt: skip
    samples = samples_of(objects, -(-views // len(objects)), options)
    if not (condition.hidden or condition.outlier_share):
        return samples
    return [
        interfere(sample, np.random.default_rng([TEST_SEEDS, number]), condition.hidden, condition.outlier_share)
        for number, sample in enumerate(samples)
    ]
