"""Two states of an object, each from many views, as PARIS and DigitalTwinArt reconstruct objects from.

The joint of the largest part moves from rest, and all others stay. Objects have a diagonal of 2 metres and the axes of
the rest frame. Cameras are OpenGL's: x right, y up, z backward. Colours are a pattern on the surface: of where a point
is at rest, never of which part it belongs to.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.formats.base import ObjectFormat
from artsim.formats.images import integer_centre_K, mask_png, png_bytes
from artsim.model.camera import Camera
from artsim.model.draws import bounding_sphere, joint_intervals
from artsim.model.frame import BACKGROUND
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.ply import mesh_ply
from artsim.model.transforms import invert_transform, transform_points
from artsim.renderers.raycast import pose, render_posed

VIEWS = {"train": 32, "val": 4, "test": 4}
"""Of each state."""
_PIXELS, _FOV = 400, np.deg2rad(45.0)
"""A camera's side and field of view."""
_T_CAMERA_GL = np.diag([1.0, -1.0, -1.0, 1.0])
_GREY = (180, 180, 180)
_SPAN, _TURN = 0.6, 0.5 * np.pi
"""Share of a joint's way that it moves; what one without ends turns, radians."""


class TwoStateFormat(ObjectFormat):
    """``<key>/start`` and ``end`` for PARIS; ``init_keyframes.yml``, images and ``gt`` for DigitalTwinArt."""

    def object_files(self, obj: ArticulatedObject) -> Iterator[tuple[str, bytes]]:
        """All files of an object; none of one that has no joint to move."""
        sized = obj.with_diagonal(2.0)
        if not len(sized.tree.free_joints):
            return
        joint, states = moved_joint(sized)
        yield "gt/trans.json", orjson.dumps(trans_info(sized, joint, states), option=orjson.OPT_SERIALIZE_NUMPY)
        keyframes, number, views = list[str](), 0, _cameras(sized, states)
        for time, (name, q) in enumerate(zip(("start", "end"), states, strict=True)):
            yield from _meshes(sized, joint, name, q)
            for split, cameras in views.items():
                told: dict[str, Any] = {"K": cameras[0].K}
                for view, camera in enumerate(cameras):
                    rgba, depth = _image(sized, q, camera)
                    told[f"{view:04d}"] = camera.T_world_camera @ _T_CAMERA_GL
                    yield f"{name}/{split}/{view:04d}.png", png_bytes(rgba)
                    if split == "train":
                        key, number = f"{number:04d}", number + 1
                        yield f"color_segmented/{key}.png", png_bytes(np.ascontiguousarray(rgba[..., :3]))
                        yield f"depth_filtered/{key}.png", png_bytes(np.rint(depth * 1000).astype(np.uint16))
                        yield f"mask/{key}.png", mask_png(depth > 0)
                        numbers = ", ".join(f"{x:.9g}" for x in told[f"{view:04d}"].ravel())
                        keyframes.append(f"frame_{key}:\n  cam_in_ob: [{numbers}]\n  time: {time}\n")
                yield f"{name}/camera_{split}.json", orjson.dumps(told, option=orjson.OPT_SERIALIZE_NUMPY)
        yield "init_keyframes.yml", "".join(keyframes).encode()
        rows = [" ".join(f"{x:.9g}" for x in row) for row in integer_centre_K(cameras[0].K)]
        yield "cam_K.txt", "\n".join(rows).encode()


def moved_joint(obj: ArticulatedObject) -> tuple[int, tuple[Array, Array]]:
    """The joint of the largest part that moves freely, and the states (K,) before and after."""
    followed = {joint.mimic.source for joint in obj.tree.joints if joint.mimic is not None}
    free = [k for k in obj.tree.free_joints.tolist() if k not in followed] or obj.tree.free_joints.tolist()
    joint = max(free, key=lambda k: float(np.prod(obj.box_size[k])))
    low, high = joint_intervals(obj)[joint]
    start, end = obj.tree.rest.copy(), obj.tree.rest.copy()
    if obj.tree.types[joint] == "continuous":
        end[joint] += _TURN
    else:
        farther = high if high - start[joint] >= start[joint] - low else low
        end[joint] += _SPAN * (farther - start[joint])
    return joint, (obj.tree.complete_state(start), obj.tree.complete_state(end))


