"""Joints under Coulomb friction and motors of limited strength: the speeds at the end of a time step, exactly."""

import numpy as np

from artsim.model.kinematics import Array

_SOFT = 1e-12  # share of the diagonal that keeps rows apart that say the same, as of joints that follow one another


def held_speeds(mass: Array, momentum: Array, rows: Array, target: Array, impulse: Array) -> Array:
    """Speeds after impulses that hold combinations of them at targets, as far as their strength goes.

    Friction holds a joint at 0, a motor at the speed that it is told. The speeds minimise
    ``(v - v0)' M (v - v0) / 2 + sum_j b_j |rows_j v - target_j|`` with ``M v0 = momentum``: the step of an implicit
    integrator under dry friction (Moreau's time stepping).

    Parameters
    ----------
    mass : (F, F) float
        Of the joints, with time step times damping added.
    momentum : (F,) float
    rows : (J, F) float
        Speeds that are held, as combinations of the joints'.
    target, impulse : (J,) float
        What they are held at, and the largest impulse of each: force times time step.

    Returns
    -------
    (F,) float
    """
    free = np.asarray(np.linalg.solve(mass, momentum), dtype=np.float64)
    held = impulse > 0
    if not held.any():
        return free
    rows, target, bound = rows[held], target[held], impulse[held]
    inverse = np.linalg.solve(mass, rows.T)
    weight = rows @ inverse
    weight[np.diag_indices(len(weight))] *= 1.0 + _SOFT
    gap = rows @ free - target
    applied = _bounded(weight, gap, bound)
    return free + inverse @ applied


def _bounded(weight: Array, gap: Array, bound: Array) -> Array:
    """Impulses within +- bound after which ``weight @ x + gap`` is 0, or pushed by a full impulse the other way.

    Which impulses are full is guessed, solved for and mended; where that goes in circles, one at a time is solved for.
    """
    full = np.zeros(len(gap))  # -1, 1: a full impulse; 0: as much as holds
    x = np.zeros(len(gap))
    for _ in range(2 * len(gap) + 4):
        loose = full == 0
        x[~loose] = full[~loose] * bound[~loose]
        if loose.any():
            rest = gap[loose] + weight[np.ix_(loose, ~loose)] @ x[~loose]
            x[loose] = np.linalg.solve(weight[np.ix_(loose, loose)], -rest)
        beyond = loose & (np.abs(x) > bound)
        moved = weight @ x + gap
        wrong = ~loose & (moved * full > 0)  # an impulse that has already done its work
        if not (beyond.any() or wrong.any()):
            return x
        full[wrong] = 0.0
        full[beyond] = np.sign(x[beyond])
    x = np.clip(x, -bound, bound)
    for _ in range(200):
        for j in range(len(x)):
            x[j] = np.clip(x[j] - (weight[j] @ x + gap[j]) / weight[j, j], -bound[j], bound[j])
    return x
