"""Boxes of an estimate where a network says that they are, and its points labelled by these boxes."""

from dataclasses import replace

import numpy as np

from artperl.boxes.evidence import BoxContext
from artperl.boxes.network import Boxes
from artperl.core.estimate import Estimate, slide_parts
from artperl.core.labels import labels_by_boxes

_LOOKS = 2
"""Times that boxes are looked for: the first ones tell which part a point cannot be of."""
_OUTSIDE = 0.01
"""Distance out of a part's box, in diagonals, that weighs as much against a label as odds of 1 to e."""


def place_boxes(network: Boxes, estimate: Estimate, context: BoxContext) -> Estimate:
    """The estimate with other boxes, other labels, and slides that are as far out as their fronts say."""
    T, part, K = estimate.T_camera_part, estimate.part, len(estimate.size)
    device = network.trust.device
    for _ in range(_LOOKS):
        evidence, unit = context.evidence(replace(estimate, part=part), network.num_rows)
        center, size, farther = (
            (values.cpu() * unit)[0].double().numpy()[:K] for values in network(evidence.to(device))
        )  # fmt: skip
        part = labels_by_boxes(context.points, T, center, size, context.log_odds, _OUTSIDE * unit)
    translation = np.einsum("kij,kj->ki", T[:, :3, :3], center) + T[:, :3, 3]
    # A drawer is never farther in than its joint lets it be.
    farther = np.maximum(farther, np.minimum(estimate.joint_limits[:, 0] - estimate.state, 0.0))
    return slide_parts(replace(estimate, translation=translation, size=size, part=part), farther)
