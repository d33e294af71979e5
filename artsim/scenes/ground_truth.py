"""Ground truth of a scene: for each articulated object that a camera sees, the same record as for one alone."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import ArrayLike, NDArray

from artsim.common.files import write_atomic
from artsim.datasets.shards import npy_bytes, png_bytes, sample_members
from artsim.errors import ConfigError
from artsim.formats.images import mask_box
from artsim.model.camera import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.sample import ARTSIM_VERSION, Sample
from artsim.observing.sensor import Sensor, find_sensor
from artsim.renderers import Renderer
from artsim.renderers.raycast import pose, render_posed
from artsim.renderers.scene import Scene, SceneFrame, Thing
from artsim.renderers.scene_renderer import render_scene
from artsim.scenes.missing_returns import MissingReturns, missing_returns


@dataclass(frozen=True, eq=False)
class SceneView:
    """One camera's view of a scene, with everything that is true of it.

    Attributes
    ----------
    scene : Scene
    camera : Camera
    frame : SceneFrame
        Free of noise.
    depth : (H, W) float32
        z-depth in metres as the sensor reports it, 0 = no return.
    samples : tuple of (Sample or None), one for each instance
        Cloud and ground truth, its points read from ``depth``, its part mask free of noise; None where the camera sees
        nothing of the instance.
    visible_fraction : (I,) float64
        Pixels that show each instance over those that it would cover alone; 0 outside the image.
    boxes : (I, 4) int64
        First column and row, end column and row of the pixels that show each instance; all 0 where none does.
    noise : str
        Name of the depth sensor.
    """

    scene: Scene
    camera: Camera
    frame: SceneFrame
    depth: NDArray[np.float32]
    samples: tuple[Sample | None, ...]
    visible_fraction: Array
    boxes: NDArray[np.int64]
    noise: str


def observe_scene(
    scene: Scene,
    cameras: Sequence[Camera],
    num_points: int = 2048,
    renderer: str | Renderer = "sapien",
    noise: str | Sensor = "none",
    seed: int = 0,
    rgb_samples: int = 8,
    misses: bool = False,
) -> list[SceneView]:
    """Look at a scene and write down what is true of each articulated object in it.

    Parameters
    ----------
    scene : Scene
    cameras : sequence of Camera
    num_points : int
        Of each instance's cloud.
    renderer : str or Renderer
        As in :func:`artsim.renderers.scene_renderer.render_scene`.
    noise : str or Sensor
        Depth sensor: one of ``artsim.observing.sensor.SENSORS``, or one of your own.
    seed : int
        Of noise, and of the choice of points; stored in the records.
    rgb_samples : int
        Pictures that each colour image is the mean of.
    misses : bool
        The sensor gets no return from patches of shiny and transparent surfaces: see
        :func:`artsim.scenes.missing_returns.missing_share`.

    Returns
    -------
    list of SceneView
        One for each camera.
    """
    if num_points < 1:
        raise ConfigError(f"a cloud of {num_points} points is empty", "num_points", "ask for at least 1")
    preset, name = find_sensor(noise), renderer if isinstance(renderer, str) else renderer.name
    views = []
    for number, (camera, frame) in enumerate(
        zip(cameras, render_scene(scene, cameras, renderer, rgb_samples), strict=True)
    ):
        # Every instance is read with the same chance, so that its points are those of the depth image.
        chance = [seed, 4, number]
        key = int(np.random.default_rng(chance).integers(2**63))
        sensor = preset
        if misses:
            missed = missing_returns(scene, frame, camera, np.random.default_rng([seed, 7, number]))
            sensor = replace(preset, name=f"{preset.name}+misses", steps=(*preset.steps, MissingReturns(missed)))
        depth = sensor.read_image(frame.depth, camera, key) if sensor.steps else frame.depth
        samples, fractions, boxes = [], [], []
        for i, thing in enumerate(scene.instances):
            shown = frame.instance_ids == i
            alone = render_posed(pose(thing.obj, thing.q, camera, thing.T_world_object))
            covered = int(np.count_nonzero(alone.part_ids != BACKGROUND))
            fractions.append(min(int(np.count_nonzero(shown)) / max(covered, 1), 1.0))
            boxes.append(mask_box(shown) or (0, 0, 0, 0))
            sample = None
            if (shown & (depth > 0)).any():
                part_ids = np.where(shown, frame.part_ids, np.uint8(BACKGROUND))
                window = _Window(name, Frame(frame.depth, part_ids, alone.amodal_pixels, frame.rgb))
                sample = observe(
                    thing.obj, thing.q, camera, thing.T_world_object, num_points, window, ("part_mask",), sensor,
                    np.random.default_rng(chance), seed, i,
                )  # fmt: skip
            samples.append(sample)
        views.append(
            SceneView(scene, camera, frame, depth, tuple(samples), np.array(fractions),
                      np.array(boxes, dtype=np.int64).reshape(-1, 4), sensor.name)
        )  # fmt: skip
    return views


@dataclass(eq=False)
class _Window:
    """A renderer that has one frame to show: an instance as the rest of the scene leaves it."""

    name: str
    frame: Frame

    def render(
        self, obj: ArticulatedObject, q: ArrayLike, camera: Camera, T_world_object: ArrayLike | None = None
    ) -> Frame:
        return self.frame

    def close(self) -> None:
        pass


def write_view(view: SceneView, folder: Path) -> None:
    """Write a view as files; see :func:`view_files`.

    Raises
    ------
    ConfigError
        When the folder cannot be written to.
    """
    for name, content in view_files(view).items():
        write_atomic(folder / name, content)


def view_files(view: SceneView) -> dict[str, bytes]:
    """A view as files, by name.

    ``rgb.png`` (where there is colour), ``depth.npy`` (metres), ``instance_ids.png`` and ``part_ids.png`` (a byte each,
    255 = none), ``scene.json`` (camera, and everything that stands in the scene by its instance id), and for each
    instance ``instance_<id>.*``, the members of a dataset's sample.
    """
    frame, files = view.frame, dict[str, bytes]()
    files["depth.npy"] = npy_bytes(view.depth)
    pictures = {"instance_ids": frame.instance_ids, "part_ids": frame.part_ids, "rgb": frame.rgb}
    files |= {f"{name}.png": png_bytes(image) for name, image in pictures.items() if image is not None}
    for i, sample in enumerate(view.samples):
        if sample is not None:
            files |= {f"instance_{i}.{member}": content for member, content in sample_members(sample).items()}
    files["scene.json"] = orjson.dumps(_description(view), option=orjson.OPT_SERIALIZE_NUMPY | orjson.OPT_INDENT_2)
    return files


def _description(view: SceneView) -> dict[str, Any]:
    scene, camera = view.scene, view.camera
    kinds = [("object", scene.instances), ("distractor", scene.distractors), ("support", scene.supports)]
    things = [_record(kind, thing) for kind, group in kinds for thing in group]
    for i, record in enumerate(things):
        record["instance_id"] = i
        if i < len(scene.instances):
            record |= {"visible_fraction": view.visible_fraction[i], "box": view.boxes[i]}
    return {
        "camera": {
            "K": camera.K, "width": camera.width, "height": camera.height, "T_world_camera": camera.T_world_camera
        },
        "noise": view.noise,
        "artsim_version": ARTSIM_VERSION,
        "things": things,
    }  # fmt: skip


def _record(kind: str, thing: Thing) -> dict[str, Any]:
    obj = thing.obj
    record: dict[str, Any] = {"kind": kind, "category": obj.category, "T_world_object": thing.T_world_object}
    if kind == "object":
        parts = [part.label for part in obj.parts]
        record |= {"object_id": obj.object_id, "scale": obj.scale, "joint_state": thing.q, "parts": parts}
    return record
