"""Look at a posed object: its cloud with the ground truth, as rendered, cast and read by a sensor."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import log
from artsim.common.products import matmul
from artsim.common.sequences import listed
from artsim.errors import ConfigError, RenderError
from artsim.model.camera import Camera
from artsim.model.draws import sample_view
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.noise import Look, PixelView
from artsim.observing.sample import ARTSIM_VERSION, IMAGES, Sample
from artsim.observing.sensor import Sensor, find_sensor
from artsim.renderers import Renderer, ray_kernels, render, shared_renderer
from artsim.renderers.raycast import PosedObject, cast, cast_counted, pose, render_posed, visibility


def observe(
    obj: ArticulatedObject,
    q: ArrayLike | None = None,
    camera: Camera | None = None,
    T_world_object: ArrayLike | None = None,
    num_points: int = 2048,
    renderer: str | Renderer = "raycast",
    images: tuple[str, ...] = (),
    noise: str | Sensor = "none",
    rng: np.random.Generator | None = None,
    seed: int = -1,
    index: int = -1,
    details: bool = False,
) -> Sample:
    """Look at a posed object and write down the cloud with its ground truth.

    The cloud is ``num_points`` pixels drawn uniformly without replacement from those that show the object (with
    replacement once there are fewer). Without images, ``raycast`` casts only as many of them as the cloud needs:
    the same pixels are looked at in both cases, so that the same ``rng`` gives the same cloud. With noise, those are
    pixels at which the sensor reports something; all else that the sample says stays free of noise.

    Parameters
    ----------
    obj : ArticulatedObject
    q : (K,) float, optional
        Joint states in radians or metres; the root's entry is ignored. By default, the object is at rest.
    camera : Camera, optional
        Drawn by :func:`artsim.sample_view` by default: it sees the whole object, from the front.
    T_world_object : (4, 4) float, optional
        Pose of the rest frame in the world; identity by default.
    num_points : int
    renderer : str or Renderer
        One of ``artsim.renderers.RENDERERS``, or one of your own.
    images : tuple of str
        Which of ``IMAGES`` to keep.
    noise : str or Sensor
        Depth sensor: one of ``artsim.observing.sensor.SENSORS``, or one of your own.
    rng : numpy Generator, optional
        Seeded with 0 by default.
    seed, index : int
        Stored in the record.
    details : bool
        Say of each point which handle, knob or pane it is on.

    Returns
    -------
    Sample

    Raises
    ------
    RenderError
        When the camera does not see the object at all.
    ConfigError
        When an option makes no sense.
    """
    if num_points < 1:
        raise ConfigError(f"a cloud of {num_points} points is empty", "num_points", "ask for at least 1")
    images = tuple(listed(images))
    unknown = set(images) - set(IMAGES)
    if unknown:
        raise ConfigError(f"there is no image {', '.join(sorted(unknown))}", "images", f"use {', '.join(IMAGES)}")
    rng, q = rng or np.random.default_rng(0), obj.tree.rest if q is None else q
    if camera is None:
        camera = sample_view(obj, q, rng=rng)
        if T_world_object is not None:
            T = matmul(np.asarray(T_world_object, dtype=np.float64), camera.T_world_camera)
            camera = replace(camera, T_world_camera=T)
    name, sensor = renderer if isinstance(renderer, str) else renderer.name, find_sensor(noise)
    key = int(rng.integers(2**63)) if sensor.steps else 0
    posed = pose(obj, q, camera, T_world_object)
    frame = None
    if images or name != "raycast":
        drawer = shared_renderer(renderer) if isinstance(renderer, str) else renderer
        frame = drawer.render(obj, q, camera, T_world_object)
        look = _lookup(frame)
        pixels, depth, part = draw_visible(posed, _read_sensor(look, look, camera, sensor, key), num_points, rng)
        visible_fraction = _exact_visible_fraction(posed, frame)
    else:
        rays, look = _Rays(posed), _in_any_order(posed)
        pixels, depth, part = draw_visible(posed, _read_sensor(rays, look, camera, sensor, key), num_points, rng)
        visible_fraction = rays.visible_fraction()
    if len(pixels) == 0:
        raise RenderError("the camera does not see the object", obj.object_id, "move the camera or the object")
    true_depth = look(*np.divmod(pixels, camera.width))[0] if sensor.steps else depth
    if sensor.steps and "depth" in images:
        assert frame is not None
        frame = replace(frame, depth=sensor.read_image(frame.depth, camera, key))
    points, npcs = _labelled(pixels, depth, true_depth, part, posed)
    wanted = {image: None if frame is None else getattr(frame, field) for image, field in _FRAME_FIELDS.items()}
    if "rgb" in images and wanted["rgb"] is None:
        raise ConfigError(
            f"renderer {name!r} makes no rgb", "images", "use a renderer that does, such as sapien or pybullet"
        )
    tree = obj.tree
    axis_camera, origin_camera = tree.posed_joints(posed.T_camera_part)
    sample = Sample(
        points=points,
        part=part,
        npcs=npcs,
        T_camera_part=posed.T_camera_part,
        box_center=obj.box_center,
        box_size=obj.box_size,
        visible_fraction=visible_fraction,
        joint_type=tree.types,
        joint_parent=tree.parents,
        joint_axis=tree.axes,
        joint_origin=tree.origins,
        joint_axis_camera=axis_camera,
        joint_origin_camera=origin_camera,
        joint_state=tree.complete_state(q),
        joint_rest=tree.rest,
        joint_limits=tree.limits,
        K=camera.K,
        T_world_camera=camera.T_world_camera,
        width=camera.width,
        height=camera.height,
        part_names=tuple(p.label for p in obj.parts),
        category=obj.category,
        object_id=obj.object_id,
        object_sha256=obj.sha256,
        scale=obj.scale,
        diagonal=obj.diagonal,
        seed=seed,
        index=index,
        renderer=name,
        artsim_version=ARTSIM_VERSION,
        noise=sensor.name,
        details=obj.details,
        **{image: value if image in images else None for image, value in wanted.items()},
    )
    return replace(sample, detail=obj.detail_of_points(sample.rest_points, part)) if details else sample


_FRAME_FIELDS = {"depth": "depth", "part_mask": "part_ids", "rgb": "rgb"}


def frame_of(sample: Sample, obj: ArticulatedObject) -> Frame:
    """The frame of a sample of an object: its images, or the view rendered again."""
    if sample.depth is not None and sample.part_mask is not None:
        return Frame(sample.depth, sample.part_mask, rgb=sample.rgb)
    camera = Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
    return render(obj, sample.joint_state, camera, matmul(sample.T_world_camera, sample.T_camera_part[0]))


def _lookup(frame: Frame) -> Look:
    return lambda row, column: (frame.depth[row, column], frame.part_ids[row, column])


def _in_any_order(posed: PosedObject) -> Look:
    """Casts one ray through each pixel asked for, however often it is asked for."""
    width = posed.camera.width

    def look(row: NDArray[np.int64], column: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        pixels, back = np.unique(row * width + column, return_inverse=True)
        depth, part, _ = cast(posed, *np.divmod(pixels, width))
        return depth[back], part[back]

    return look


def _read_sensor(look: Look, around: Look, camera: Camera, sensor: Sensor, key: int) -> Look:
    """What a sensor reports: pixels without a return show nothing.

    Parameters
    ----------
    look : Look
        The noise-free scene at the pixels asked for.
    around : Look
        The noise-free scene anywhere else.
    camera : Camera
    sensor : Sensor
    key : int
        Of all chance.
    """
    if not sensor.steps:
        return look

    def sensed(row: NDArray[np.int64], column: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        depth, part = look(row, column)
        hit = (part != BACKGROUND).nonzero()[0]
        reading, shown = np.zeros_like(depth), np.full_like(part, BACKGROUND)
        reading[hit] = sensor.read(PixelView(around, camera, row[hit], column[hit], depth[hit], key))
        shown[reading > 0] = part[reading > 0]
        return reading, shown

    return sensed


def draw_visible(
    posed: PosedObject, look: Look, num_points: int, rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.uint8]]:
    """Look at random pixels that the object can cover until ``num_points`` of them show it.

    Returns
    -------
    pixels : (num_points,) int
        Flat indices, all different, unless fewer pixels show the object: then some are drawn again with replacement.
        Empty when none does.
    depth : (num_points,) float32
    part : (num_points,) uint8
    """
    first, end = posed.candidates()
    up_to = np.cumsum(end - first)  # candidates in the rows so far
    total, width = int(up_to[-1]), posed.camera.width
    fresh = np.ones(total, dtype=bool)
    hits: list[tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.uint8]]] = []
    found = visited = 0
    while found < num_points and visited < total:
        # As many as it should take, judging by the share of hits so far (at first, by experience), and a few more.
        share = found / visited if found else 0.82 / (1 + visited)
        missing = num_points - found
        wanted = min(int((missing + 2.5 * np.sqrt(missing * (1.03 - share))) / share) + 16, total)
        row, column = _draw_candidates(wanted, total - visited, fresh, up_to, end, rng)
        depth, part = look(row, column)
        hits.append(ray_kernels.hits(row, column, depth, part, width))
        visited, found = visited + len(row), found + len(hits[-1][0])
    if found == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.float32), np.zeros(0, np.uint8)
    # Every visible pixel has had the same chance so far, so that any choice among those found is uniform.
    chosen = rng.permutation(found)[:num_points]
    if found < num_points:
        chosen = np.concatenate([chosen, rng.integers(0, found, size=num_points - found)])
    pixels, depth, part = (np.concatenate(column)[chosen] for column in zip(*hits, strict=True))
    return pixels, depth, part


def _draw_candidates(
    wanted: int,
    left: int,
    fresh: NDArray[np.bool_],
    up_to: NDArray[np.int64],
    end: NDArray[np.int64],
    rng: np.random.Generator,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows and columns, in order, of about so many of the candidates ``left``: the ``fresh`` ones."""
    pixels: tuple[NDArray[np.int64], NDArray[np.int64]]
    if wanted > left // 2:
        rest = fresh.nonzero()[0]
        local = rest if wanted > 0.7 * left else np.sort(rng.permutation(rest)[:wanted])
    else:
        # Numbers drawn with replacement repeat each other and earlier rounds: so many leave ``wanted`` new ones.
        drawn = rng.integers(0, len(fresh), size=int(-len(fresh) * log(1.0 - wanted / left)))
        pixels = ray_kernels.unvisited(np.sort(drawn), fresh, up_to, end)
        return pixels
    fresh[local] = False
    pixels = ray_kernels.pixels_of(local, up_to, end)
    return pixels


