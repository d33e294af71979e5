"""artsim: synthetic articulated-object data, from URDF folders to labelled partial point clouds.

Stable names; docs/api.md lists them with those of the public packages. Everything else is private. Heavy backends are
imported when first used.

Rooms, from the ground up. Each imports only rooms that come before it (import-linter holds this, see pyproject.toml):

- common, errors: what every module may use.
- model: an articulated object, its kinematics, materials, cameras and frames. No backend.
- making, families: objects from a seed.
- loading: objects from files.
- renderers: one scene in, one frame out.
- observing: frames to labelled samples; sensor noise.
- datasets: samples to disk and back, or without end (stream). formats: datasets as other programs read them.
- scenes: several objects. checks: gates for simulators.
- export: objects as URDF, MJCF and USD.
- variation: objects out of a given one. physics: objects that move. drawing: pictures.
- envs: reinforcement learning. commands: the verbs of the program.
"""

from typing import TYPE_CHECKING

from artsim import errors
from artsim.common.lazy import lazy_names
from artsim.common.showing import EXPORT_MODULES, PAGE_MODULES
from artsim.errors import ArtsimError

if TYPE_CHECKING:
    from artsim import stream
    from artsim.datasets.dataset import Dataset, open_dataset
    from artsim.datasets.generate import generate
    from artsim.datasets.plan import SampleOptions
    from artsim.datasets.verify import verify
    from artsim.families import CATEGORIES, make
    from artsim.loading.meshes import LoadLimits
    from artsim.loading.sources import family_sources, find_sources
    from artsim.loading.urdf import load
    from artsim.model.camera import Camera
    from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
    from artsim.model.frame import Frame
    from artsim.model.kinematics import KinematicTree
    from artsim.model.objects import ArticulatedObject
    from artsim.observing.capture import observe
    from artsim.observing.sample import Sample, __version__
    from artsim.observing.sensor import SENSORS, Sensor
    from artsim.renderers import make_renderer, render, render_cameras
    from artsim.variation import vary

__all__ = [
    "CATEGORIES",
    "SENSORS",
    "ArticulatedObject",
    "ArtsimError",
    "Camera",
    "Dataset",
    "Frame",
    "KinematicTree",
    "LoadLimits",
    "Sample",
    "SampleOptions",
    "Sensor",
    "StateOptions",
    "ViewOptions",
    "__version__",
    "errors",
    "family_sources",
    "find_sources",
    "generate",
    "load",
    "make",
    "make_renderer",
    "observe",
    "open_dataset",
    "render",
    "render_cameras",
    "sample_state",
    "sample_view",
    "stream",
    "vary",
    "verify",
]

_HOMES = {
    "Dataset": "datasets.dataset",
    "open_dataset": "datasets.dataset",
    "generate": "datasets.generate",
    "SampleOptions": "datasets.plan",
    "verify": "datasets.verify",
    "CATEGORIES": "families",
    "make": "families",
    "LoadLimits": "loading.meshes",
    "family_sources": "loading.sources",
    "find_sources": "loading.sources",
    "load": "loading.urdf",
    "Camera": "model.camera",
    "StateOptions": "model.draws",
    "ViewOptions": "model.draws",
    "sample_state": "model.draws",
    "sample_view": "model.draws",
    "Frame": "model.frame",
    "KinematicTree": "model.kinematics",
    "ArticulatedObject": "model.objects",
    "observe": "observing.capture",
    "Sample": "observing.sample",
    "SENSORS": "observing.sensor",
    "Sensor": "observing.sensor",
    "make_renderer": "renderers",
    "render": "renderers",
    "render_cameras": "renderers",
    "vary": "variation",
    "__version__": "observing.sample",
}
_PACKAGES = ("checks", "drawing", "envs", "export", "formats", "physics", "scenes", "stream")
__getattr__, __dir__ = lazy_names(__name__, _HOMES, _PACKAGES)
PAGE_MODULES.append("artsim.drawing.page")
EXPORT_MODULES.append("artsim.export")
