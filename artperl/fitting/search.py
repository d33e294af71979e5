"""The search for the pose that explains a cloud: starts, the agent, refinement, and a second try where that fails.

Perception's own starts, refined, are right for nearly all clouds, and an estimate that does not fit says so by its
residual. Only for such a cloud is it worth looking farther: references that face the camera from several sides are
moved on by the agent, whose steps see the whole of a wrong pose where refinement sees the nearest points alone.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from torch import Tensor

from artperl.agent.actions import expected_action
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Agent
from artperl.core.batch import concatenate
from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotate
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.beam_search import beam, half_turned
from artperl.fitting.initial_pose import by_another_part, facing, start
from artperl.fitting.levenberg_marquardt import Refined, refine
from artperl.fitting.refine_options import RefineOptions
from artperl.perception.network import Perceived
from artperl.perception.part_grouping import Grouped
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.shape_base import ShapeBase, moves, same_axes, weighed
from artsim.errors import ConfigError

_DISAGREEMENT = 0.3
"""Weight of the disagreement with perception against the residual."""
_CLEARLY = 0.8
"""Share of the first estimate's doubt below which a second one takes its place: most others that fit are wrong."""
_NEVER = 1e6
"""Added to the energy, or the doubt, of what would be seen from where the camera is not."""
_CHAIN = 3
"""Joints one after another from which parts below have to tell how those above have turned."""
_BEAM_STARTS = 8
"""Ends of the beam search that are refined."""
_HINGED_STARTS = 8
"""States of a joint by which a root that hardly shows is placed."""
_MOST_WEIGHT = 8.0
"""Weight of a point of a hardly visible part against one of the part with most points."""
_ASTRAY = np.deg2rad(15.0)
"""Arc that a camera may be away from where it is known to be: an estimate need not have it to the degree."""
_BELOW = np.deg2rad(10.0)
"""Below the horizon, from where no standing object is seen."""
_LABEL_DISTANCE = 0.03
"""Distance from the fitted part, in diagonals, that weighs as much against a label as odds of 1 to e."""


_COUNTS = ("num_points", "early_points", "fit_points", "references"), 1, 1_000_000
_STEPS = ("early_iterations", "beam", "agent_steps"), 0, 10_000
"""Options, and their least and largest values: larger ones take memory, or time, without end."""


@dataclass(frozen=True)
class EstimatorOptions:
    """The pipeline."""

    num_points: int = 1024
    """Points that perception sees, and that are labelled in the end."""
    coherent: bool = True
    """Labels of points on one smooth surface hold together: :mod:`artperl.perception.label_smoothing`."""
    early_points: int = 256
    """Of these, points by which the best start is found."""
    fit_points: int = 2048
    """Of these, points that the best one is fitted to."""
    references: int = 3
    """References that are tried, the nearest first."""
    early_iterations: int = 6
    """Iterations of every start, before the best one is kept."""
    perceived_start: bool = True
    """Start from where perception places the points in the rest frame; without, from views all round alone."""
    beam: int = 64
    """Mixes of joint states that are followed down a tree with chains of three joints and more; 0 goes without."""
    retry_residual: float = 0.006
    """Estimates with a larger residual are looked for again, from other starts; infinite for never, 0 for always."""
    azimuths: tuple[float, ...] = (-50.0, 0.0, 50.0)
    """Of these other starts, degrees about the object's vertical, from the middle of :attr:`seen_from`."""
    elevation: float = 35.0
    """Degrees from which the other starts are seen."""
    agent_steps: int = 16
    """Steps of the agent from each of them; 0 goes without it."""
    refine: RefineOptions = field(default_factory=RefineOptions)
    """The last refinement."""
    uncovered: bool = True
    """Parts that hardly show turn to where no more of them would be seen: :mod:`artperl.fitting.occluded_parts`."""
    squared: bool = True
    """In the end, parts turn until their flat surfaces face along their axes:
    :mod:`artperl.fitting.normal_alignment`."""
    seen_from: tuple[float, float] | None = None
    """Azimuths that the camera is known to be within, degrees about the object's vertical: 0 in front of it, 90 to its
    right (its -Y side), as for :class:`artsim.model.draws.ViewOptions`; then the object stands, and is not seen from
    below. None: the camera may be anywhere."""

    def __post_init__(self) -> None:
        for names, least, most in (_COUNTS, _STEPS):
            for name in names:
                if not least <= getattr(self, name) <= most:
                    raise ConfigError(f"{getattr(self, name)} is not within {least} to {most}", name)
        if not self.azimuths or not np.isfinite([*self.azimuths, self.elevation]).all():
            raise ConfigError("starts need finite azimuths and an elevation", "azimuths", "write -50 0 50")
        if self.seen_from is not None and not self.seen_from[0] <= self.seen_from[1]:
            raise ConfigError(f"{self.seen_from} is not a range", "seen_from", "write LOW HIGH, such as -75 75")