class _Rays:
    """A :data:`Look` that casts rays and counts, for each part, how many met it and how many saw it."""

    enough = 100
    """Amodal hits from which a part's visible fraction is estimated; parts with fewer are looked at more closely."""

    def __init__(self, posed: PosedObject):
        self.posed = posed
        self.met = np.zeros(len(posed.obj), dtype=np.int64)
        self.saw = np.zeros(len(posed.obj), dtype=np.int64)

    def __call__(
        self, row: NDArray[np.int64], column: NDArray[np.int64]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        depth, part, met, saw = cast_counted(self.posed, row, column)
        self.met += met
        self.saw += saw
        return depth, part

    def visible_fraction(self) -> Array:
        """(K,) estimate with a standard error of at most about 0.05."""
        counts = np.stack([self.met, self.saw], axis=1)
        few = np.flatnonzero(self.met < self.enough).tolist()
        if few:
            counts[few] += visibility(self.posed, few, max_rays=256)
        met, saw = counts.T
        fraction: Array = saw / np.maximum(met, 1)
        return fraction


def _exact_visible_fraction(posed: PosedObject, frame: Frame) -> Array:
    """(K,) visible pixels of the frame over amodal pixels, which are cast where the renderer does not count them."""
    amodal = frame.amodal_pixels
    if amodal is None:
        amodal = render_posed(posed).amodal_pixels
    assert amodal is not None
    visible = np.bincount(frame.part_ids.ravel(), minlength=BACKGROUND + 1)[: len(amodal)]
    # A rasteriser may cover a pixel more than the rays do at a silhouette.
    fraction: Array = np.minimum(visible / np.maximum(amodal, 1), 1.0)
    return fraction


def _labelled(
    pixels: NDArray[np.int64],
    depth: NDArray[np.float32],
    true_depth: NDArray[np.float32],
    part: NDArray[np.uint8],
    posed: PosedObject,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(N, 3) points that are reported, and (N, 3) normalised coordinates of the places that their rays truly meet."""
    camera, obj = posed.camera, posed.obj
    K, T = np.array(camera.K, dtype=np.float64, order="C"), np.ascontiguousarray(posed.T_camera_part)
    both: tuple[NDArray[np.float32], NDArray[np.float32]] = ray_kernels.labels(
        pixels, depth, true_depth, part, camera.width, K, T, obj.box_center, obj.box_size
    )
    return both
