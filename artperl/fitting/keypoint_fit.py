"""The optimisation of OMAD (Xue et al. 2021, section 3.4): pose, states and shape that explain keypoints."""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import Posed, Theta, clamp_state, pose_parts
from artperl.core.rotations import rotation_from_vector
from artperl.core.trees import Trees
from artperl.perception.omad_networks import KeypointPrior

SNAP = 0.1
"""Diagonals beyond which the cloud says nothing about a keypoint."""
_REGULAR = 1e-4
"""Weight of the squared change of the shape's numbers, against squared distances in diagonals."""
_SETTLED = 1e-5
"""Relative change of the energy within a round of steps at which the optimisation ends."""
_ROUND = 25


@dataclass(frozen=True, eq=False)
class KeypointFit(Batch):
    """Pose, states and shape of B objects."""

    trees: Trees
    """Joints as the prior tells them, at diagonal 1."""
    theta: Theta
    beta: Tensor
    """(B, 10) float."""

    def posed(self) -> Posed:
        """Where the parts are; box centres are the origin of the rest frame."""
        return pose_parts(self.trees, self.theta, torch.zeros_like(self.trees.origin))


def shaped(prior: KeypointPrior, trees: Trees, theta: Theta, beta: Tensor) -> KeypointFit:
    """A fit whose joints are those that the prior tells for such a shape."""
    axis, origin = prior.joint_rows(beta)
    root = trees.depth == 0
    axis = torch.where(root[..., None], trees.axis, axis)
    return KeypointFit(replace(trees, axis=axis, origin=origin), theta, beta)


def posed_keypoints(prior: KeypointPrior, fit: KeypointFit) -> Tensor:
    """(B, K, 24, 3) keypoints in the camera frame."""
    return fit.posed().points(prior.keypoints(fit.beta), torch.zeros_like(fit.trees.origin))


def snap_keypoints(keypoints: Tensor, points: Tensor, part: Tensor, diagonal: Tensor) -> tuple[Tensor, Tensor]:
    """Keypoints on the cloud: the nearest point of their part, and whether it is near enough to count.

    Parameters
    ----------
    keypoints : (B, K, M, 3) float
    points : (B, N, 3) float
    part : (B, N) int64
    diagonal : (B,) float

    Returns
    -------
    (B, K, M, 3) float, (B, K, M) float
    """
    B, K, M, _ = keypoints.shape
    apart = torch.cdist(keypoints.flatten(1, 2), points).unflatten(1, (K, M))
    own = torch.nn.functional.one_hot(part, K).bool().transpose(1, 2)
    distance, index = apart.masked_fill(~own[:, :, None], torch.inf).min(-1)
    snapped = points.gather(1, index.flatten(1)[..., None].expand(-1, -1, 3)).reshape(B, K, M, 3)
    return snapped, (distance < SNAP * diagonal[:, None, None]).to(points.dtype)


def fit_keypoints(
    prior: KeypointPrior, trees: Trees, start: Theta, beta: Tensor, target: Tensor, weight: Tensor,
    iterations: int = 600, rate: float = 0.01,
) -> KeypointFit:  # fmt: skip
    """Adam over the root's pose and size, the states and the shape, from what the network says of them.

    Parameters
    ----------
    prior : KeypointPrior
    trees : Trees
        Of the category, at diagonal 1.
    start : Theta
    beta : (B, 10) float
    target, weight : (B, K, M, 3), (B, K, M) float
        Where keypoints are to be, and how much each counts.
    iterations : int
        At most.
    rate : float
        Of Adam, in radians and diagonals.
    """
    B, P = trees.valid.shape
    start, pivot = start.detach(), target.mean((1, 2))
    unit = start.log_scale.mean(1).exp()
    change = torch.zeros(B, 7 + P + beta.shape[1], dtype=beta.dtype, device=beta.device, requires_grad=True)
    optimizer = torch.optim.Adam([change], lr=rate)
    total = weight.sum((1, 2)).clamp(min=1.0)

    def moved() -> KeypointFit:
        turn, grow = rotation_from_vector(change[:, :3]), change[:, 6:7]
        local = (start.translation - pivot)[..., None]
        translation = (turn @ local)[..., 0] * grow.exp() + pivot + unit[:, None] * change[:, 3:6]
        state = torch.where(trees.free, clamp_state(trees, start.state + change[:, 7 : 7 + P]), start.state)
        theta = replace(
            start, rotation=turn @ start.rotation, translation=translation, state=state,
            log_scale=start.log_scale + grow,
        )  # fmt: skip
        return shaped(prior, trees, theta, beta + change[:, 7 + P :])

    def energy(fit: KeypointFit) -> Tensor:
        off = (posed_keypoints(prior, fit) - target).square().sum(-1) / unit[:, None, None].square()
        return (off * weight).sum((1, 2)) / total + _REGULAR * (fit.beta - beta).square().sum(1)

    before = torch.full((B,), torch.inf)
    with torch.enable_grad():
        for i in range(iterations):
            now = energy(moved())
            if i % _ROUND == 0:
                if bool((before - now.detach().cpu() < _SETTLED * before).all()) and i:
                    break
                before = now.detach().cpu()
            optimizer.zero_grad()
            now.sum().backward()
            optimizer.step()
    with torch.no_grad():
        return moved().detach()
