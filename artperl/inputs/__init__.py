"""Clouds of users' files: point clouds, and depth images with masks and intrinsics, of many tools."""

from artperl.inputs.depth_images import points_of_depth
from artperl.inputs.intrinsics import read_camera, read_intrinsics
from artperl.inputs.reading import Cloud, InputOptions, read_cloud, read_points

__all__ = [
    "Cloud", "InputOptions", "points_of_depth", "read_camera", "read_cloud", "read_intrinsics", "read_points",
]  # fmt: skip
