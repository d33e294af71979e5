"""Robots that do the task, by ManiSkill's names, and how each of them begins."""

from dataclasses import dataclass

import numpy as np

FLOATING = "floating_panda_gripper"
NO_ROBOT = "none"
"""Nothing acts on the object but gravity, and whoever sets its state."""


@dataclass(frozen=True)
class Start:
    """How a robot of D joints begins, facing along its x axis."""

    qpos: tuple[float, ...]
    """Fingers come last."""
    fingers: int = 2
    """Joints of the hand."""
    reach: float = 0.0
    """From its base to the foremost point of its collision shapes, metres; 0 for a hand that floats."""
    room: tuple[float, float, float] = (0.2, 0.3, 0.8)
    """(3,) float. Half of what it takes around its base in x and y, and its height, metres: shown by the camera that
    shows all."""


_PANDA = Start((0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4, 0.04, 0.04), reach=0.37)
ROBOTS = {
    "panda": _PANDA,
    "panda_wristcam": _PANDA,
    FLOATING: Start((0.0, 0.0, 0.0, 0.0, np.pi / 2, 0.0, 0.04, 0.04)),
    # x, y and heading; torso; head, shoulder, head, shoulder; upper arm, elbow, forearm, wrist, wrist: the hand level.
    "fetch": Start(
        (0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, -1.0, 0.0, 2.2, 0.0, -1.2, 0.0, 0.04, 0.04), reach=0.8, room=(0.3, 0.3, 1.3)
    ),
    # The hand level; all six joints of its hand at 0 hold it open.
    "xarm6_robotiq": Start((0.0, -0.3, -1.0, 0.0, -0.27, *[0.0] * 7), fingers=6, reach=0.58),
}
