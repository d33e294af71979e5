"""From how far off a pose is still found: by refinement alone, and by the agent and refinement."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import torch
from torch import Tensor

from artperl.agent.actions import MOVE, NUM_AXES, TURN, move
from artperl.core.pose import Theta, clamp_state, pose_parts
from artperl.data.categories import Parts
from artperl.data.fitting_problems import Labels, Problem, Problems, References
from artperl.data.sources import DataOptions
from artperl.evaluation.metrics import rotation_error
from artperl.fitting.hypotheses import agent_steps
from artperl.fitting.levenberg_marquardt import refine
from artperl.methods.full import Estimator

Joints = Literal["halfway", "near"]
"""Where joints begin: in the middle of their range; or off by up to the angle that the whole is turned by (slides: by
the same share of their range as that is of half a turn)."""

ANGLES = (20.0, 40.0, 60.0, 90.0)
_FOUND = 10.0
"""Degrees."""
_COVERED = 0.1
"""Of a part's diagonal."""
_MOVED = 0.2
_POINTS = 256
_SEED = 777


def basin_problem(
    estimator: Estimator,
    categories: Sequence[str],
    parts: Parts = "artimage",
    count: int = 96,
    references: References = "retrieved",
    labels: Labels = "perceived",
) -> Problem:
    """``count`` fresh objects, their points labelled by the estimator's perception or by the truth."""
    return Problems(
        DataOptions(categories, parts), estimator.base, count, estimator.options.num_points, _SEED,
        perception=estimator.perception if labels == "perceived" else None, references=references,
    )[0]  # fmt: skip


def run_basin(
    estimator: Estimator, problem: Problem, say: Callable[[str], None] = print, joints: Joints = "halfway"
) -> list[dict[str, Any]]:
    """Shares of objects of which every part, and of parts that, end within 10 degrees of the best pose of a reference.

    References begin turned about a random axis and moved by up to a fifth of the cloud's radius; of perception, only
    the labels of points are used. They are refined as estimates are: on few points, then on all.

    How far a round part has rolled nobody can see. Where it is can be seen: a part is covered when its surface is on
    average within a tenth of its diagonal of the true one's nearest place (ADI, Hinterstoisser et al. 2012).

    Parameters
    ----------
    estimator : Estimator
        With an agent.
    problem : Problem
        See :func:`basin_problem`.
    say : callable
        Gets the lines.
    joints : Joints

    Returns
    -------
    list of dict
        For each angle of the start; shares of parts under ``parts``, of those that are covered under ``covered``.
    """
    assert estimator.agent is not None
    count = len(problem)
    few = problem.observed.map(lambda tensor: tensor[:, :_POINTS])
    options = estimator.options

    def refine_twice(theta: Theta) -> Theta:
        iterations = min(options.early_iterations, options.refine.iterations)
        early = replace(options.refine, iterations=iterations)
        theta = refine(problem.shapes, few, theta, early, rigid=True).theta
        return refine(problem.shapes, problem.observed, theta, options.refine).theta

    result = []
    for angle in ANGLES:
        start = perturb_goal(problem, np.deg2rad(angle), joints)
        with torch.inference_mode():
            led = agent_steps(estimator.agent, problem.shapes, few, start, options.agent_steps)[-1]
            ends = {"refinement": refine_twice(start), "agent": led, "agent and refinement": refine_twice(led)}
        valid = problem.shapes.trees.valid.numpy()
        near = {name: (_off(problem, end) < _FOUND) | ~valid for name, end in ends.items()}
        found = {name: round(float(right.all(1).mean()), 3) for name, right in near.items()}
        parts = {name: round(float(right[valid].mean()), 3) for name, right in near.items()}
        covered = {name: round(float((_apart(problem, end) < _COVERED)[valid].mean()), 3) for name, end in ends.items()}
        shares = ", ".join(
            f"{name} {100 * found[name]:.0f} % (parts {100 * parts[name]:.0f} %, covered {100 * covered[name]:.0f} %)"
            for name in ends
        )
        say(f"start {angle:.0f} deg off: found by {shares} of {count}")
        result.append({"start_deg": angle, **found, "parts": parts, "covered": covered})
    return result


def perturb_goal(problem: Problem, angle: float, joints: Joints = "halfway") -> Theta:
    """Starts that are turned by an angle, in radians, from the goals."""
    shapes, goal = problem.shapes, problem.goal
    trees, generator = shapes.trees, torch.Generator().manual_seed(_SEED)
    B, P = trees.valid.shape
    plain = replace(goal, shift=torch.zeros_like(goal.shift), stretch=torch.zeros_like(goal.stretch))
    step = torch.zeros(B, P, NUM_AXES)
    axis = torch.nn.functional.normalize(torch.randn(B, 3, generator=generator), dim=-1)
    step[:, 0, TURN] = angle * axis
    step[:, 0, MOVE] = _MOVED * (2.0 * torch.rand(B, 3, generator=generator) - 1.0)
    points = problem.observed.points
    radius = torch.linalg.vector_norm(points - points.mean(1, keepdim=True), dim=-1).amax(1)
    moved = move(shapes, plain, step, radius)
    span = trees.upper - trees.lower
    if joints == "halfway":
        state = torch.where(torch.isfinite(span), 0.5 * (trees.lower + trees.upper), trees.rest)
    else:
        reach = torch.where(trees.turn != 0, angle, span * angle / torch.pi)
        state = moved.state + reach * (2.0 * torch.rand(B, P, generator=generator) - 1.0)
    return replace(moved, state=torch.where(trees.free, clamp_state(trees, state), moved.state))


def _off(problem: Problem, theta: Theta) -> np.ndarray:
    """(B, P) rotation errors, degrees."""
    trees, center = problem.shapes.trees, problem.shapes.box_center

    def rotation(state: Theta) -> Tensor:
        return pose_parts(trees, state, center).rotation.double()

    return rotation_error(rotation(theta).numpy(), rotation(problem.goal).numpy())


def _apart(problem: Problem, theta: Theta) -> np.ndarray:
    """(B, P) mean distance of the surface of each part at the goal from that at ``theta``, over the part's diagonal."""
    shapes = problem.shapes

    def surface(state: Theta) -> Tensor:
        return pose_parts(shapes.trees, state, shapes.box_center).points(shapes.points, shapes.box_center)

    distance = torch.cdist(surface(problem.goal), surface(theta)).amin(-1).mean(-1)
    return (distance / torch.linalg.vector_norm(shapes.box_size, dim=-1).clamp(min=1e-9)).numpy()
