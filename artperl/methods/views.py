"""One object in several clouds: from several sides while it stands still, or while its joints move.

Perception is trained on what one camera sees, so that the merged cloud of several cameras is only one more cloud to
estimate: of the estimates of each and of all together, the surest is taken. Where joints have moved, the poses of a
part's box against its parent's, in several frames, tell its motion: it chooses among the joints that the frames have,
and where none explains how far a part has turned, its hinge is that of the motion.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from artperl.core.clouds import is_measured
from artperl.core.estimate import Estimate, points_at_rest
from artperl.core.neighbours import tree_of
from artperl.perception.preprocess import as_cloud
from artsim.errors import ArtsimError, ConfigError
from artsim.model.kinematics import Array
from artsim.model.transforms import compose_transform, invert_transform, rotation_about, transform_points

_QUARTERS = [rotation_about([0.0, 0.0, 1.0], 0.5 * np.pi * n) for n in range(4)]
"""Rest frames of boxes that look alike differ by quarter turns about the vertical."""
_UNLIKE = 0.4
"""Difference of two boxes at rest, centre and size, in diagonals, from which they are no more alike than none is."""
_TURN_COST = 0.05
"""In the same unit: a quarter turn has to bring so much."""
_STILL = 0.03
"""Motion of a part, in diagonals, below which errors of its boxes say as much as it does."""
_UNEXPLAINED = 0.35
"""Share of a motion that an estimated joint may leave unexplained before another one takes its place."""
_TURNED = np.deg2rad(30.0)
"""Angle from which a part has turned. Boxes are turned wrongly by less, while how far they have slid is known too badly
to tell a slide: they are longer or shorter by as much."""


@dataclass(frozen=True)
class Joint:
    """How a part moves against its parent: axis and origin (3,) float in one frame; the axis has length 1."""

    kind: str
    axis: Array
    origin: Array

    def motion(self, amount: float) -> Array:
        """(4, 4) displacement by so many radians or metres."""
        if self.kind == "prismatic":
            return compose_transform(amount * self.axis)
        rotation = rotation_about(self.axis, amount)
        return compose_transform(self.origin - rotation @ self.origin, rotation)

    def amount(self, displacement: Array, point: Array) -> float:
        """How far the joint has moved by a displacement (4, 4) of a part that has this point (3,)."""
        if self.kind in ("free", "fixed"):
            return 0.0
        if self.kind == "prismatic":
            return float((transform_points(displacement, point[None])[0] - point) @ self.axis)
        w, *vector = np.roll(Rotation.from_matrix(displacement[:3, :3]).as_quat(), 1)
        return float(np.remainder(2.0 * np.arctan2(np.array(vector) @ self.axis, w) + np.pi, 2.0 * np.pi) - np.pi)

    def moved(self, T: Array) -> Joint:
        """The joint in another frame, by ``T_to_from`` (4, 4)."""
        return Joint(self.kind, T[:3, :3] @ self.axis, transform_points(T, self.origin[None])[0])


def hinge(displacement: Array, point: Array) -> Joint:
    """The hinge of a rigid displacement (Chasles' theorem, in closed form); what slides along the axis is left out.

    Parameters
    ----------
    displacement : (4, 4) float
        That turns.
    point : (3,) float
        The origin is the foot of its perpendicular on the axis.
    """
    turn = Rotation.from_matrix(displacement[:3, :3]).as_rotvec()
    way = transform_points(displacement, point[None])[0] - point
    angle = float(np.linalg.norm(turn))
    axis = turn / angle
    across = way - (way @ axis) * axis
    return Joint("revolute", axis, point + 0.5 * (across + np.cross(axis, across) / np.tan(0.5 * angle)))


def estimate_views(
    estimate: Callable[[ArrayLike], Estimate], clouds: Sequence[ArrayLike], T_world_camera: ArrayLike
) -> Estimate:
    """The estimate of an object that stands still, by clouds from several sides.

    Parameters
    ----------
    estimate : callable
        Estimates one cloud.
    clouds : sequence of (N, 3) float
        Each in its camera's frame, metres.
    T_world_camera : (V, 4, 4) float

    Returns
    -------
    Estimate
        In the frame of the first camera; ``part`` is of the points of all clouds, in their order.

    Raises
    ------
    ConfigError
        When there is not one rigid pose for each cloud.
    ArtsimError
        When no cloud shows an object.
    """
    poses = _poses(T_world_camera, len(clouds))
    points = [_measured(cloud) for cloud in clouds]
    found, failures = list[tuple[Estimate, Array, Array]](), list[ArtsimError]()

    def look(cloud: Array, pose: Array) -> None:
        try:
            found.append((estimate(cloud), cloud, pose))
        except ArtsimError as error:
            failures.append(error)

    for cloud, pose in zip(points, poses, strict=True):
        look(cloud, pose)
    if not found:
        raise failures[0]
    if len(clouds) > 1:  # as the surest camera sees it, so that the order of clouds does not matter
        pose = max(found, key=lambda each: _sureness(each[0]))[2]
        look(_merged(points, poses, pose), pose)
    best, cloud, pose = max(found, key=lambda each: _sureness(each[0]))
    told = tuple(dict.fromkeys(text for each, _, _ in found for text in each.warnings))
    moved = _moved(best, invert_transform(poses[0]) @ pose)
    return replace(moved, part=_labels(_merged(points, poses, pose), cloud, best.part), warnings=told)


def estimate_frames(estimate: Callable[[ArrayLike], Estimate], clouds: Sequence[ArrayLike]) -> list[Estimate]:
    """Estimates of one object in several frames, between which it, its joints and the camera may have moved.

    Parameters
    ----------
    estimate : callable
        Estimates one cloud.
    clouds : sequence of (N, 3) float
        Each in its camera's frame, metres.

    Returns
    -------
    list of Estimate
        One for each cloud, of the same parts, boxes and joints. A part that is not seen in a frame is where it was in
        the surest one, with visibility and confidence 0.

    Raises
    ------
    ArtsimError
        When a cloud shows no object.
    """
    return as_one_object([estimate(cloud) for cloud in clouds])


def as_one_object(estimates: Sequence[Estimate]) -> list[Estimate]:
    """Estimates of frames with the parts, boxes and joints of the surest one, whose joints the motion corrects."""
    if not estimates:
        return []
    anchor = max(estimates, key=_sureness)
    frames = [_Frame.of(anchor, other) for other in estimates]
    joints = [_choose(anchor, frames, k) for k in range(len(anchor.state))]
    steps = np.array([[frame.step(anchor, k, joint) for k, joint in enumerate(joints)] for frame in frames])
    return [_in_frame(anchor, joints, frame, own, steps) for frame, own in zip(frames, steps, strict=True)]


@dataclass(frozen=True, eq=False)
class _Frame:
    """What another frame says of the anchor's parts."""

    estimate: Estimate
    own: dict[int, int]
    """Its parts, by the anchor's; roots go with each other."""
    box: Array
    """(K, 4, 4) float. Poses of the anchor's boxes, where they are seen, with the anchor's axes."""

    @staticmethod
    def of(anchor: Estimate, other: Estimate) -> _Frame:
        """Parts paired such that their boxes at rest are alike, up to quarter turns of the rest frame."""
        rest, diagonal = _from_root(anchor), float(np.linalg.norm(anchor.size[0]))
        best: tuple[float, Array, dict[int, int]] = (np.inf, np.eye(3), {})
        for turn in _QUARTERS:
            size = other.size @ np.abs(turn.T)
            away = np.linalg.norm(rest[:, None] - (_from_root(other) @ turn.T)[None], axis=-1)
            cost = np.minimum((away + np.linalg.norm(anchor.size[:, None] - size[None], axis=-1)) / diagonal, _UNLIKE)
            a, b = linear_sum_assignment(cost[1:, 1:])
            total = cost[0, 0] + cost[a + 1, b + 1].sum() + (_TURN_COST if turn is not _QUARTERS[0] else 0.0)
            if total < best[0]:
                pairs = {int(k): int(m) for k, m in zip(a + 1, b + 1, strict=True) if cost[k, m] < _UNLIKE}
                best = total, turn, {0: 0, **pairs}
        _, turn, own = best
        box = np.tile(np.eye(4), (len(anchor.state), 1, 1))
        for k, m in own.items():
            box[k] = compose_transform(other.translation[m], other.rotation[m] @ turn.T)
        return _Frame(other, own, box)

    def displacement(self, anchor: Estimate, k: int) -> tuple[Array, Array] | None:
        """Of part k against its parent, (4, 4) in the anchor's camera frame, and ``T_anchor_frame`` by the parent."""
        parent = int(anchor.joint_parent[k])
        if k not in self.own or parent not in self.own:
            return None
        T = compose_transform(anchor.translation[parent], anchor.rotation[parent]) @ invert_transform(self.box[parent])
        return T @ self.box[k] @ invert_transform(compose_transform(anchor.translation[k], anchor.rotation[k])), T

    def step(self, anchor: Estimate, k: int, joint: Joint) -> float:
        """How far part k has moved along a joint; 0 for the root, and where it is not seen."""
        found = self.displacement(anchor, k) if k else None
        return 0.0 if found is None else joint.amount(found[0], anchor.translation[k])


def _choose(anchor: Estimate, frames: Sequence[_Frame], k: int) -> Joint:
    """Of the joints that frames have for part k, that which explains its motion best; else the hinge of the motion."""
    own = _joint(anchor, k)
    seen = [(frame, *found) for frame in frames if k and (found := frame.displacement(anchor, k)) is not None]
    center, reach = anchor.translation[k], 0.5 * float(np.linalg.norm(anchor.size[k]))
    moves = [displacement for _, displacement, _ in seen]
    total = sum(_length(move, center, reach) for move in moves)
    if total < _STILL * float(np.linalg.norm(anchor.size[0])):
        return own

    def left(joint: Joint) -> float:
        rest = (invert_transform(joint.motion(joint.amount(move, center))) @ move for move in moves)
        return sum(_length(move, center, reach) for move in rest)

    if left(own) < _UNEXPLAINED * total:
        return own
    best = min([own, *(_joint(frame.estimate, frame.own[k]).moved(T) for frame, _, T in seen)], key=left)
    most = max(moves, key=lambda move: float(Rotation.from_matrix(move[:3, :3]).magnitude()))
    if left(best) < _UNEXPLAINED * total or Rotation.from_matrix(most[:3, :3]).magnitude() < _TURNED:
        return best
    return min([best, hinge(most, center)], key=left)


def _in_frame(anchor: Estimate, joints: Sequence[Joint], frame: _Frame, step: Array, steps: Array) -> Estimate:
    """The anchor's object as a frame shows it, whose parts have made steps (K,), of those of all frames (F, K)."""
    K, own = len(joints), frame.estimate
    move = np.tile(np.eye(4), (K, 1, 1))  # from the anchor's camera frame, as carried by each part, to this one
    move[0] = frame.box[0] @ invert_transform(compose_transform(anchor.translation[0], anchor.rotation[0]))
    state, limits, axis, origin = anchor.state.copy(), anchor.joint_limits.copy(), np.zeros((K, 3)), np.zeros((K, 3))
    for k, joint in enumerate(joints):
        parent = max(int(anchor.joint_parent[k]), 0)
        if k:
            center = anchor.translation[k]
            at_rest = anchor.T_camera_part[k] @ invert_transform(anchor.T_camera_part[parent])
            kept = joint.kind == anchor.joint_type[k] and np.array_equal(joint.axis, anchor.joint_axis[k])
            start = float(state[k]) if kept else joint.amount(at_rest, center)
            state[k], move[k] = start + step[k], move[parent] @ joint.motion(float(step[k]))
            if not kept:
                limits[k] = start + steps[:, k].min(), start + steps[:, k].max()
        posed = joint.moved(move[parent])
        axis[k], origin[k] = posed.axis, posed.origin
    T = move @ anchor.T_camera_part
    seen = np.array([k in frame.own for k in range(K)])
    of = np.array([frame.own.get(k, 0) for k in range(K)])
    names = np.full(len(own.state) + 1, -1)
    names[list(frame.own.values())] = list(frame.own)
    return replace(
        anchor, rotation=T[:, :3, :3], translation=transform_points(move, anchor.translation[:, None])[:, 0],
        T_camera_part=T, state=state, joint_limits=limits,
        joint_type=tuple(joint.kind for joint in joints), joint_axis=axis, joint_origin=origin, part=names[own.part],
        visibility=own.visibility[of] * seen, part_confidence=own.part_confidence[of] * seen, trajectory=T[None],
        residual=own.residual, disagreement=own.disagreement, expected_error=own.expected_error,
        outlier_share=own.outlier_share, confidence=own.confidence, milliseconds=own.milliseconds,
        warnings=own.warnings,
    )  # fmt: skip


def _joint(estimate: Estimate, k: int) -> Joint:
    return Joint(estimate.joint_type[k], estimate.joint_axis[k], estimate.joint_origin[k])


def _length(displacement: Array, point: Array, reach: float) -> float:
    """How far a displacement (4, 4) moves a point (3,), and what lies that far from it."""
    way = transform_points(displacement, point[None])[0] - point
    return float(np.linalg.norm(way)) + reach * float(Rotation.from_matrix(displacement[:3, :3]).magnitude())


def _from_root(estimate: Estimate) -> Array:
    """(K, 3) box centres at rest, from the root's."""
    center = points_at_rest(estimate.translation, estimate.T_camera_part)
    return center - center[0]


def _sureness(estimate: Estimate) -> float:
    """By the parts: the whole is right as seldom as its worst part."""
    return float(estimate.part_confidence.mean()) if len(estimate.part_confidence) else estimate.confidence


def _poses(T_world_camera: ArrayLike, count: int) -> Array:
    """(count, 4, 4) float, checked."""
    fix = "give a rigid 4 x 4 matrix for each cloud, in their order"
    try:
        T = np.asarray(T_world_camera, np.float64)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"these are no camera poses ({error})", "T_world_camera", fix) from error
    if not count or T.shape != (count, 4, 4):
        raise ConfigError(f"an array of shape {T.shape} has no poses of {count} clouds", "T_world_camera", fix)
    R = T[:, :3, :3]
    rigid = np.isfinite(T).all() and np.allclose(R @ R.swapaxes(1, 2), np.eye(3), atol=1e-3)
    if not rigid or (np.linalg.det(R) < 0.0).any() or not np.allclose(T[:, 3], [0.0, 0.0, 0.0, 1.0]):
        raise ConfigError("a camera pose is not rigid", "T_world_camera", fix)
    return T


