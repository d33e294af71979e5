"""One truth of several: of an object that looks the same turned round, the one whose front is towards the camera.

A network that is told now this and now that of two views that look alike learns their mean, which is neither.
"""

from collections.abc import Callable, Sequence

import numpy as np

from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.observing.symmetry import Symmetry, equivalent_sample, symmetries

_FRONT = np.array([-1.0, 0.31, 0.17])
"""Objects have their front at -X. The other two numbers decide where no front is nearer: any but 0 would do."""


class Facing:
    """Symmetries of the object of a sample. Those of the last one are kept: views of one object follow one another."""

    def __init__(self) -> None:
        self._last: tuple[str, tuple[Symmetry, ...]] = ("", ())

    def __call__(self, sample: Sample, load: Callable[[], ArticulatedObject]) -> Sample:
        """The sample as :func:`facing` has it; ``load`` gives its object, which takes long where it is a file."""
        if self._last[0] != sample.object_sha256:
            self._last = sample.object_sha256, symmetries(load())
        return facing(sample, self._last[1])


def facing(sample: Sample, symmetric: Sequence[Symmetry]) -> Sample:
    """The sample, its truth written in that one of equal ways in which the camera is most in front of the root.

    Parameters
    ----------
    sample : Sample
    symmetric : sequence of Symmetry
        Of its object.
    """
    return max((sample, *(equivalent_sample(sample, symmetry) for symmetry in symmetric)), key=_in_front)


def _in_front(sample: Sample) -> float:
    """How far the camera is in front of the root, in its rest frame."""
    T_camera_root = sample.T_camera_part[0]
    camera = -T_camera_root[:3, :3].T @ T_camera_root[:3, 3]
    return float(camera @ _FRONT)
