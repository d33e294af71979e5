"""The objects of an image as one scene that simulates."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from artperl.core.estimated_object import estimated_object
from artperl.scene.estimator import SceneEstimate
from artsim.common.products import matmul
from artsim.errors import ConfigError
from artsim.model.kinematics import Array
from artsim.model.transforms import compose_transform
from artsim.renderers.scene import Thing
from artsim.scenes.simulation import SceneFiles, write_simulation


def export_scene(result: SceneEstimate, folder: Path) -> SceneFiles:
    """Write every estimated object where it is: URDF, one MJCF and one USD file; ``T_world_camera`` in ``scene.json``.

    The mean of the objects' verticals points up, and the lowest of them stands on the support.

    Raises
    ------
    ConfigError
        When no object has an estimate.
    """
    found = [(o.detection.category, o.estimate) for o in result.objects if o.estimate is not None]
    if not found:
        raise ConfigError("no object has an estimate", folder, "see what is said of each object")
    turn = _upright(np.stack([estimate.rotation[0, :, 2] for _, estimate in found]))
    made = [estimated_object(estimate, category, f"estimate_{n}") for n, (category, estimate) in enumerate(found)]
    things = [Thing(obj, q, matmul(turn, T), ()) for obj, T, q in made]
    T_world_camera = matmul(compose_transform([0.0, 0.0, -min(float(t.vertices[:, 2].min()) for t in things)]), turn)
    placed = [Thing(obj, q, matmul(T_world_camera, T), ()) for obj, T, q in made]
    return write_simulation(placed, folder, notes={"T_world_camera": T_world_camera.tolist()})


def _upright(verticals: Array) -> Array:
    """(4, 4) from the camera frame to one whose Z axis is the mean of verticals (N, 3); X points away."""
    z = verticals.mean(axis=0)
    z /= max(float(np.linalg.norm(z)), 1e-9)
    ahead = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.99 else np.array([0.0, -1.0, 0.0])
    x = ahead - (ahead @ z) * z
    x /= np.linalg.norm(x)
    return compose_transform([0.0, 0.0, 0.0], np.stack([x, np.cross(z, x), z]))
