"""The loop of :func:`artperl.fitting.levenberg_marquardt.refine` for one object, over compiled parts.

Torch takes thousands of small operations for what these parts do in one call each.
"""

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from torch import Tensor

from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.fitting.arrays import Array, Reference, State, Tree, View, reference_of, state_of, tree_of, view_of
from artperl.fitting.columns import Columns
from artperl.fitting.correspondence import Target
from artperl.fitting.match_loops import Rows, match, robust_sum
from artperl.fitting.refine_options import (
    DAMPING,
    DAMPING_FALL,
    DAMPING_RISE,
    LEAST_DAMPING,
    MOST_DAMPING,
    RIGID_ITERATIONS,
    RefineOptions,
)
from artperl.fitting.shape_prior import ShapePrior
from artperl.fitting.step_loops import damped_step, normal_equations


@dataclass
class _Problem:
    """One object that is refined."""

    tree: Tree
    shape: Reference
    view: View
    active: Array
    precision: Array
    options: RefineOptions
    rigid: bool

    @property
    def columns(self) -> Columns:
        return Columns(len(self.tree.parent))

    def cost(self, state: State, lean: Array) -> float:
        """Of the shape in a state, whose axes lean: see :class:`ShapePrior`."""
        own = self.deviations(state, lean)
        return float(own @ self.precision @ own)

    def deviations(self, state: State, lean: Array) -> Array:
        """(D,) from the reference's shape; pose and states count as 0."""
        pose = np.zeros(6 + len(state.state))
        every = [pose, state.log_scale, state.stretch.ravel(), state.shift.ravel(), lean.ravel()]
        return np.concatenate(every)[: len(self.active)]

    def leaning(self, lean: Array) -> Tree:
        """The tree with axes that lean by rotation vectors (P, 3)."""
        if not lean.any():
            return self.tree
        return self.tree._replace(axis=Rotation.from_rotvec(lean).apply(self.tree.axis))

    def retract(self, state: State, lean: Array, step: Array) -> tuple[State, Array]:
        """State and lean after a step (D,), columns as :class:`Columns`; states stay within their limits."""
        columns, pivot = self.columns, self.view.middle
        turn = Rotation.from_rotvec(step[:3]).as_matrix()
        limited = np.clip(state.state + step[columns.state], self.tree.lower, self.tree.upper)
        after = State(
            turn @ state.rotation, turn @ (state.translation - pivot) + pivot + step[3:6],
            state.log_scale + step[columns.log_scale], limited,
            state.shift + step[columns.shift].reshape(-1, 3), state.stretch + step[columns.stretch].reshape(-1, 3),
        )  # fmt: skip
        leant = step[columns.lean]
        return after, lean + leant.reshape(-1, 3) if len(leant) else lean

    def refine(self, start: State) -> tuple[State, Array, float, float, int]:
        """State, lean, energy, energy of the start, and steps that changed something."""
        options, current, lean = self.options, start, np.zeros_like(start.shift)
        outline, tree = options.outline_weight, self.tree
        posed, rows = match(tree, self.shape, self.view, start, outline)
        cost = self.cost(start, lean)
        first = energy = _robust_mean(rows, options.robust_end) + cost
        damping, steps, width, equations = DAMPING, 0, options.robust_start, None
        leans = len(self.active) > self.columns.shift.stop
        for i in range(options.iterations):
            rigid = self.rigid or i < RIGID_ITERATIONS
            count = self.columns.state.stop if rigid else len(self.active)
            if equations is None:
                moving = np.flatnonzero(self.active[:count])
                equations = normal_equations(
                    tree, self.shape, self.view, current, posed, rows, self.deviations(current, lean), self.precision,
                    moving, width, rigid, leans,
                )  # fmt: skip
            step, predicted = damped_step(equations, damping, count, len(self.active))
            state, new_lean = self.retract(current, lean, step)
            new_tree = self.leaning(new_lean)
            new_posed, new_rows = match(new_tree, self.shape, self.view, state, outline)
            new_cost = self.cost(state, new_lean)
            before, after = _robust_mean(rows, width) + cost, _robust_mean(new_rows, width) + new_cost
            better = after < before
            if better:
                current, lean, tree, posed, rows, cost = state, new_lean, new_tree, new_posed, new_rows, new_cost
                steps += 1
            settled = width == options.robust_end and not rigid
            decrease = before - after if better else predicted
            factor = DAMPING_FALL if better else DAMPING_RISE
            damping = min(max(factor * damping, LEAST_DAMPING), MOST_DAMPING)
            last_width, width = width, max(options.robust_end, options.narrowing * width)
            if better or width != last_width or i + 1 == RIGID_ITERATIONS:
                equations = None  # they are of another state, of other weights or of fewer parameters
            if settled and decrease < options.tolerance * before:
                break
        energy = _robust_mean(rows, options.robust_end) + cost
        # Steps that lowered the energy of a wider kernel need not have lowered that of the last one.
        if energy < first:
            return current, lean, energy, first, steps
        return start, np.zeros_like(lean), first, first, steps


def _robust_mean(rows: Rows, width: float) -> float:
    return float(robust_sum(rows, 0, len(rows.weight), width))


def refine_each(
    shapes: Shapes, target: Target, start: Theta, prior: ShapePrior, options: RefineOptions, rigid: bool
) -> tuple[Theta, Tensor, Tensor, Tensor, Tensor]:
    """Fields of :class:`artperl.fitting.levenberg_marquardt.Refined` for a batch, one object at a time.

    Parameters are as :func:`artperl.fitting.levenberg_marquardt.refine` has them, prepared.
    """
    found = []
    for b in range(len(shapes)):
        tree, shape, view = tree_of(shapes, b), reference_of(shapes, b), view_of(target, b)
        precision = prior.precision[b].double().cpu().numpy()
        problem = _Problem(tree, shape, view, prior.active[b].cpu().numpy(), precision, options, rigid)
        state, lean, *numbers = problem.refine(state_of(start, b))
        found.append((state, problem.leaning(lean).axis, *numbers))
    states, axes, energy, first, steps = zip(*found, strict=True)
    like = start.state
    theta = Theta(*(torch.from_numpy(np.stack(values)).to(like) for values in zip(*states, strict=True)))
    axis = torch.from_numpy(np.stack(axes)).to(like)
    counts = torch.tensor(steps, device=like.device)
    return theta, axis, torch.tensor(energy).to(like), torch.tensor(first).to(like), counts
