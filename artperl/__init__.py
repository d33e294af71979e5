"""artperl: 9D pose of every part of an articulated object from a partial point cloud (ArtPERL).

Stable names; docs/api.md lists them. They are imported when first used: torch takes seconds.
"""

from typing import TYPE_CHECKING

from artsim.common.lazy import lazy_names
from artsim.common.showing import PAGE_MODULES

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate
    from artperl.methods.estimator_files import load_estimator
    from artperl.scene.estimator import load_scene_estimator

__all__ = ["Estimate", "load_estimator", "load_scene_estimator"]

_HOMES = {
    "Estimate": "core.estimate",
    "load_estimator": "methods.estimator_files",
    "load_scene_estimator": "scene.estimator",
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES, ("inputs",))
PAGE_MODULES.append("artperl.evaluation.estimate_page")
