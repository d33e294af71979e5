"""Several objects among other things, and the ground truth of what a camera sees of them.

Stable names; the modules of this package are private.
"""

from artsim.scenes.dataset import SceneDataset, SceneRecord, open_scenes
from artsim.scenes.generate import SceneRun, generate_scenes
from artsim.scenes.ground_truth import SceneView, observe_scene, write_view
from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera, with_appearance

__all__ = [
    "SceneCameraOptions", "SceneDataset", "SceneOptions", "SceneRecord", "SceneRun", "SceneView", "generate_scenes",
    "make_scene", "observe_scene", "open_scenes", "scene_camera", "with_appearance", "write_view",
]  # fmt: skip