@dataclass(frozen=True, eq=False)
class Found:
    """The best fit to one cloud: records of one row.

    Attributes
    ----------
    shapes : Shapes
    observed : Observed
        The cloud, labelled by what perception says and by how near the fitted parts are.
    refined : Refined
    path : list of Theta
        The start, the agent's steps, and the end.
    reference : int
        Row of the base.
    disagreement : float
        Median distance between where perception and the fit place the points in the rest frame, over the diagonal.
    """

    shapes: Shapes
    observed: Observed
    refined: Refined
    path: list[Theta]
    reference: int
    disagreement: float

    def to(self, device: torch.device | str) -> Found:
        """The fit on another device."""
        return replace(
            self, shapes=self.shapes.to(device), observed=self.observed.to(device), refined=self.refined.to(device),
            path=[theta.to(device) for theta in self.path],
        )  # fmt: skip

    def ending(self, theta: Theta) -> Found:
        """The fit with another end."""
        return replace(self, refined=replace(self.refined, theta=theta), path=[*self.path[:-1], theta])

    def astray(self, seen_from: tuple[float, float] | None) -> bool:
        """Whether the object would be seen from elsewhere, see :func:`astray`."""
        return bool(astray(self.refined.theta, seen_from)[0])

    @property
    def residual(self) -> float:
        """Root of the mean robust squared distance from the reference, in diagonals, weighed by :func:`evened`."""
        return float(self.refined.energy[0].clamp(min=0).sqrt())


class Clock:
    """Milliseconds by stage."""

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.milliseconds[stage] = self.milliseconds.get(stage, 0.0) + 1e3 * (time.perf_counter() - begun)


def find(
    cloud: Tensor, clouds: Clouds, perceived: Perceived, base: ShapeBase, agent: Agent | None,
    options: EstimatorOptions, clock: Clock,
) -> Found:  # fmt: skip
    """The best fit to a cloud (1, N, 3) that has been perceived."""
    found = _best(cloud, clouds, perceived, base, agent, options, clock)
    with clock("relabel"):
        observed = Observed.of(cloud, perceived.part)
        part = relabel(found.shapes, observed, found.refined.theta, perceived.part_logits)
    return replace(found, observed=replace(observed, part=part))


def _best(
    cloud: Tensor, clouds: Clouds, perceived: Perceived, base: ShapeBase, agent: Agent | None,
    options: EstimatorOptions, clock: Clock,
) -> Found:  # fmt: skip
    """The best fit, observed by the points that it was fitted to."""
    with clock("start"):
        rows, chosen = references(base, perceived, min(options.references, len(base)))
        shapes, theta = start(clouds, perceived, chosen, len(rows))
        part = perceived.part[:, : options.fit_points]
        observed = Observed.of(cloud[:, : options.fit_points], part, evened(part))
        others = by_another_part(clouds, perceived, shapes[:1], theta[:1], _HINGED_STARTS)
        if options.perceived_start and others is not None:
            shapes, theta, rows = _with_more(shapes, theta, rows, others)
    if options.perceived_start and options.beam and int(shapes.trees.depth[0].max()) >= _CHAIN:
        with clock("beam"):
            ends = beam(
                shapes[:1], cloud, perceived.part_probability[..., : shapes.trees.num_rows], theta[:1], _BEAM_STARTS,
                options.beam, options.refine,
            )  # fmt: skip
            shapes, theta, rows = _with_more(shapes, theta, rows, ends)
    found = None
    if options.perceived_start:
        found = _settle(shapes, observed, perceived, [theta], rows.tolist(), base, options, clock)
        others = half_turned(found.shapes, found.refined.theta) if options.beam else None
        if others is not None:
            many, same = found.shapes.repeat(len(others)), [found.reference] * len(others)
            turned = _settle(many, observed, perceived, [others], same, base, options, clock)
            found = min(found, turned, key=lambda one: (one.astray(options.seen_from), one.residual))
        if found.residual <= options.retry_residual and not found.astray(options.seen_from):
            return found
    with clock("start"):
        first, row = (shapes[:1], int(rows[0])) if found is None else (found.shapes, found.reference)
        shapes, middle = first.repeat(len(options.azimuths)), np.mean(options.seen_from or (0.0, 0.0))
        around = facing(shapes, clouds.center, middle + np.array(options.azimuths), options.elevation)
        if found is not None:
            before = [found.path[0], turned_round(found.refined.theta)]
            shapes, around = concatenate([shapes, first.repeat(2)]), concatenate([around, *before])
        theta = around
    path = [theta]
    with clock("agent"):
        if agent is not None and options.agent_steps:
            few = observed.map(lambda tensor: tensor[:, : options.early_points]).repeat(len(shapes))
            path += agent_steps(agent, shapes, few, theta, options.agent_steps)
    again = _settle(shapes, observed, perceived, path, [row] * len(shapes), base, options, clock)
    if found is None:
        return again
    return again if _doubt(again, options) < _CLEARLY * _doubt(found, options) else found


