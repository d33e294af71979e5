"""Rays on a GPU through NVIDIA Warp, many views of different objects in one launch; slowly on a CPU as well.

Each part has a static acceleration structure of its own, and rays are carried into its frame, as in
:mod:`artsim.renderers.raycast`. Kinematics, images and clouds are all made on the device; arrays that come back are
Warp's: ``.numpy()`` copies one, ``warp.to_torch`` or ``torch.from_dlpack`` share its memory.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.camera import Camera
from artsim.errors import ConfigError, RenderError
from artsim.kinematics import ROTATING, Array
from artsim.objects import ArticulatedObject, Part
from artsim.renderers.base import Frame

_MEND = "pip install 'artsim[warp]'"


@dataclass(frozen=True, eq=False)
class Views:
    """B views, each of one object in one state by one camera, all of one image size.

    Attributes
    ----------
    objects : (B,) int
        Number of each view's object among those loaded.
    q : (B, K) float
        Joint states in radians or metres, K being the largest number of parts; further entries are ignored.
    T_camera_object : (B, 4, 4) float
        Pose of each object's rest frame in the camera.
    K : (B, 3, 3) float
        Intrinsic matrices in pixels.
    width, height : int

    Arrays can be NumPy's, or Warp's own (int32, float64, mat44d and mat33d) on the renderer's device.
    """

    objects: Any
    q: Any
    T_camera_object: Any
    K: Any
    width: int
    height: int

    def __len__(self) -> int:
        return len(self.objects)

    @staticmethod
    def of(
        objects: ArrayLike,
        states: Sequence[ArrayLike],
        cameras: Sequence[Camera],
        T_world_object: ArrayLike | None = None,
    ) -> Views:
        """Views from cameras.

        Parameters
        ----------
        objects : (B,) int
        states : B of (K,) float
        cameras : B of Camera
        T_world_object : (4, 4) or (B, 4, 4) float, optional
            Identity by default.

        Raises
        ------
        ConfigError
            When the lengths differ, or the cameras' image sizes do.
        """
        objects = np.asarray(objects, dtype=np.int32)
        sizes = {(camera.width, camera.height) for camera in cameras}
        if not len(objects) == len(states) == len(cameras):
            raise ConfigError(f"{len(objects)} objects, {len(states)} states and {len(cameras)} cameras", "views")
        if len(sizes) != 1:
            raise ConfigError(f"a batch has one image size, not {len(sizes)}", "cameras", "draw each size by itself")
        rows = [np.asarray(state, dtype=np.float64) for state in states]
        q = np.zeros((len(rows), max(map(len, rows))))
        for row, state in zip(q, rows, strict=True):
            row[: len(state)] = state
        T_camera_world = np.stack([camera.T_camera_world for camera in cameras])
        T_camera_object = T_camera_world if T_world_object is None else T_camera_world @ np.asarray(T_world_object)
        return Views(objects, q, T_camera_object, np.stack([camera.K for camera in cameras]), *sizes.pop())


@dataclass(frozen=True, eq=False)
class Images:
    """What B views show, on the device.

    Attributes
    ----------
    depth : (B, H, W) float32
        z-depth in metres, 0 = no return.
    part_ids : (B, H, W) uint8
        255 where no part is seen.
    T_camera_part : (B, K) mat44d
        As an array (B, K, 4, 4); zero beyond an object's own parts.
    """

    depth: Any
    part_ids: Any
    T_camera_part: Any


@dataclass(frozen=True, eq=False)
class Clouds:
    """Partial clouds of B views, on the device.

    Attributes
    ----------
    points : (B, N) vec3
        As an array (B, N, 3) float32: camera frame, metres.
    part : (B, N) uint8
        Part of each point; 255 throughout where the camera does not see the object.
    T_camera_part : (B, K) mat44d
    """

    points: Any
    part: Any
    T_camera_part: Any


@dataclass(frozen=True, eq=False)
class ObjectSet:
    """Objects on the device; see :meth:`WarpRenderer.load`."""

    num_parts: NDArray[np.int32]
    bodies: Any
    device_num_parts: Any
    scales: Any
    meshes: tuple[Any, ...]

    def __len__(self) -> int:
        return len(self.num_parts)


class WarpRenderer:
    """Casts rays on a GPU, or on the CPU, many views at once.

    Parameters
    ----------
    device : str, optional
        "cuda:0", "cpu", ...; by default the first GPU, or the CPU where there is none.

    Raises
    ------
    RenderError
        When Warp is not installed, or does not know the device.
    """

    name = "warp"

    def __init__(self, device: str | None = None):
        wp = import_warp()
        try:
            self._device = wp.get_preferred_device() if device is None else wp.get_device(device)
        except (ValueError, RuntimeError) as error:
            known = ", ".join(map(str, wp.get_devices()))
            raise RenderError(f"Warp finds no device {device!r}", "warp", f"use one of {known}") from error
        self._wp = wp
        self._meshes: weakref.WeakKeyDictionary[Part, Any] = weakref.WeakKeyDictionary()
        self._single: weakref.WeakKeyDictionary[ArticulatedObject, ObjectSet] = weakref.WeakKeyDictionary()

    @property
    def device(self) -> str:
        """Warp's name of the device that draws: "cuda:0", "cpu", ..."""
        return str(self._device.alias)

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        """Render one posed object; see :class:`artsim.renderers.base.Renderer`."""
        return self.render_cameras(obj, q, [camera], T_world_object)[0]

    def render_cameras(
        self,
        obj: ArticulatedObject,
        q: ArrayLike,
        cameras: Sequence[Camera],
        T_world_object: ArrayLike | None = None,
    ) -> list[Frame]:
        """Render one posed object by several cameras; see :class:`artsim.renderers.base.CameraBatch`."""
        if obj not in self._single:
            self._single[obj] = self.load([obj])
        state = obj.tree.complete_state(q)
        views = Views.of([0] * len(cameras), [state] * len(cameras), cameras, T_world_object)
        images = self.render_views(self._single[obj], views)
        return [Frame(*frame) for frame in zip(images.depth.numpy(), images.part_ids.numpy(), strict=True)]

    def load(self, objects: Sequence[ArticulatedObject]) -> ObjectSet:
        """Bring objects to the device, to be seen in any number of views.

        Parameters
        ----------
        objects : sequence of ArticulatedObject
            Objects of one geometry at different sizes share it.
        """
        from artsim.renderers import warp_kernels as kernels

        if not objects:
            raise ConfigError("there is no object to load", "objects", "pass at least one")
        body: Any = kernels.Body
        num_parts = np.array([len(obj) for obj in objects], dtype=np.int32)
        table: NDArray[np.void] = np.zeros((len(objects), num_parts.max()), dtype=body.numpy_dtype())
        meshes = []
        for row, obj in zip(table, objects, strict=True):
            own = [self._mesh(part) for part in obj.parts]
            _describe(obj, row[: len(obj)])
            row["mesh"][: len(obj)] = [0 if mesh is None else mesh.id for mesh in own]
            meshes += own
        bodies = self._wp.array(table, dtype=body, device=self._device)
        scales = self._array([obj.scale for obj in objects], self._wp.float64)
        return ObjectSet(num_parts, bodies, self._array(num_parts, self._wp.int32), scales, tuple(meshes))

    def _mesh(self, part: Part) -> Any:
        """Acceleration structure of a part, None for a part without a surface."""
        if len(part.faces) == 0:
            return None
        mesh = self._meshes.get(part)
        if mesh is None:
            mesh = self._meshes[part] = self._wp.Mesh(
                self._array(part.vertices, self._wp.vec3),
                self._array(part.faces.ravel(), self._wp.int32),
                bvh_constructor="sah",  # slower to build than others, faster to look through
            )
        return mesh

    def _array(self, values: Any, dtype: Any) -> Any:
        if isinstance(values, self._wp.array):
            return values
        return self._wp.array(np.ascontiguousarray(values), dtype=dtype, device=self._device)

    def render_views(self, objects: ObjectSet, views: Views) -> Images:
        """Depth and part ids of different objects at once.

        Parameters
        ----------
        objects : ObjectSet
        views : Views

        Raises
        ------
        ConfigError
            When the views do not fit the objects.
        """
        return self._render(objects, self._checked(objects, views))

    def _render(self, objects: ObjectSet, views: Views) -> Images:
        from artsim.renderers import warp_kernels as kernels

        wp, count, most = self._wp, len(views), objects.bodies.shape[1]
        about = [objects.device_num_parts, objects.scales, views.objects]
        with wp.ScopedDevice(self._device):
            T_camera_part = wp.zeros((count, most), dtype=wp.mat44d)
            eyes = wp.empty((count, most), dtype=kernels.Eye)
            depth = wp.empty((count, views.height, views.width), dtype=wp.float32)
            part_ids = wp.empty((count, views.height, views.width), dtype=wp.uint8)
            inputs = [objects.bodies, *about, views.q, views.T_camera_object, views.K]
            wp.launch(kernels.pose, (count, most), inputs, [T_camera_part, eyes])
            tiles = -(-views.height // kernels.TILE_ROWS), -(-views.width // kernels.TILE_COLUMNS)
            lanes = kernels.TILE_ROWS * kernels.TILE_COLUMNS
            wp.launch(kernels.cast, (count, *tiles, lanes), [eyes, *about], [depth, part_ids])
        return Images(depth, part_ids, T_camera_part)

    def clouds(self, objects: ObjectSet, views: Views, num_points: int, seed: int = 0) -> Clouds:
        """Partial clouds of different objects at once: a choice, uniform by chance, of the pixels that show each.

        Parameters
        ----------
        objects : ObjectSet
        views : Views
        num_points : int
            Points of each cloud, all different unless fewer pixels show the object: then each is there, and some are
            drawn again.
        seed : int

        Raises
        ------
        ConfigError
            When the views do not fit the objects, or a cloud would be empty.
        """
        from artsim.renderers import warp_kernels as kernels

        if num_points < 1:
            raise ConfigError(f"a cloud of {num_points} points is empty", "num_points", "ask for at least 1")
        wp, views = self._wp, self._checked(objects, views)
        images, shape = self._render(objects, views), (len(views), num_points)
        with wp.ScopedDevice(self._device):
            shown = images.part_ids.flatten()
            rank, pixels = (wp.empty(shown.size, dtype=wp.int32) for _ in range(2))
            wp.launch(kernels.mark, shown.size, [shown], [pixels])
            wp.utils.array_scan(pixels, rank, inclusive=True)
            wp.launch(kernels.gather, shown.size, [shown, rank], [pixels])
            points, part = wp.zeros(shape, dtype=wp.vec3), wp.empty(shape, dtype=wp.uint8)
            inputs = [images.depth, images.part_ids, views.K, rank, pixels, wp.uint32(seed % 2**32)]
            wp.launch(kernels.draw, shape, inputs, [points, part])
        return Clouds(points, part, images.T_camera_part)

    def _checked(self, objects: ObjectSet, views: Views) -> Views:
        """The views on the device, once they are known to fit the objects."""
        wp, count, most = self._wp, len(views), objects.bodies.shape[1]
        if not 0 < count * views.width * views.height < 2**31:
            raise ConfigError(f"{count} views of {views.width}x{views.height} are not made at once", "views", "split")
        q = views.q if isinstance(views.q, wp.array) else np.asarray(views.q, dtype=np.float64)
        if q.ndim != 2 or q.shape[0] != count or q.shape[1] < most:
            raise ConfigError(f"states of shape {q.shape} do not fit", "q", f"pass ({count}, {most})")
        if not isinstance(views.objects, wp.array):
            numbers = np.asarray(views.objects)
            if numbers.min() < 0 or numbers.max() >= len(objects):
                raise ConfigError(f"no object {numbers.max()}", "views.objects", f"use 0 to {len(objects) - 1}")
        return Views(
            self._array(views.objects, wp.int32),
            self._array(q, wp.float64),
            self._array(views.T_camera_object, wp.mat44d),
            self._array(views.K, wp.mat33d),
            views.width,
            views.height,
        )

    def close(self) -> None:
        """Drop what was drawn one by one; sets of objects live as long as they are held."""
        self._single.clear()
        self._meshes.clear()


def _describe(obj: ArticulatedObject, row: NDArray[np.void]) -> None:
    """Fill in a row of ``warp_kernels.Body``, except for the meshes."""
    tree = obj.tree
    bounds = obj.part_bounds / obj.scale
    row["low"], row["high"] = bounds[:, 0], bounds[:, 1]
    row["parent"], row["axis"], row["origin"] = tree.parents, tree.axes, tree.origins
    # A state is its own or, through mimics of mimics, a linear function of one other.
    offset = tree.complete_state(np.zeros(len(tree)))
    gains: Array = tree.complete_state(np.eye(len(tree))) - offset
    row["source"] = np.abs(gains).argmax(axis=0)
    row["gain"] = gains[row["source"], np.arange(len(tree))]
    row["offset"] = offset - tree.rest
    row["offset"][0] = 0.0
    row["turn"] = [joint.type in ROTATING for joint in tree.joints]
    row["slide"] = [{"prismatic": 1.0, "screw": joint.pitch}.get(joint.type, 0.0) for joint in tree.joints]


@cache
def import_warp() -> ModuleType:
    """Warp, without its greeting.

    Raises
    ------
    RenderError
        When it is not installed.
    """
    try:
        import warp
    except ImportError as error:
        raise RenderError("Warp is not installed", "warp", _MEND) from error
    warp.config.log_level = warp.LOG_WARNING
    warp.init()
    return warp
