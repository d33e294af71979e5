"""Rays on a GPU through NVIDIA Warp, many views of different objects in one launch; slowly on a CPU as well.

Each part has a static acceleration structure of its own, and rays are carried into its frame, as in
:mod:`artsim.renderers.raycast`. Kinematics, images and clouds are all made on the device; arrays that come back are
Warp's: ``.numpy()`` copies one, ``warp.to_torch`` or ``torch.from_dlpack`` share its memory.
"""

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.extras import require_extra, silence_output
from artsim.errors import ConfigError, RenderError
from artsim.model.camera import Camera
from artsim.model.frame import Frame
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from artsim.renderers.view_batch import Clouds, Images, Views


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

    ::

        renderer = WarpRenderer()
        objects = [artsim.make("laptop", seed) for seed in range(100)]
        loaded = renderer.load(objects)
        while True:
            clouds = renderer.clouds(loaded, draw_views(objects, 4096, rng), num_points=1024)

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
        self, obj: ArticulatedObject, q: ArrayLike, cameras: Sequence[Camera], T_world_object: ArrayLike | None = None
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

    def _array(self, values: ArrayLike, dtype: Any) -> Any:
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
        if not isinstance(views.objects, wp.array):
            numbers = np.asarray(views.objects)
            if numbers.min() < 0 or numbers.max() >= len(objects):
                raise ConfigError("there is no such object", "views.objects", f"use 0 to {len(objects) - 1}")
            most = int(objects.num_parts[numbers].max())
        return Views(
            self._given("objects", views.objects, wp.int32, (count,)),
            self._given("q", views.q, wp.float64, (count, max(most, *np.shape(views.q)[1:]))),
            self._given("T_camera_object", views.T_camera_object, wp.mat44d, (count, 4, 4)),
            self._given("K", views.K, wp.mat33d, (count, 3, 3)),
            views.width,
            views.height,
        )

    def _given(self, name: str, values: Any, dtype: Any, shape: tuple[int, ...]) -> Any:
        """An array of the user's on the device."""
        ours = isinstance(values, self._wp.array)
        if ours and (values.dtype is not dtype or values.device != self._device):
            problem = f"an array of {values.dtype.__name__} on {values.device}"
            raise ConfigError(problem, f"views.{name}", f"pass {dtype.__name__} on {self._device}")
        found = values.shape + getattr(dtype, "_shape_", ()) if ours else np.shape(values)
        if found != shape:
            raise ConfigError(f"an array of shape {found} does not fit", f"views.{name}", f"pass {shape}")
        if ours:
            return values
        if not np.isfinite(values).all():
            raise ConfigError("numbers must be finite", f"views.{name}")
        return self._array(values, dtype)

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
        When it is not installed, or cannot write its cache.
    """
    with require_extra("warp", RenderError):
        import warp
    warp.config.log_level = warp.LOG_WARNING
    try:
        with silence_output():  # on a machine without a GPU it says so, in C, in every process
            warp.init()
    except OSError as error:
        fix = "set WARP_CACHE_PATH to a folder that can be written"
        raise RenderError(f"Warp has no place for its compiled kernels ({error})", "warp", fix) from error
    return warp