def merge_clouds(clouds: Sequence[ArrayLike], T_world_camera: ArrayLike) -> Array:
    """(N, 3) points of several clouds in the frame of the first camera; not finite where nothing was measured."""
    poses = _poses(T_world_camera, len(clouds))
    return _merged([_measured(cloud) for cloud in clouds], poses, poses[0])


def _merged(clouds: Sequence[Array], poses: Array, pose: Array) -> Array:
    return np.concatenate([_carried(cloud, T, pose) for cloud, T in zip(clouds, poses, strict=True)])


def _measured(cloud: ArrayLike) -> Array:
    """(N, 3) points; those that no sensor can have measured are not finite, in whatever frame they are told."""
    points = as_cloud(cloud)
    return np.where(is_measured(points)[:, None], points, np.nan)


def _carried(points: Array, T_world_from: Array, T_world_to: Array) -> Array:
    return (
        points if T_world_from is T_world_to else transform_points(invert_transform(T_world_to) @ T_world_from, points)
    )


def _labels(points: Array, cloud: Array, part: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) part of the nearest point of a labelled cloud; -1 for points that are not finite."""
    known, every = np.isfinite(cloud).all(axis=1), np.isfinite(points).all(axis=1)
    labels = np.full(len(points), -1)
    labels[every] = part[known][tree_of(cloud[known]).query(points[every])[1]]
    return labels


def _moved(estimate: Estimate, T: Array) -> Estimate:
    """The estimate in another camera's frame, by ``T_to_from`` (4, 4)."""
    R = T[:3, :3]
    return replace(
        estimate, rotation=R @ estimate.rotation, translation=transform_points(T, estimate.translation),
        T_camera_part=T @ estimate.T_camera_part, joint_axis=estimate.joint_axis @ R.T,
        joint_origin=transform_points(T, estimate.joint_origin), trajectory=T @ estimate.trajectory,
    )  # fmt: skip
