"""What depth cameras miss of a scene: shiny and transparent surfaces, in patches."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from artsim.model.appearance import Coat, Material
from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.observing.noise import PixelView
from artsim.renderers.raycast import hit_faces, pose
from artsim.renderers.scene import Scene, SceneFrame, Thing

_PATCH = 7
"""Pixels between the knots of the noise that patches follow: holes of real cameras are blobs, not single pixels."""


def missing_share(material: Material) -> float:
    """Share of a surface of a material without a return, 0 to 1.

    Light that a polished metal mirrors, or a clear body lets through, does not come back. Polish counts twice: on the
    way in and on the way out. This is a model, not a measurement: 44 % of chrome, 22 % of brushed steel, 50 % of glass.
    """
    share = max(material.metallic, material.transmission) * (1.0 - material.roughness)
    return float(share * share)


@dataclass(frozen=True, eq=False)
class MissingReturns:
    """A step of a sensor: no return where ``missed`` (H, W) is true. See :class:`artsim.observing.noise.Step`."""

    missed: NDArray[np.bool_]

    def read(self, view: PixelView, depth: Array, focal: float, stream: int) -> Array:
        """Depth reported after this step."""
        return np.where(self.missed[view.row, view.column], 0.0, depth)

    def sigma(self, depth: Array, incidence: Array, focal: float) -> Array:
        """It adds nothing to what is reported."""
        return np.zeros_like(depth)


def missing_returns(
    scene: Scene, frame: SceneFrame, camera: Camera, rng: np.random.Generator
) -> NDArray[np.bool_]:  # fmt: skip
    """Pixels (H, W) of a noise-free frame from which nothing comes back.

    Parameters
    ----------
    scene : Scene
    frame : SceneFrame
    camera : Camera
    rng : numpy Generator
        Places the patches.
    """
    noise = _patches(frame.depth.shape, rng)
    share = np.zeros(frame.depth.shape)
    for i, thing in enumerate(scene.things):
        if any(missing_share(material) > 0 for coat in thing.coats for material in coat.materials):
            shown = frame.instance_ids == i
            if shown.any():
                share[shown] = _shares(thing, frame, camera, shown)
    return noise < share


def _patches(shape: tuple[int, ...], rng: np.random.Generator) -> Array:
    """(H, W) smooth noise whose values are spread evenly over 0 to 1, so that a share of it lies below that share."""
    height, width = shape
    rows, columns = np.arange(height) / _PATCH, np.arange(width) / _PATCH
    knots = rng.random((int(rows[-1]) + 2, int(columns[-1]) + 2))
    above, left = rows.astype(int), columns.astype(int)
    down, right = (rows - above)[:, None], (columns - left)[None, :]
    top = knots[above][:, left] * (1 - right) + knots[above][:, left + 1] * right
    bottom = knots[above + 1][:, left] * (1 - right) + knots[above + 1][:, left + 1] * right
    smooth = (top * (1 - down) + bottom * down).ravel()
    even = np.empty(smooth.size)
    even[np.argsort(smooth, kind="stable")] = (np.arange(smooth.size) + 0.5) / smooth.size
    return even.reshape(height, width)


def _shares(thing: Thing, frame: SceneFrame, camera: Camera, shown: NDArray[np.bool_]) -> Array:
    """Share without a return of the surface at each pixel that shows a thing."""
    row, column = shown.nonzero()
    found = np.zeros(len(row))
    part = frame.part_ids[row, column] if len(thing.obj) > 1 else np.zeros(len(row), np.int64)
    posed = pose(thing.obj, thing.q, camera, thing.T_world_object)
    for k, coat in enumerate(thing.coats):
        own = (part == k).nonzero()[0]
        if len(own):
            found[own] = _coat_shares(coat)[hit_faces(posed, k, row[own], column[own])]
    return found


def _coat_shares(coat: Coat) -> Array:
    """(F + 1,) share of each face, and 0 for none."""
    of_material = np.array([missing_share(material) for material in coat.materials])
    return np.append(of_material[coat.material_of_face], 0.0)
