"""Figures that papers give for the images of ArtImage and RobotArm: of every method and part, means.

Those of ArtImage are from table 1 of ArtPERL, seconds from its table 2, those of RobotArm from its table 3. DICArt's
are as far as they are known. Rotations are in degrees, translations in units of PartNet-Mobility (RobotArm: metres),
overlaps are those of OMAD's evaluation. Figures that are measured here share no column with them: the images differ.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """Means of one method, by part; empty where they are not known."""

    rotation: tuple[float, ...] = ()
    translation: tuple[float, ...] = ()
    iou: tuple[float, ...] = ()
    """Degrees; PartNet units or metres; 0 to 1."""
    seconds: float | None = None
    """For one cloud, on the machine of the paper."""


TITLES = {
    "ancsh": "A-NCSH", "omad": "OMAD", "sporeagent": "SporeAgent", "artperl": "ArtPERL", "dicart": "DICArt",
    "full": "full",
}  # fmt: skip
"""Names of methods as papers have them."""

ARTIMAGE_PUBLISHED: dict[str, dict[str, Published]] = {
    "laptop": {
        "ancsh": Published((5.3, 5.4), (0.054, 0.043), (0.567, 0.402), 9.0),
        "omad": Published((5.4, 4.3), (0.062, 0.061), (0.435, 0.241), 1.6),
        "sporeagent": Published((14.6, 22.5), (0.120, 0.148), (0.251, 0.135)),
        "artperl": Published((4.9, 4.7), (0.053, 0.066), (0.646, 0.504), 0.9),
        "dicart": Published((3.2, 3.9)),
    },
    "eyeglasses": {
        "ancsh": Published((3.7, 22.3, 23.2), (0.049, 0.313, 0.324), (0.525, 0.402, 0.396), 11.9),
        "omad": Published((4.9, 7.5, 7.5), (0.062, 0.103, 0.104), (0.228, 0.205, 0.214), 2.5),
        "sporeagent": Published((20.8, 42.6, 45.1), (0.198, 0.235, 0.236), (0.095, 0.064, 0.062)),
        "artperl": Published((4.1, 6.2, 6.0), (0.047, 0.095, 0.091), (0.586, 0.465, 0.517), 1.0),
        "dicart": Published((), (0.041, 0.091, 0.083)),
    },
    "dishwasher": {
        "ancsh": Published((4.0, 4.8), (0.059, 0.123), (0.843, 0.562), 5.5),
        "omad": Published((6.0, 6.2), (0.104, 0.142), (0.665, 0.389), 1.6),
        "sporeagent": Published((12.5, 21.5), (0.146, 0.184), (0.438, 0.286)),
        "artperl": Published((3.9, 4.3), (0.055, 0.079), (0.893, 0.676), 0.9),
        "dicart": Published((2.9, 3.7)),
    },
    "scissors": {
        "ancsh": Published((2.0, 2.9), (0.035, 0.025), (0.465, 0.448), 6.5),
        "omad": Published((3.9, 3.4), (0.048, 0.039), (0.356, 0.345), 1.7),
        "sporeagent": Published((9.6, 9.7), (0.087, 0.090), (0.284, 0.280)),
        "artperl": Published((2.2, 2.6), (0.031, 0.042), (0.409, 0.463), 0.8),
        "dicart": Published((1.7, 2.2)),
    },
    "drawer": {
        "ancsh": Published((2.8, 3.5, 3.9, 2.9), (0.045, 0.155, 0.157, 0.075), (0.902, 0.815, 0.784, 0.827), 16.5),
        "omad": Published((4.4, 4.4, 4.4, 4.4), (0.111, 0.143, 0.144, 0.115), (0.758, 0.734, 0.702, 0.713), 1.9),
        "sporeagent": Published((11.2, 19.6, 22.5, 18.8), (0.154, 0.228, 0.275, 0.201), (0.603, 0.242, 0.107, 0.244)),
        "artperl": Published((3.5, 3.5, 3.5, 3.5), (0.061, 0.112, 0.121, 0.104), (0.848, 0.786, 0.790, 0.812), 1.1),
        "dicart": Published((1.7, 1.7, 1.7, 1.7)),
    },
}  # fmt: skip
"""By category and method."""

ROBOTARM_PUBLISHED: dict[str, Published] = {
    "ancsh": Published((7.8, 7.9, 10.3, 10.5, 11.2, 16.4, 23.5), (0.012, 0.044, 0.067, 0.066, 0.079, 0.236, 0.403)),
    "artperl": Published((5.7, 5.9, 5.8, 8.4, 10.1, 12.5, 19.6), (0.008, 0.012, 0.014, 0.037, 0.058, 0.136, 0.225)),
}
"""By method, of real depth images of one arm of seven parts."""