def _with_more(shapes: Shapes, theta: Theta, rows: Tensor, more: Theta) -> tuple[Shapes, Theta, Tensor]:
    """Starts, and more of the first reference."""
    many, same = shapes[:1].repeat(len(more)), rows[:1].expand(len(more))
    return concatenate([shapes, many]), concatenate([theta, more]), torch.cat([rows, same])


def references(base: ShapeBase, perceived: Perceived, count: int) -> tuple[Tensor, Shapes]:
    """(count,) rows of the objects nearest to what is perceived of one cloud, and their shapes.

    Boxes do not tell how axes lean, and no hinge turns a part to where another one's would: where axes differ, there is
    an object whose axes lean otherwise than those of the nearest, and one with the mean axes. Where parts are found by
    votes, only objects with the same tree will do, and one is composed of the parts of several; its row is that of
    the object that has its root.
    """
    query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
    if isinstance(perceived, Grouped):
        return _references_of_groups(base, perceived, query, count)
    return _leaning(base, query, base.nearest(query, count)[0][0])


def _leaning(base: ShapeBase, query: Tensor, rows: Tensor) -> tuple[Tensor, Shapes]:
    """References whose axes differ, if those of their kind do: the last but the first are for those that lean."""
    otherwise, shapes = base.leaning_otherwise(int(rows[0])), base.shapes[rows]
    if len(rows) < 3 or not bool(otherwise.any()):
        return rows, shapes
    rows = torch.cat([rows[:1], base.nearest(query, 1, otherwise)[0][0], rows[1:-1]])
    shapes = base.shapes[rows]
    axis = torch.cat([shapes.trees.axis[:-1], base.mean_axis[rows[-1:]]])
    return rows, replace(shapes, trees=replace(shapes.trees, axis=axis))


def _references_of_groups(base: ShapeBase, perceived: Grouped, query: Tensor, count: int) -> tuple[Tensor, Shapes]:
    """Up to so many objects with the perceived tree, and one that is composed."""
    trees, K = base.shapes.trees, int(perceived.valid[0].sum())
    tree = (trees.valid == perceived.valid[0]) & (trees.parent == perceived.parent[0])
    joint = (moves(base.joints) == moves(perceived.joint[0])) & same_axes(base.joints, perceived.joint)
    alike = (tree & joint).all(1)
    further = torch.linalg.vector_norm(weighed(base.joints) - weighed(perceived.joint), dim=(1, 2))
    part = perceived.box_center[0, :K], perceived.box_size[0, :K], perceived.joint[0, :K], perceived.parent[0, :K]
    row, own = base.composed(*part)
    rows = torch.tensor([row], device=query.device)
    if not bool(alike.any()):
        return rows, own
    found, shapes = _leaning(base, query, base.nearest(query, min(count, int(alike.sum())), alike, further[None])[0][0])
    return torch.cat([found, rows]), concatenate([shapes, own])


def _doubt(found: Found, options: EstimatorOptions) -> float:
    """What is to be low: a flat part fits a wrong pose just as well, but perception does not agree with that."""
    astray = _NEVER * found.astray(options.seen_from)
    return found.residual + _DISAGREEMENT * found.disagreement + astray


