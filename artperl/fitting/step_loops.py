"""Normal equations of the reweighted least squares of one object, and their damped steps, in double precision.

A part moves rigidly and grows about its box centre, whatever the tree. So the Jacobian is a product of two factors: how
a residual changes with the turn about the middle of the cloud (3), motion (3) and growth (3) of its part, and how these
nine numbers change with all parameters. Only parameters that move take part. Columns stand as
:class:`artperl.fitting.columns.Columns` has them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from artperl.fitting.arrays import Array, Indices, Reference, State, Tree, View
from artperl.fitting.correspondence import TANGENT_WEIGHT
from artperl.fitting.match_loops import Posed, Rows
from artsim.common.compiled import compiled


class Equations(NamedTuple):
    """``(J^T W J + precision) step = -gradient`` at one state, for the ``columns`` (d,) that move.

    Attributes
    ----------
    curvature : (d, d) float
        The left side (Gauss-Newton).
    gradient : (d,) float
        Half that of the energy.
    free : (d,) bool
        False for states at a limit beyond which the energy falls: they stay there.
    """

    curvature: Array
    gradient: Array
    free: NDArray[np.bool_]
    columns: Indices


def normal_equations(
    tree: Tree, shape: Reference, view: View, state: State, posed: Posed, rows: Rows, deviations: Array,
    precision: Array, columns: Indices, width: float, rigid: bool, leans: bool,
) -> Equations:  # fmt: skip
    """At the state that was matched, with a robust kernel of a width; ``rigid`` leaves out the shape.

    Parameters
    ----------
    deviations, precision : (D,), (D, D) float
        From the reference's shape, and what they cost.
    columns : (d,) int64
        Of these, those that move.
    """
    size, P = 6 if rigid else 9, len(tree.parent)
    squares, pulls = _sums(shape, view, posed, rows, P, width)
    rates = _part_rates(tree, shape, view, state, posed, rigid, leans, len(deviations))[:, :size, columns] / view.unit
    own = precision[np.ix_(columns, columns)]
    curvature = own + np.tensordot(rates, squares[:, :size, :size] @ rates, axes=([0, 1], [0, 1]))
    gradient = own @ deviations[columns] + np.tensordot(pulls[:, :size], rates)
    joint = columns - 6
    moves = (joint >= 0) & (joint < P)
    joint = np.where(moves, joint, 0)
    low, high = state.state[joint] <= tree.lower[joint], state.state[joint] >= tree.upper[joint]
    free = ~(moves & ((low & (gradient > 0.0)) | (high & (gradient < 0.0))))
    curvature[~free] = 0.0
    curvature[:, ~free] = 0.0
    return Equations(curvature, gradient, free, columns)


@compiled
def _sums(shape: Reference, view: View, posed: Posed, rows: Rows, P: int, width: float) -> tuple[Array, Array]:
    """Weighted sums of products of the residual's rates by the nine numbers of its part, and with the residual.

    (P, 9, 9) and (P, 9).
    """
    squares, pulls, rate, wide = np.zeros((P, 9, 9)), np.zeros((P, 9)), np.empty(9), width * width
    for r in range(len(rows.weight)):
        first, second = rows.residual[r, 0], TANGENT_WEIGHT * rows.residual[r, 1]
        share = wide / (wide + first * first + second * second)
        weight = rows.weight[r] * share * share
        if weight == 0.0:
            continue
        k = rows.part[r]
        x, y, z = (
            rows.point[r, 0] - view.middle[0],
            rows.point[r, 1] - view.middle[1],
            rows.point[r, 2] - view.middle[2],
        )
        for kind in range(2):
            if kind == 0:
                u, v, w, residual = rows.normal[r, 0], rows.normal[r, 1], rows.normal[r, 2], first
            elif second > 0.0:
                u, v, w = rows.tangent[r, 0], rows.tangent[r, 1], rows.tangent[r, 2]
                u, v, w, residual = TANGENT_WEIGHT * u, TANGENT_WEIGHT * v, TANGENT_WEIGHT * w, second
            else:
                continue
            rate[0], rate[1], rate[2] = z * v - y * w, x * w - z * u, y * u - x * v
            rate[3], rate[4], rate[5] = -u, -v, -w
            for i in range(3):
                along = u * posed.rotation[k, 0, i] + v * posed.rotation[k, 1, i] + w * posed.rotation[k, 2, i]
                rate[6 + i] = -along * posed.scale[k, i] * (rows.local[r, i] - shape.box_center[k, i])
            for i in range(9):
                scaled = weight * rate[i]
                pulls[k, i] += scaled * residual
                for j in range(9):
                    squares[k, i, j] += scaled * rate[j]
    return squares, pulls


@compiled
def _part_rates(
    tree: Tree, shape: Reference, view: View, state: State, posed: Posed, rigid: bool, leans: bool, count: int
) -> Array:
    """(P, 9, D) derivatives of the motion and growth of each part by the parameters, so many.

    The moment about a joint's axis is that about the middle less the direction's own about the axis (Pluecker).
    """
    P = len(tree.parent)
    every, axis, arm = np.zeros((P, 9, count)), np.empty(3), np.empty(3)
    for k in range(P):
        rates = every[k]
        for i in range(6):
            rates[i, i] = 1.0
        if not rigid:
            for i in range(3):
                center = np.exp(state.log_scale[i]) * shape.box_center[k, i]
                for x in range(3):
                    rates[3 + x, 6 + P + i] = posed.rotation[k, x, i] * center
                rates[6 + i, 6 + P + i] = 1.0
                rates[6 + i, 9 + P + 3 * k + i] = 1.0
        for j in range(P):
            if not tree.carries[j, k]:
                continue
            above, turn = posed.above[j], tree.turn[j]
            for x in range(3):
                axis[x], arm[x] = 0.0, posed.anchor[j, x] - view.middle[x]
                for i in range(3):
                    axis[x] += above[x, i] * tree.axis[j, i]
                    arm[x] += above[x, i] * posed.origin[j, i]
            column, factor = 6 + tree.source[j], tree.multiplier[j]
            slide = tree.slide[j] * posed.reach[j]
            for x in range(3):
                y, z = (x + 1) % 3, (x + 2) % 3
                rates[x, column] += factor * turn * axis[x]
                rates[3 + x, column] += factor * (slide * axis[x] - turn * (axis[y] * arm[z] - axis[z] * arm[y]))
            if rigid:
                continue
            value = tree.rest[j] + tree.offset[j]
            if tree.multiplier[j] != 0.0:
                value = tree.multiplier[j] * state.state[tree.source[j]] + tree.offset[j]
            step = (value - tree.rest[j]) * tree.slide[j]
            for i in range(3):
                whole = np.exp(state.log_scale[i])
                longer = step * (whole * tree.axis[j, i]) ** 2 / posed.reach[j]
                for x in range(3):
                    anchor = (above[x, i] - posed.rotation[j, x, i]) * whole * tree.origin[j, i]
                    rates[3 + x, 6 + P + i] += anchor + axis[x] * longer
                    rates[3 + x, 9 + 4 * P + 3 * j + i] = above[x, i]
            if leans:
                for i in range(3):
                    column = 9 + 7 * P + 3 * j + i
                    for x in range(3):
                        rates[x, column] = turn * (above[x, i] - posed.rotation[j, x, i])
                    for x in range(3):
                        y, z = (x + 1) % 3, (x + 2) % 3
                        rates[3 + x, column] = rates[z, column] * arm[y] - rates[y, column] * arm[z]
    return every


def damped_step(equations: Equations, damping: float, count: int, total: int) -> tuple[Array, float]:
    """Damped step after Marquardt 1963, and by how much the energy would fall if every point kept its match.

    Parameters
    ----------
    count : int
        Parameters, whether they move or not, by which the mean curvature is counted.
    total : int
        Length of the step.
    """
    curvature, gradient, free, columns = equations
    diagonal, every = curvature.diagonal(), np.zeros(total)
    floor = 1e-6 * diagonal.sum() / count + 1e-30
    step = np.linalg.solve(curvature + np.diag(damping * diagonal + floor + ~free), np.where(free, -gradient, 0.0))
    every[columns] = step
    return every, -float(step @ (2.0 * gradient + curvature @ step))
