"""How large things of a category are, by which a wrong unit shows."""

from collections.abc import Sequence

USUAL = {
    "bottle": (0.091, 0.51), "box": (0.15, 1.5), "bucket": (0.25, 1.2), "camera": (0.099, 0.27), "cart": (0.9, 2.3),
    "chair": (0.61, 1.2), "clock": (0.053, 2), "coffee_machine": (0.32, 0.93), "cutter": (0.068, 0.31),
    "dishwasher": (0.94, 1.3), "dispenser": (0.12, 1.2), "display": (0.33, 1.7), "door": (2.1, 8.2),
    "drawer": (0.66, 3.4), "eyeglasses": (0.11, 0.18), "fan": (0.4, 1.8), "faucet": (0.15, 0.79),
    "folding_chair": (0.69, 2.2), "folding_knife": (0.067, 0.28), "globe": (0.24, 0.87), "kettle": (0.22, 0.41),
    "keyboard": (0.083, 0.58), "kitchen_pot": (0.26, 0.92), "lamp": (0.22, 1.7), "laptop": (0.22, 0.66),
    "lighter": (0.058, 0.32), "microwave": (0.59, 0.92), "mouse": (0.087, 0.22), "oven": (0.52, 1.5),
    "pen": (0.056, 0.23), "phone": (0.073, 0.35), "pliers": (0.11, 0.38), "printer": (0.24, 1.3),
    "refrigerator": (0.93, 2.2),
    "remote": (0.086, 0.33), "robot_arm": (0.2, 1.5), "safe": (0.47, 1.9), "scissors": (0.098, 0.32),
    "stapler": (0.097, 0.45), "storage_furniture": (0.56, 2.4), "suitcase": (0.29, 1.1), "switch": (0.097, 0.24),
    "table": (0.6, 3), "toaster": (0.35, 0.57), "toilet": (1.1, 2.1), "trash_can": (0.5, 1.4), "usb": (0.031, 0.15),
    "valve": (0.13, 1), "washing_machine": (1.2, 1.5), "window": (1.1, 4.4),
}  # fmt: skip
"""Metres that the largest box of a part measures from corner to corner, least and most of 60 procedural objects."""
_BEYOND = 2.0
"""So many times less, or more, is no object of the category."""
_UNITS = {
    "mm": 0.001, "cm": 0.01, "dm": 0.1, "inches": 0.0254, "feet": 0.3048, "metres, but was divided by 1000": 1000.0,
    "metres, but was divided by 100": 100.0, "metres, but was divided by 10": 10.0,
}  # fmt: skip


def size_warning(largest: float, categories: Sequence[str]) -> str | None:
    """What is wrong with the size of an object of one of some categories.

    Parameters
    ----------
    largest : float
        Diagonal of its largest box, metres.
    categories : sequence of str
        All have to be known.
    """
    if not categories or not set(categories) <= USUAL.keys():
        return None
    low, high = min(USUAL[c][0] for c in categories), max(USUAL[c][1] for c in categories)
    if low / _BEYOND <= largest <= high * _BEYOND:
        return None
    what = f"a usual {categories[0]}" if len(categories) == 1 else "what this estimator knows"
    fits = [f"{name} (points * {factor:g})" for name, factor in _UNITS.items() if low <= largest * factor <= high]
    guess = f"; it may be in {' or '.join(fits)}" if fits else ""
    return (
        f"its largest part is {largest:.3g} m from corner to corner, and that of {what} is {low:.2g} to"
        f" {high:.2g} m{guess}. Fix: check --unit, --depth-scale and the intrinsics"
    )
