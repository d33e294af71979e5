"""The task: where joints begin, where they are to end, and how well they are on the way."""

from typing import Literal

import torch
from torch import Tensor

Goal = Literal["open", "close", "random"]
REACH = 5.0
"""Steepness of the reward for being near a handle, 1/m."""
BEST = 8.0
"""The most that a step's dense reward can be."""
LEAST_OPEN, MOST_OPEN = 0.5, 0.9
"""Of the way from rest, how far joints are to be opened, or closed from."""
APART = 0.3
"""Least share of their range that random goals are from where joints begin."""


def dense_reward(error: Tensor, free: Tensor, tolerance: float, distance: Tensor) -> Tensor:
    """How well B objects are on the way to their goals.

    4 for joints that are near their goals, on average; 3 for the share that has reached them; 1 for a gripper near the
    handle of the one that is left and nearest. So a joint that has arrived is worth more than what a hand loses by
    turning to the next one, up to three joints; and all of it, ``BEST``, is given as soon as all have arrived.

    Parameters
    ----------
    error : (B, P) float
        Way left, over each joint's range.
    free : (B, P) bool
    tolerance : float
        Share of its range within which a joint has arrived.
    distance : (B, P) float
        Of the gripper from each part's handle, metres.

    Returns
    -------
    (B,) float
    """
    count = free.sum(1).clamp(min=1)
    arrived = free & (error.abs() <= tolerance)
    left = free & ~arrived
    closeness = 1.0 - torch.where(free, error.abs(), 0.0).sum(1) / count
    nearest = torch.where(left, distance, torch.inf).min(1).values
    reaching = torch.where(left.any(1), 1.0 - torch.tanh(REACH * nearest), 1.0)
    reward = 4.0 * closeness + 3.0 * arrived.sum(1) / count + reaching
    return torch.where(left.any(1), reward, BEST)