def _settle(
    shapes: Shapes, observed: Observed, perceived: Perceived, path: list[Theta], rows: list[int], base: ShapeBase,
    options: EstimatorOptions, clock: Clock,
) -> Found:  # fmt: skip
    """The best of several starts, and of where the agent led from them, refined; its axes lean as the points say."""
    with clock("refine"):
        ends = [path[0]] if len(path) == 1 else [path[0], path[-1]]
        all_shapes, theta = concatenate([shapes] * len(ends)), concatenate(ends)
        few = observed.map(lambda tensor: tensor[:, : options.early_points]).repeat(len(all_shapes))
        count = min(options.early_iterations, options.refine.iterations)
        early = refine(all_shapes, few, theta, replace(options.refine, iterations=count), rigid=True)
        best = int((early.energy + _NEVER * astray(early.theta, options.seen_from)).argmin())
        own, theta = all_shapes[best : best + 1], early.theta[best : best + 1]
    with clock("relabel"):
        observed = replace(observed, part=relabel(own, observed, theta, perceived.part_logits))
    with clock("last"):
        row = best % len(shapes)
        refined = refine(own, observed, theta, options.refine, axis_prior=base.axis_prior(rows[row]))
        own = replace(own, trees=replace(own.trees, axis=refined.axis))
    steps = path[:1] if best < len(shapes) else path
    way = [*(step[row : row + 1] for step in steps), refined.theta]
    return Found(own, observed, refined, way, rows[row], disagreement(own, observed, refined.theta, perceived))


def disagreement(shapes: Shapes, observed: Observed, theta: Theta, perceived: Perceived) -> float:
    """See :attr:`Found.disagreement`."""
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    part = observed.part[0]
    fitted = ((observed.points[0] - posed.translation[0, part])[:, None] @ posed.rotation[0, part])[:, 0]
    unit = shapes.diagonal[0] * theta.log_scale[0].mean().exp()
    apart = torch.linalg.vector_norm(fitted / unit - perceived.canonical[0, : len(part)], dim=-1)
    return float(apart.median())


def astray(theta: Theta, seen_from: tuple[float, float] | None) -> Tensor:
    """(B,) whether objects would be seen from below or outside a range, see :attr:`EstimatorOptions.seen_from`."""
    if seen_from is None:
        return torch.zeros(len(theta), dtype=torch.bool, device=theta.state.device)
    low, high = np.deg2rad(seen_from)
    x, y, z = rotate(theta.rotation.mT, theta.translation).unbind(-1)  # from the camera to the object, in its frame
    flat = torch.hypot(x, y)
    off = torch.remainder(torch.atan2(y, x) - 0.5 * (low + high) + np.pi, 2.0 * np.pi) - np.pi
    outside: Tensor = (off.abs() - 0.5 * (high - low)).clamp(min=0.0) * flat > _ASTRAY * torch.hypot(flat, z)
    return outside | (torch.atan2(z, flat) > _BELOW + _ASTRAY)


def turned_round(theta: Theta) -> Theta:
    """Objects that stand where they stood, by half a turn about their verticals."""
    return replace(theta, rotation=theta.rotation * theta.rotation.new_tensor([-1.0, -1.0, 1.0]))


def agent_steps(agent: Agent, shapes: Shapes, observed: Observed, theta: Theta, steps: int) -> list[Theta]:
    """States after each of the agent's actions."""
    fitting = Fitting(shapes, observed, theta, FittingOptions(steps=steps))
    path = []
    while not fitting.done:
        fitting.step(expected_action(agent(fitting.view())[0]))
        path.append(fitting.theta)
    return path


def evened(part: Tensor) -> Tensor:
    """(B, N) weights of points of such parts (B, N): a part counts by the root of how many points it has.

    If all points counted alike, a temple that is seen from its end would have no say against the frame.
    """
    count = torch.nn.functional.one_hot(part).sum(1)
    weight = (count.amax(1, keepdim=True) / count.clamp(min=1)).sqrt().clamp(max=_MOST_WEIGHT)
    return weight.gather(1, part)


def relabel(shapes: Shapes, observed: Observed, theta: Theta, logits: Tensor) -> Tensor:
    """(B, N) parts of the observed points, given both what perception says and how near each fitted part is.

    Parameters
    ----------
    logits : (B, >= N, >= P) float
        Perception's.
    """
    N, P = observed.part.shape[1], shapes.trees.num_rows
    points = pose_parts(shapes.trees, theta, shapes.box_center).points(shapes.points, shapes.box_center)
    apart = torch.cdist(observed.points[:, None].expand(-1, P, -1, -1), points).amin(-1).transpose(1, 2)
    apart = apart / (shapes.diagonal[:, None, None] * _LABEL_DISTANCE)
    score = logits[:, :N, :P].log_softmax(-1) - apart**2
    return score.masked_fill(~shapes.has_surface[:, None], -torch.inf).argmax(-1)