def trans_info(obj: ArticulatedObject, joint: int, states: tuple[Array, Array]) -> dict[str, Any]:
    """What moves: the axis in the frame of the files, and how far; degrees, or metres of a slide."""
    slides = obj.tree.types[joint] == "prismatic"
    way = float(states[1][joint] - states[0][joint])
    still = {"l": 0.0, "r": 0.0}
    moved = {"l": 0.0, "r": way if slides else float(np.rad2deg(way))}
    told = {
        "type": "translate" if slides else "rotate",
        "axis": {"o": obj.tree.origins[joint], "d": obj.tree.axes[joint]},
        "rotate": still if slides else moved,
        "translate": moved if slides else still,
    }
    return {"trans_info": told}


def _meshes(obj: ArticulatedObject, joint: int, name: str, q: Array) -> Iterator[tuple[str, bytes]]:
    """Ground truth of a state: the whole, what stays, and what moves. Names end in what their readers expect."""
    import trimesh

    T = obj.tree.forward_kinematics(q)
    carried = {joint}
    for k in range(joint + 1, len(obj)):  # parents come first
        carried |= {k} if obj.tree.parents[k] in carried else set()
    every = set(range(len(obj)))
    for kind, chosen in (("static_", every - carried), ("dynamic_", carried), ("", every)):
        meshes = [obj.part_mesh(k).apply_transform(T[k]) for k in sorted(chosen) if len(obj.parts[k].faces)]
        if meshes:
            whole = trimesh.util.concatenate(meshes)
            yield f"gt/{name}/{name}_{kind}rotate.ply", mesh_ply(whole.vertices, whole.faces, _GREY)


def _cameras(obj: ArticulatedObject, states: tuple[Array, Array]) -> dict[str, list[Camera]]:
    """Cameras evenly all round, from just below the horizon to near the top, that see both states whole."""
    spheres = [bounding_sphere(obj, q) for q in states]
    middle = np.mean([center for center, _ in spheres], axis=0)
    reach = max(float(np.linalg.norm(center - middle)) + radius for center, radius in spheres)
    total = sum(VIEWS.values())
    heights = np.linspace(-0.2, 0.95, total)
    angles = np.arange(total) * np.pi * (3.0 - np.sqrt(5.0))  # the golden angle
    flat = np.sqrt(1.0 - heights**2)
    outward = np.stack([flat * np.cos(angles), flat * np.sin(angles), heights], axis=1)
    eyes = middle + outward * reach / np.sin(0.5 * _FOV)
    order = np.random.default_rng(0).permutation(total)
    made = [Camera.look_at(eye, middle, _PIXELS, _PIXELS, _FOV) for eye in eyes[order]]
    ends = np.cumsum([0, *VIEWS.values()])
    return {split: made[ends[n] : ends[n + 1]] for n, split in enumerate(VIEWS)}


def _image(obj: ArticulatedObject, q: Array, camera: Camera) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """(H, W, 4) colours and (H, W) depth of a state."""
    frame = render_posed(pose(obj, q, camera))
    seen = frame.part_ids != BACKGROUND
    pixels = np.flatnonzero(seen)
    world = transform_points(camera.T_world_camera, camera.unproject(pixels, frame.depth.ravel()[pixels]))
    T_part_rest = invert_transform(obj.tree.forward_kinematics(q))[frame.part_ids[seen]]
    rest = transform_points(T_part_rest, world[:, None])[:, 0]
    image = np.zeros((*seen.shape, 4), np.uint8)
    # Waves of several lengths, none a multiple of another, so that no two places look alike.
    waves = np.sin(rest @ np.array([[7.0, 13.0, 29.0], [11.0, 23.0, 5.0], [19.0, 3.0, 17.0]]))
    image[seen, :3] = (140.0 + 100.0 * waves).astype(np.uint8)
    image[seen, 3] = 255
    return image, np.where(seen, frame.depth, np.float32(0.0))
