"""The original ArtImage, for who has it: the files that OMAD's authors publish (Xue et al. 2021), read as samples.

The layout below a root, as OMAD's public loader reads it:

- ``camera_intrinsic.json``, of Open3D; the centre of the first pixel is at 0, 0;
- ``<category>/train.txt`` and ``test.txt``: names of annotation files, one a line;
- ``<category>/train/annotations/*.json``: ``depth_path`` and one of ``instances``, with its ``urdf_id``, ``bbox`` and
  ``links``, of which each has its ``link_category_id``, its ``transformation`` from the link at the file's zero to the
  camera, and its joint's ``state`` in degrees or lengths;
- the depth in millimetres, as 16 bits or as 256 G + R, and beside it ``category_mask`` with the number of the part;
- ``<category>/urdf/<id>/mobility_for_unity_align.urdf`` and ``part_point_sample/<part>.xyz``;
- ``<category>/urdf/rest_state.json``.

Its frames have y up: (x, y, z) of a URDF file is (y, z, x) there. Here a rest frame has z up again. Lengths are those
of PartNet-Mobility. The images themselves have not been seen here: tests read a folder of this layout that is written
from our own samples.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from artperl.core.part_order import reorder_sample, visible_order
from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage_records import (
    FIX,
    read_base_joint,
    read_joints,
    read_json_file,
    read_lines,
    read_points,
    read_values,
    require_file,
)
from artperl.inputs.intrinsics import read_intrinsics
from artsim.errors import DatasetError
from artsim.model.kinematics import Array
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.sample import ARTSIM_VERSION, Sample

Split = Literal["train", "test"]

TEST_IDS: dict[str, tuple[int, ...]] = {
    "laptop": (10040, 10885, 11242, 11030, 11156),
    "eyeglasses": (101300, 101859, 102586, 102590, 102596, 102612),
    "dishwasher": (11700, 12530, 12559, 12580),
    "drawer": (46123, 45841, 46440),
    "scissors": (10449, 10502, 10569, 10907),
}
"""Objects of the test split, as OMAD's public code lists them."""

REST_OF_THEIRS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""(3, 3) rotation from their axes, y up, to ours, z up."""
_SEEN = 0.03
"""A place of a part's surface is seen when an observed point is that near, in diagonals."""


@dataclass(frozen=True, eq=False)
class ArtImageObject:
    """What the files of one object say, in their axes, lengths in their unit. K parts, the root first."""

    surface: list[Array]
    """list of (n, 3) float, length K. Points of each part, in the rest state."""
    T_rest_zero: Array
    """(K, 4, 4) float. From the file's zero to the rest state."""
    kinds: tuple[str, ...]
    parents: NDArray[np.int64]
    """(K,) int64."""
    axis: Array
    origin: Array
    """(K, 3) float."""
    limits: Array
    """(K, 2) float. Of the joints, from the rest state on."""

    @property
    def bounds(self) -> tuple[Array, Array]:
        """(K, 3) least and greatest coordinates of each part in the rest state."""
        return np.stack([own.min(axis=0) for own in self.surface]), np.stack([own.max(axis=0) for own in self.surface])


