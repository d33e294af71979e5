"""How steps of Levenberg and Marquardt are damped, and when a shape is set free."""

from __future__ import annotations

RIGID_ITERATIONS = 2
"""First iterations that keep the reference's shape: a shape that is free at once makes up for a wrong pose."""
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-3, 1e8
"""Of the first step, and bounds: below the least, steps are those of Gauss-Newton."""
DAMPING_FALL, DAMPING_RISE = 0.3, 10.0
"""Factors after a step that lowers the energy, and after one that fails."""
