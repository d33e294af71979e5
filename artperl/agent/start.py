"""Where an episode begins: the reference at the cloud's centroid, turned as objects are seen on average."""

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from artperl.core.pose import Theta, pose_parts
from artperl.core.shapes import Shapes, faces_camera
from artsim.model.camera import look_at_transform


@dataclass(frozen=True)
class MeanView:
    """Mean of the views that an agent is trained for: those of ArtImage by default."""

    azimuth: float = 0.0
    """Degrees about the object's vertical, 0 for a view of its front."""
    elevation: float = 35.0
    """Degrees above the horizon."""

    def rotation(self) -> Tensor:
        """(3, 3) rest frame -> camera."""
        side, up = np.deg2rad(self.azimuth), np.deg2rad(self.elevation)
        eye = np.array([-np.cos(side) * np.cos(up), -np.sin(side) * np.cos(up), np.sin(up)])
        return torch.from_numpy(look_at_transform(eye, np.zeros(3))[:3, :3].T.copy())


def mean_start(shapes: Shapes, points: Tensor, view: MeanView) -> Theta:
    """References that face the camera as in the mean view, as large as the clouds, their joints half-way.

    The paper leaves the size and the joint states of the start open. A cloud shows what faces the camera: the mean and
    the spread of that side of the reference, by its area in the image, are brought to those of the cloud.

    Parameters
    ----------
    shapes : Shapes
        B references.
    points : (B, N, 3) float
        Observed clouds, metres, camera frame.
    view : MeanView
    """
    trees, center = shapes.trees, points.mean(1)
    middle = 0.5 * (trees.lower + trees.upper)
    state = torch.where(trees.free & torch.isfinite(middle), middle, trees.rest)
    rotation = view.rotation().to(points).expand(len(points), 3, 3)
    theta = replace(Theta.at_rest(trees), rotation=rotation, state=state)
    posed = pose_parts(trees, theta, shapes.box_center)
    own, normals = posed.points(shapes.points, shapes.box_center), posed.normals(shapes.normals)
    sight = torch.nn.functional.normalize(center, dim=-1)[:, None, None]
    seen = faces_camera(sight, normals) & shapes.has_surface[..., None]
    area = torch.where(shapes.has_surface, shapes.spacing, 0.0)[..., None].square()
    weight = torch.where(seen, -(sight * normals).sum(-1) * area, 0.0)
    weight = weight / weight.sum((1, 2), keepdim=True).clamp(min=1e-12)
    mean = (weight[..., None] * own).sum((1, 2))
    spread = (weight * (own - mean[:, None, None]).square().sum(-1)).sum((1, 2)).sqrt()
    scale = (points - center[:, None]).square().sum(-1).mean(1).sqrt() / spread.clamp(min=1e-9)
    log_scale = scale.log()[:, None].expand(-1, 3)
    return replace(theta, log_scale=log_scale, translation=center - scale[:, None] * mean)
