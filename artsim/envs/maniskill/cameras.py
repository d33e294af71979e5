"""Cameras: artsim's, as ManiSkill takes them, and ManiSkill's, as the record tells of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from mani_skill.sensors.camera import CameraConfig
from mani_skill.utils.structs import Pose
from scipy.spatial.transform import Rotation
from torch import Tensor

from artsim.envs.maniskill.places import T_world_object
from artsim.model.camera import Camera
from artsim.model.draws import ViewOptions, sample_view
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.physics.episode import most_open_state

# SAPIEN's camera looks along x with z up.
SAPIEN_FROM_CV = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
CV_FROM_SAPIEN = SAPIEN_FROM_CV.T


def look(obj: ArticulatedObject, views: ViewOptions, rng: np.random.Generator) -> Camera:
    """A camera that sees the object wherever its joints are, in the world's frame."""
    camera = sample_view(obj, most_open_state(obj), views, rng)
    return replace(camera, T_world_camera=T_world_object(obj) @ camera.T_world_camera)


def poses(T_world_camera: Sequence[Array]) -> Pose:
    """ManiSkill's (B,) poses of cameras with OpenCV's axes."""
    T = np.stack(T_world_camera) @ CV_FROM_SAPIEN
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    return Pose.create(torch.from_numpy(np.concatenate([T[:, :3, 3], quaternion], axis=1)).float())


def camera_record(config: CameraConfig, count: int, device: Any) -> dict[str, Tensor]:
    """``K`` (B, 3, 3), ``T_world_camera`` (B, 4, 4), ``width`` and ``height`` (B,) of a camera in B sub-scenes."""
    T = config.pose.to_transformation_matrix().to(device) @ torch.tensor(
        SAPIEN_FROM_CV, dtype=torch.float32, device=device
    )
    lens = config.intrinsic
    if lens is None:
        focal = 0.5 * config.height / np.tan(0.5 * config.fov)
        lens = [[focal, 0.0, 0.5 * config.width], [0.0, focal, 0.5 * config.height], [0.0, 0.0, 1.0]]
    K = torch.as_tensor(np.asarray(lens), dtype=torch.float32, device=device).reshape(-1, 3, 3)
    return {
        "K": K.expand(count, 3, 3),
        "T_world_camera": T.expand(count, 4, 4),
        "width": torch.full((count,), config.width, device=device),
        "height": torch.full((count,), config.height, device=device),
    }
