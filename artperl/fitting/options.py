"""Options of the method "full"."""

from dataclasses import dataclass, field

from artperl.fitting.refine_options import RefineOptions
from artsim.errors import ConfigError

_COUNTS = ("num_points", "early_points", "fit_points", "references"), 1, 1_000_000
_STEPS = ("early_iterations", "beam"), 0, 10_000
"""Options, and their least and largest values: larger ones take memory, or time, without end."""


@dataclass(frozen=True)
class EstimatorOptions:
    """The pipeline."""

    num_points: int = 1024
    """Points that perception sees, and that are labelled in the end."""
    label_smoothing: bool = True
    """Labels of points on one smooth surface hold together: :mod:`artperl.perception.label_smoothing`."""
    early_points: int = 256
    """Of these, points by which the best start is found."""
    fit_points: int = 2048
    """Of these, points that the best one is fitted to."""
    references: int = 3
    """References that are tried, the nearest first."""
    early_iterations: int = 6
    """Iterations of every start, before the best one is kept."""
    beam: int = 64
    """Mixes of joint states that are followed down a tree with chains of three joints and more; 0 goes without."""
    refine: RefineOptions = field(default_factory=RefineOptions)
    """The last refinement."""
    normal_alignment: bool = True
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
        if self.seen_from is not None and not self.seen_from[0] <= self.seen_from[1]:
            raise ConfigError(f"{self.seen_from} is not a range", "seen_from", "write LOW HIGH, such as -75 75")
