"""How a reference is fitted by :func:`artperl.fitting.levenberg_marquardt.refine`."""

from dataclasses import dataclass

from artsim.errors import ConfigError

RIGID_ITERATIONS = 2
"""First iterations that keep the reference's shape: a shape that is free at once makes up for a wrong pose."""
DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e-3, 1e8
"""Of the first step, and bounds: below the least, steps are those of Gauss-Newton."""
DAMPING_FALL, DAMPING_RISE = 0.3, 10.0
"""Factors after a step that lowers the energy, and after one that fails."""


@dataclass(frozen=True)
class RefineOptions:
    """Lengths are in diagonals of the observed object.

    A sigma is the standard deviation of a property of the object from its reference's.
    """

    iterations: int = 20
    """At most; fewer when nothing improves any more, and none to leave the start as it is."""
    robust_start: float = 0.2
    robust_end: float = 0.03
    narrowing: float = 0.6
    """Width of the robust kernel (Geman-McClure): at first, at last, and its share kept per iteration."""
    sigma_scale: float = 0.3
    """Logarithm of the overall scale."""
    sigma_aspect: float = 0.2
    """Logarithm of the scale along each axis against the overall scale."""
    sigma_stretch: float = 0.1
    """Logarithm of a part's own scale against that of the whole."""
    sigma_shift: float = 0.1
    """Position of a joint's anchor."""
    outline_weight: float = 0.3
    """Weight of the reference's points outside the cloud's outline against that of the cloud's points."""
    prior_weight: float = 5e-6
    """Squared distance that a deviation of one sigma costs."""
    tolerance: float = 1e-3
    """Relative decrease of the energy, made by a step or predicted for one that failed, at which an object is done."""

    def __post_init__(self) -> None:
        if not 0 <= self.iterations <= 10_000:
            raise ConfigError(f"{self.iterations} is not within 0 to 10000", "iterations")
        if not 0.0 < self.robust_end <= self.robust_start:
            raise ConfigError("kernels narrow", "robust_end", "use 0 < robust_end <= robust_start")
        if not min(self.sigma_scale, self.sigma_aspect, self.sigma_stretch, self.sigma_shift) > 0.0:
            raise ConfigError("a sigma is not above 0", "sigma", "use a small one to keep the reference's shape")
