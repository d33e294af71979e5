"""Votes on a cloud and on its mirror image, together.

Most objects are seen as often with their left and right sides exchanged, and the network errs otherwise on the mirror
image: the mean of both votes is nearer to the truth.
"""

from dataclasses import fields, replace

import torch
from torch import Tensor

from artperl.perception.network import Perceived, Perception, Votes

_CAMERA, _OBJECT = (-1.0, 1.0, 1.0), (1.0, -1.0, 1.0)
"""Left and right of an upright camera, and of an object in the rest frame."""


def votes_both_ways(network: Perception, points: Tensor, standard: int) -> Perceived | Votes:
    """What a network sees in clouds (B, N, 3); by votes, their mean with those on the mirror images.

    Joints stay those of the clouds: of a front that may be hinged on either side, the mean is hinged on none.
    """
    seen = network(points, standard)
    if not isinstance(seen, Votes):
        return seen
    image = network(points * points.new_tensor(_CAMERA), standard)
    assert isinstance(image, Votes)
    mirror = points.new_tensor(_OBJECT)
    joint = image.joint * torch.cat([mirror, -mirror, mirror])  # a turn's axis is a pseudovector
    image = replace(
        image, canonical=image.canonical * mirror, box=image.box * torch.cat([mirror, torch.ones_like(mirror)]),
        level_logits=image.level_logits.log_softmax(-1), joint=seen.joint, mirrored_joint=joint,
    )  # fmt: skip
    seen = replace(seen, level_logits=seen.level_logits.log_softmax(-1), mirrored_joint=joint)
    return replace(seen, **{f.name: 0.5 * (getattr(seen, f.name) + getattr(image, f.name)) for f in fields(Votes)})