class ArtImageFiles:
    """Frames of one category and split of a folder in ArtImage's layout.

    Parameters
    ----------
    root : Path
    category : str
    split : Split
        Frames that the split's list names, of objects of that split.
    num_points : int
        Points of a cloud, drawn from the pixels of the object.

    Raises
    ------
    DatasetError
        When the layout is another one.
    """

    def __init__(self, root: Path, category: str, split: Split = "test", num_points: int = 8192):
        if category not in ARTIMAGE:
            raise DatasetError(f"ArtImage has no {category!r:.40}", root, f"use {', '.join(ARTIMAGE)}")
        self.root, self.category, self.folder, self.num_points = root, category, root / category, num_points
        self.split, self.parts = split, len(ARTIMAGE[category]) + 1
        camera = root / "camera_intrinsic.json"
        require_file(camera)
        self.K = read_intrinsics(camera, "0")
        self.names = sorted(set(read_lines(self.folder / f"{split}.txt")))
        rest = self.folder / "urdf" / "rest_state.json"
        self._rest: dict[str, Any] = read_json_file(rest, self.root) if rest.is_file() else {}
        self.object = lru_cache(maxsize=64)(self._read_object)

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[Sample]:
        """Samples of the objects of the split, in the order of their names."""
        return self.samples()

    def samples(self, most: int | None = None) -> Iterator[Sample]:
        """Samples of the objects of the split; at most so many, evenly spread over the list.

        Raises
        ------
        DatasetError
            When a file is missing or damaged, or no object of the list is of the split.
        """
        own = [
            name for name in self.names if (self.number_of(name) in TEST_IDS[self.category]) == (self.split == "test")
        ]
        if not own:
            raise DatasetError(f"it lists no object of the split {self.split}", self.folder / f"{self.split}.txt", FIX)
        places = range(len(own)) if most is None else np.unique(np.linspace(0, len(own) - 1, most).round().astype(int))
        for place in places:
            yield self.read(own[place], int(place))

    def number_of(self, name: str) -> int:
        """Number of the object that an annotation file is of."""
        path = self.folder / "train" / "annotations" / name
        try:
            return int(read_json_file(path, self.root)["instances"][0]["urdf_id"])
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise DatasetError(f"this is no annotation of ArtImage ({error!r:.80})", path, FIX) from error

    def read(self, name: str, index: int = 0) -> Sample:
        """The sample of one annotation file.

        Raises
        ------
        DatasetError
            When files are missing or damaged; the message names the file.
        """
        path = self.folder / "train" / "annotations" / name
        frame = read_json_file(path, self.root)
        try:
            instance = frame["instances"][0]
            links = {int(link["link_category_id"]): link for link in instance["links"]}
            raw = np.array([links[k]["transformation"] for k in range(self.parts)], dtype=np.float64)
            number = int(instance["urdf_id"])
            left, top, right, bottom = (int(value) for value in instance["bbox"])
            pictures = self.folder / "train"
            depth_path = pictures / str(frame["depth_path"])
            mask_path = pictures / str(frame["depth_path"]).replace("depth", "category_mask")
            if raw.shape != (self.parts, 4, 4) or not np.isfinite(raw).all() or len(frame["instances"]) != 1:
                raise ValueError("one instance with a 4 x 4 transformation for each part is expected")
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise DatasetError(f"this is no annotation of ArtImage ({error!r:.80})", path, FIX) from error
        depth, mask = self._depth(depth_path), self._mask(mask_path)
        if depth.shape != mask.shape:
            raise DatasetError(f"its size {mask.shape} is not that of the depth {depth.shape}", mask_path, FIX)
        window = np.zeros(depth.shape, dtype=bool)
        window[top:bottom, left:right] = True
        pixels = np.flatnonzero((window & (depth > 0) & (mask < self.parts)).ravel())
        if not len(pixels):
            raise DatasetError("no pixel within its box shows the object", depth_path, FIX)
        rng = np.random.default_rng([number, index])
        order = [rng.permutation(pixels) for _ in range(-(-self.num_points // len(pixels)))]
        chosen = np.concatenate(order)[: self.num_points]
        v, u = np.divmod(chosen, depth.shape[1])
        z = depth.ravel()[chosen]
        rays = np.stack([(u - self.K[0, 2] + 0.5) / self.K[0, 0], (v - self.K[1, 2] + 0.5) / self.K[1, 1]], axis=1)
        points = np.column_stack([rays * z[:, None], z])
        return self._sample(number, raw, points, mask.ravel()[chosen], depth.shape, index)

    def _sample(
        self, number: int, raw: Array, points: Array, part: NDArray[np.uint8], shape: tuple[int, ...], index: int
    ) -> Sample:  # fmt: skip
        obj, P = self.object(number), REST_OF_THEIRS
        low, high = obj.bounds
        middle = 0.5 * (low.min(axis=0) + high.max(axis=0))
        T_theirs_rest = np.eye(4)  # from our rest frame, centred, to the rest state in their axes
        T_theirs_rest[:3, :3], T_theirs_rest[:3, 3] = P.T, middle
        T = raw @ invert_transform(obj.T_rest_zero) @ T_theirs_rest
        center, size = (0.5 * (low + high) - middle) @ P.T, np.abs((high - low) @ P.T)
        axis, origin = obj.axis @ P.T, (obj.origin - middle) @ P.T
        origin[0] = 0.0
        diagonal = float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
        above = np.maximum(obj.parents, 0)
        rest = np.einsum("nji,nj->ni", T[part, :3, :3], points - T[part, :3, 3])
        frame = np.linalg.norm(size, axis=1)
        sample = Sample(
            points=points.astype(np.float32), part=part.astype(np.uint8),
            npcs=((rest - center[part]) / frame[part, None] + 0.5).astype(np.float32), T_camera_part=T,
            box_center=center, box_size=size,
            visible_fraction=_seen_shares(obj.surface, raw, obj.T_rest_zero, points, part, _SEEN * diagonal),
            joint_type=obj.kinds, joint_parent=obj.parents, joint_axis=axis, joint_origin=origin,
            joint_axis_camera=np.einsum("kij,kj->ki", T[above, :3, :3], axis),
            joint_origin_camera=np.einsum("kij,kj->ki", T[above, :3, :3], origin) + T[above, :3, 3],
            joint_state=_states(T, obj.kinds, obj.parents, axis, center), joint_rest=np.zeros(self.parts),
            joint_limits=obj.limits, K=self.K, T_world_camera=np.eye(4), width=shape[1], height=shape[0],
            part_names=tuple(f"part_{k}" for k in range(self.parts)), category=self.category, object_id=str(number),
            object_sha256=f"artimage-{number}", scale=1.0, diagonal=diagonal, seed=-1, index=index,
            renderer="artimage", artsim_version=ARTSIM_VERSION,
        )  # fmt: skip
        return reorder_sample(sample, visible_order(sample.joint_parent, sample.box_center, sample.box_size))

    def _read_object(self, number: int) -> ArtImageObject:
        folder = self.folder / "urdf" / str(number)
        joints = {joint.child: joint for joint in read_joints(folder / "mobility_for_unity_align.urdf", self.root)}
        expected = set(range(1, self.parts))
        if set(joints) != expected:
            raise DatasetError(
                f"its joints move links {sorted(joints)}, and the category has {sorted(expected)}",
                folder / "mobility_for_unity_align.urdf", FIX,
            )  # fmt: skip
        T_rest_zero, state = np.tile(np.eye(4), (self.parts, 1, 1)), np.zeros(self.parts)
        for k, joint in joints.items():
            try:
                state[k] = float(self._rest[str(number)][str(k)]["state"]) if str(number) in self._rest else 0.0
            except (KeyError, TypeError, ValueError) as error:
                raise DatasetError(
                    f"object {number} has no state of link {k} ({error!r:.60})",
                    self.folder / "urdf" / "rest_state.json", FIX,
                ) from error  # fmt: skip
            # The file counts turns the other way round.
            turn = -np.deg2rad(state[k]) if joint.kind != "prismatic" else state[k]
            T_rest_zero[k] = _motion(joint.kind, joint.axis, joint.origin, turn)
        aligned = self._alignment(folder) if self.category == "scissors" else np.eye(4)
        T_rest_zero = aligned @ T_rest_zero
        surface = []
        for k in range(self.parts):
            path = folder / "part_point_sample" / f"{k}.xyz"
            own = read_points(path, self.root)
            surface.append(transform_points(T_rest_zero[k], own))
        axis, origin = np.zeros((self.parts, 3)), np.zeros((self.parts, 3))
        limits = np.zeros((self.parts, 2))
        axis[0, 2] = 1.0
        for k, joint in joints.items():
            axis[k] = aligned[:3, :3] @ joint.axis
            origin[k] = aligned[:3, :3] @ joint.origin + aligned[:3, 3]
            if joint.kind == "prismatic":
                limits[k] = joint.limits - state[k]
            else:
                limits[k] = -(joint.limits - np.deg2rad(state[k]))[::-1]
        kinds = ("free", *(joints[k].kind for k in range(1, self.parts)))
        parents = np.array([-1, *(joints[k].parent for k in range(1, self.parts))], dtype=np.int64)
        return ArtImageObject(surface, T_rest_zero, kinds, parents, axis, origin, limits)

    def _alignment(self, folder: Path) -> Array:
        """(4, 4) how a pair of scissors is turned so that its rest state is that of the others.

        It is the difference of the base joints of two URDF files, angles and places subtracted number by number.
        """
        old, new = (
            read_base_joint(folder / name, self.root)
            for name in ("mobility_for_unity.urdf", "mobility_for_unity_align.urdf")
        )
        angles, place = (after - before for before, after in zip(old, new, strict=True))
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("ZXY", [-angles[0], angles[2], -angles[1]]).as_matrix()
        T[:3, 3] = -place[0], place[2], -place[1]
        return T

    def _depth(self, path: Path) -> Array:
        """(H, W) metres."""
        values = read_values(path, self.root, "depth image")
        if values.ndim == 3:
            values = 256.0 * values[..., 1] + values[..., 0]
        return values.astype(np.float64) / 1000.0

    def _mask(self, path: Path) -> NDArray[np.uint8]:
        values = read_values(path, self.root, "mask")
        own: NDArray[np.uint8] = (values[..., 2] if values.ndim == 3 else values).astype(np.uint8)
        return own


def _motion(kind: str, axis: Array, origin: Array, amount: float) -> Array:
    """(4, 4) what a joint does by an amount, radians or lengths."""
    T = np.eye(4)
    if kind == "prismatic":
        T[:3, 3] = amount * axis
    else:
        T[:3, :3] = Rotation.from_rotvec(amount * axis).as_matrix()
        T[:3, 3] = origin - T[:3, :3] @ origin
    return T


def _states(
    T: Array, kinds: Sequence[str], parents: NDArray[np.int64], axis: Array, center: Array
) -> Array:  # fmt: skip
    """(K,) states by the poses themselves, whatever the sign of the annotation's."""
    state = np.zeros(len(kinds))
    for k in range(1, len(kinds)):
        motion = invert_transform(T[parents[k]]) @ T[k]
        if kinds[k] == "prismatic":
            state[k] = (transform_points(motion, center[k : k + 1])[0] - center[k]) @ axis[k]
        else:
            state[k] = Rotation.from_matrix(motion[:3, :3]).as_rotvec() @ axis[k]
    return state


def _seen_shares(
    surface: Sequence[Array], raw: Array, T_rest_zero: Array, points: Array, part: NDArray[np.uint8], near: float
) -> Array:  # fmt: skip
    """(K,) share of each part's surface that has an observed point of the part near it."""
    shares = np.zeros(len(surface))
    for k, own in enumerate(surface):
        observed = points[part == k]
        if len(observed):
            posed = transform_points(raw[k] @ invert_transform(T_rest_zero[k]), own)
            shares[k] = np.isfinite(cKDTree(observed).query(posed, distance_upper_bound=near)[0]).mean()
    return shares
