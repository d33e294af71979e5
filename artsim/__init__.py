"""artsim: synthetic articulated-object data, from URDF folders to labelled partial point clouds.

Stable names; everything else is private. Heavy backends are imported when first used.
"""

from __future__ import annotations

from artsim.datasets.dataset import Dataset, open_dataset
from artsim.datasets.generate import generate
from artsim.errors import ArtsimError
from artsim.families import make
from artsim.loading.urdf import load
from artsim.model.camera import Camera
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.frame import Frame
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.sample import ARTSIM_VERSION, Sample
from artsim.renderers import make_renderer, render, render_cameras

__version__ = ARTSIM_VERSION

__all__ = [
    "ArticulatedObject",
    "ArtsimError",
    "Camera",
    "Dataset",
    "Frame",
    "KinematicTree",
    "Sample",
    "StateOptions",
    "ViewOptions",
    "__version__",
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
]
