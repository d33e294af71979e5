"""Several objects among other things, and the ground truth of what a camera sees of them.

Stable names; the modules of this package are private.
"""

from artsim.scenes.ground_truth import SceneView, observe_scene, write_view
from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera, with_appearance

__all__ = [
    "SceneCameraOptions",
    "SceneOptions",
    "SceneView",
    "make_scene",
    "observe_scene",
    "scene_camera",
    "with_appearance",
    "write_view",
]
