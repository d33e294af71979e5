"""Hypotheses of where an object is: each generator proposes some, all are scored and fitted alike.

A generator takes what is known of one cloud (:class:`Context`) and the best fit so far, if there is one. It returns
hypotheses, or None where it has nothing to add.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import torch
from torch import Tensor

from artperl.core.batch import concatenate
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta
from artperl.core.references import References
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.fitting import beam_search, initial_pose
from artperl.fitting.options import EstimatorOptions
from artperl.perception.network import Perceived

_CHAIN = 3
"""Joints one after another from which parts below have to tell how those above have turned."""
_BEAM_HYPOTHESES = 8
"""Ends of the beam search that are refined."""
_HINGE_STATES = 8
"""States of a joint by which a root that hardly shows is placed."""
_MOST_WEIGHT = 8.0
"""Weight of a point of a hardly visible part against one of the part with most points."""
_QUARTERS = rotation_from_vector(0.5 * torch.pi * torch.tensor([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]]))
"""(4, 3, 3) quarter turns about the vertical."""
_FLIP = torch.diag(torch.tensor([1.0, -1.0, -1.0]))
"""Half a turn about x: what is upside down stands."""


@dataclass(frozen=True, eq=False)
class Context:
    """What is known of one cloud."""

    cloud: Tensor
    """(1, N, 3) float. Camera frame, metres, in random order."""
    clouds: Clouds
    """The same at a common place and size."""
    perceived: Perceived
    references: References
    options: EstimatorOptions

    @cached_property
    def start(self) -> tuple[Shapes, Theta]:
        """The references with the perceived boxes, and the states that bring them nearest to the points."""
        shapes, few = self.references.shapes, slice(self.options.fit_points)
        clouds = replace(self.clouds, points=self.clouds.points[:, few])
        return initial_pose.start(clouds, self.perceived.of_points(few), shapes, len(shapes))

    @cached_property
    def has_chain(self) -> bool:
        """Whether joints form a chain, in which a state counts only together with those above and below it."""
        return bool(self.options.beam) and int(self.start[0][:1].trees.depth[0].max()) >= _CHAIN

    @cached_property
    def observed(self) -> Observed:
        """The points that references are fitted to, labelled by perception."""
        part = self.perceived.part[:, : self.options.fit_points]
        return Observed.of(self.cloud[:, : self.options.fit_points], part, part_weights(part))


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """H references, each in a state."""

    shapes: Shapes
    """H rows."""
    theta: Theta
    """H rows."""
    row: list[int]
    """Of the base."""

    @staticmethod
    def join(several: Sequence[Hypotheses]) -> Hypotheses:
        """All of several sets, in their order."""
        return Hypotheses(
            concatenate([h.shapes for h in several]), concatenate([h.theta for h in several]),
            [row for h in several for row in h.row],
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Fit:
    """The best fit to one cloud: records of one row."""

    shapes: Shapes
    observed: Observed
    """The cloud, labelled by perception and by how near the fitted parts are."""
    start: Theta
    theta: Theta
    """The hypothesis, and where it ends."""
    row: int
    """Of the base."""
    residual: float
    """Root of the mean robust squared distance from the reference, in diagonals, weighed by part."""
    disagreement: float
    """Median distance between where perception and the fit place the points in the rest frame, over the diagonal."""
    outside: bool
    """Whether the object would be seen from elsewhere than the camera is known to be."""

    def to(self, device: torch.device | str) -> Fit:
        """The fit on another device."""
        return replace(
            self, shapes=self.shapes.to(device), observed=self.observed.to(device), start=self.start.to(device),
            theta=self.theta.to(device),
        )  # fmt: skip


def perceived_pose(context: Context, best: Fit | None) -> Hypotheses:
    """References where perception places the points in the rest frame."""
    shapes, theta = context.start
    return Hypotheses(shapes, theta, context.references.row.tolist())


def hinged_root(context: Context, best: Fit | None) -> Hypotheses | None:
    """The first reference, its hardly visible root where the part with most points lets it be."""
    shapes, theta = context.start[0][:1], context.start[1][:1]
    states = initial_pose.starts_by_another_part(context.clouds, context.perceived, shapes, theta, _HINGE_STATES)
    return None if states is None else _of_first(context, shapes, states)


def chain_states(context: Context, best: Fit | None) -> Hypotheses | None:
    """The first reference in the states that a beam search finds, where joints form a chain."""
    options = context.options
    if not context.has_chain:
        return None
    shapes, theta = context.start[0][:1], context.start[1][:1]
    probability = context.perceived.part_probability[..., : shapes.trees.num_rows]
    states = beam_search.beam(
        shapes, context.cloud, probability, theta, _BEAM_HYPOTHESES, options.beam, options.refine
    )  # fmt: skip
    return _of_first(context, shapes, states)


def half_turn(context: Context, best: Fit | None) -> Hypotheses | None:
    """The best fit with a shoulder or a wrist bent the other way."""
    if best is None or not context.options.beam:
        return None
    states = beam_search.half_turns(best.shapes, best.theta)
    return None if states is None else Hypotheses(best.shapes.repeat(len(states)), states, [best.row] * len(states))


def other_sides(context: Context, best: Fit | None) -> Hypotheses | None:
    """The best fit, standing, by quarter turns about its vertical, if it is seen from where the camera is not.

    A shut cabinet looks much the same from behind, from its side, and upside down.
    """
    if best is None or not best.outside:
        return None
    from_camera = rotate(best.theta.rotation.mT, best.theta.translation)
    stand = _FLIP if from_camera[0, 2] > 0.0 else torch.eye(3)
    turns = (stand @ _QUARTERS).to(best.theta.rotation)
    theta = best.theta.repeat(len(turns))
    theta = replace(theta, rotation=theta.rotation @ turns)
    return Hypotheses(best.shapes.repeat(len(turns)), theta, [best.row] * len(turns))


def _of_first(context: Context, shapes: Shapes, states: Theta) -> Hypotheses:
    """The first reference in several states."""
    return Hypotheses(shapes.repeat(len(states)), states, [int(context.references.row[0])] * len(states))


def part_weights(part: Tensor) -> Tensor:
    """(B, N) weights of points of such parts (B, N): a part counts by the root of how many points it has.

    If all points counted alike, a temple that is seen from its end would have no say against the frame.
    """
    count = torch.nn.functional.one_hot(part).sum(1)
    weight = (count.amax(1, keepdim=True) / count.clamp(min=1)).sqrt().clamp(max=_MOST_WEIGHT)
    return weight.gather(1, part)
