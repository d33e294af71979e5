"""Several objects among other things, and the ground truth of what a camera sees of them.

Stable names; the modules of this package are private.
"""

from typing import TYPE_CHECKING

from artsim.common.lazy import lazy_names

if TYPE_CHECKING:
    from artsim.scenes.dataset import SceneDataset, SceneRecord, open_scenes
    from artsim.scenes.generate import SceneRun, generate_scenes
    from artsim.scenes.ground_truth import SceneView, observe_scene, write_view
    from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera, with_appearance

__all__ = [
    "SceneCameraOptions",
    "SceneDataset",
    "SceneOptions",
    "SceneRecord",
    "SceneRun",
    "SceneView",
    "generate_scenes",
    "make_scene",
    "observe_scene",
    "open_scenes",
    "scene_camera",
    "with_appearance",
    "write_view",
]

_HOMES = {
    "SceneDataset": "dataset",
    "SceneRecord": "dataset",
    "open_scenes": "dataset",
    "SceneRun": "generate",
    "generate_scenes": "generate",
    "SceneView": "ground_truth",
    "observe_scene": "ground_truth",
    "write_view": "ground_truth",
    "SceneCameraOptions": "random_scene",
    "SceneOptions": "random_scene",
    "make_scene": "random_scene",
    "scene_camera": "random_scene",
    "with_appearance": "random_scene",
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
