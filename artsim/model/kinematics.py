"""Kinematic trees: joints, and forward kinematics as a product of exponentials in the rest frame.

A tree of K parts has K joints: joint ``k`` carries part ``k``. Parts are ordered root first, parents
before children. Joint 0 is the root's ``free`` joint, which places the whole object in the world and
therefore never moves the root inside the rest frame.

All axes and origins are written in the rest frame *at rest*, so that

    T_rest_part[k](q) = T_rest_part[parent] @ motion(axis_k, origin_k, q_k - q_rest_k)

is the identity for every part when ``q`` equals the rest state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.elementary import cos, sin
from artsim.common.products import apply, matmul, norm
from artsim.errors import KinematicsError
from artsim.model.joints import JOINT_TYPES, LARGEST, MAX_JOINTS, ROTATING, Joint, Mimic, joint_of_record, joint_record
from artsim.model.transforms import cross_matrix

Array = NDArray[np.float64]

_EYE = np.eye(3)


class KinematicTree:
    """An immutable tree of joints with batched forward kinematics.

    Parameters
    ----------
    joints : sequence of Joint
        Joint ``k`` carries part ``k``; ``joints[0]`` is the root (``free``, parent -1) and every other
        parent index is smaller than the joint's own.

    Raises
    ------
    KinematicsError
        When the order, a type, an axis, a limit or a mimic relation is inconsistent.
    """

    def __init__(self, joints: Sequence[Joint]):
        self.joints = tuple(joints)
        self._last_poses: tuple[bytes, Array] = (b"", np.empty(0))
        self._check()

    def _check(self) -> None:
        if not self.joints:
            raise KinematicsError("a kinematic tree needs at least one part")
        for k, joint in enumerate(self.joints):
            where = f"joint {k} ({joint.name!r})"
            if joint.type not in JOINT_TYPES:
                raise KinematicsError(f"unknown joint type {joint.type!r}", where, f"use one of {JOINT_TYPES}")
            if (joint.type == "free") != (k == 0) or (joint.parent == -1) != (k == 0):
                raise KinematicsError("exactly the first joint is the root: type 'free', parent -1", where)
            if joint.parent >= k:
                raise KinematicsError("a parent must come before its children", where)
            if not np.all(np.abs([*joint.axis, *joint.origin, joint.rest, joint.pitch]) <= LARGEST):
                raise KinematicsError(
                    f"axis, origin, rest state and pitch must be finite, and at most {LARGEST:g}", where
                )
            if any(np.isfinite(limit) and abs(limit) > LARGEST for limit in (joint.lower, joint.upper)):
                raise KinematicsError(f"a limit is over {LARGEST:g}: make it infinite", where)
            if joint.mimic is not None and not np.all(np.abs([joint.mimic.multiplier, joint.mimic.offset]) <= LARGEST):
                raise KinematicsError(f"what a joint follows another by must be at most {LARGEST:g}", where)
            if abs(norm(joint.axis) - 1.0) > 1e-6:
                raise KinematicsError(f"axis {joint.axis} is not a unit vector", where)
            if not joint.lower <= joint.upper:
                raise KinematicsError(f"limits [{joint.lower}, {joint.upper}] are not an interval", where)
            if joint.mimic is not None and not (0 < joint.mimic.source < len(self.joints)):
                raise KinematicsError(f"mimics joint {joint.mimic.source}, which does not exist", where)
        for k in range(len(self.joints)):  # walking on after K steps means a loop
            mimic, steps = self.joints[k].mimic, 0
            while mimic is not None:
                mimic, steps = self.joints[mimic.source].mimic, steps + 1
                if steps > len(self.joints):
                    raise KinematicsError("mimic relations form a loop", f"joint {k} ({self.joints[k].name!r})")

    def __len__(self) -> int:
        return len(self.joints)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KinematicTree) and self.joints == other.joints

    def __hash__(self) -> int:
        return hash(self.joints)

    @cached_property
    def types(self) -> tuple[str, ...]:
        """Joint type of every part, length K."""
        return tuple(j.type for j in self.joints)

    @cached_property
    def parents(self) -> NDArray[np.int64]:
        """(K,) parent index of every part, -1 for the root."""
        return np.array([j.parent for j in self.joints], dtype=np.int64)

    @cached_property
    def axes(self) -> Array:
        """(K, 3) unit joint axes in the rest frame, at rest."""
        return np.array([j.axis for j in self.joints], dtype=np.float64)

    @cached_property
    def origins(self) -> Array:
        """(K, 3) joint origins in the rest frame, at rest, metres."""
        return np.array([j.origin for j in self.joints], dtype=np.float64)

    @cached_property
    def limits(self) -> Array:
        """(K, 2) lower and upper limits; infinite for continuous joints, 0 for the root."""
        return np.array([(j.lower, j.upper) for j in self.joints], dtype=np.float64)

    @cached_property
    def rest(self) -> Array:
        """(K,) rest state."""
        return np.array([j.rest for j in self.joints], dtype=np.float64)

    @cached_property
    def depths(self) -> NDArray[np.int64]:
        """(K,) number of joints between each part and the root."""
        depths = np.zeros(len(self), dtype=np.int64)
        for k in range(1, len(self)):
            depths[k] = depths[self.parents[k]] + 1
        return depths

    @cached_property
    def free_joints(self) -> NDArray[np.int64]:
        """Indices of the joints whose state can be chosen: not the root, not a mimic."""
        return np.array([k for k, j in enumerate(self.joints) if k > 0 and j.mimic is None], dtype=np.int64)

    @cached_property
    def _angle_rate(self) -> Array:
        return np.array([1.0 if t in ROTATING else 0.0 for t in self.types])

    @cached_property
    def _slide_rate(self) -> Array:
        return np.array([{"prismatic": 1.0, "screw": j.pitch}.get(j.type, 0.0) for j in self.joints])

    @cached_property
    def _axis_cross(self) -> tuple[Array, Array]:
        cross = cross_matrix(self.axes)
        return cross, matmul(cross, cross)

    @cached_property
    def _mimics_in_order(self) -> tuple[tuple[int, Mimic], ...]:
        def chain(k: int) -> int:
            mimic = self.joints[k].mimic
            return 0 if mimic is None else 1 + chain(mimic.source)

        order = sorted(range(len(self)), key=chain)
        return tuple((k, m) for k in order if (m := self.joints[k].mimic) is not None)

    def complete_state(self, q: ArrayLike) -> Array:
        """Joint states with every mimic joint set from its source and the root's entry set to 0.

        Parameters
        ----------
        q : (..., K) float
            State of each part's joint, in radians or metres; the root's entry is ignored.

        Returns
        -------
        (..., K) float

        Raises
        ------
        KinematicsError
            When the last dimension is not K, or a state is not finite.
        """
        q = np.array(q, dtype=np.float64)
        if q.ndim == 0 or q.shape[-1] != len(self):
            raise KinematicsError(
                f"a state of shape {q.shape} does not fit a tree of {len(self)} parts",
                fix=f"pass (..., {len(self)}): one state per part, the root's entry (ignored) first",
            )
        q[..., 0] = 0.0
        for k, mimic in self._mimics_in_order:
            q[..., k] = mimic.multiplier * q[..., mimic.source] + mimic.offset
        if not np.isfinite(q).all():
            raise KinematicsError("joint states must be finite")
        return q

    def motions(self, q: ArrayLike) -> Array:
        """Motion of each part against its parent, as the screw motion of its own joint.

        ``exp(axis * dq)`` about (or along) the joint: Rodrigues' formula for the rotation R, and
        ``origin - R @ origin + slide * axis`` for the translation.

        Parameters
        ----------
        q : (..., K) float
            Joint states.

        Returns
        -------
        (..., K, 4, 4) float
        """
        step = self.complete_state(q) - self.rest
        step[..., 0] = 0.0
        angle = (step * self._angle_rate)[..., None, None]
        cross, cross_squared = self._axis_cross
        rotation = sin(angle) * cross + (1.0 - cos(angle)) * cross_squared + _EYE
        turned = apply(rotation, self.origins)
        motion = np.zeros((*step.shape, 4, 4))
        motion[..., :3, :3] = rotation
        motion[..., :3, 3] = self.origins - turned + (step * self._slide_rate)[..., None] * self.axes
        motion[..., 3, 3] = 1.0
        return motion

    def forward_kinematics(self, q: ArrayLike) -> Array:
        """Pose of every part in the rest frame (ArtPERL section 4.1, for a tree of any depth).

        Parameters
        ----------
        q : (..., K) float
            State of each part's joint in radians or metres; the root's entry is ignored, and mimic
            joints follow their source whatever their own entry says.

        Returns
        -------
        (..., K, 4, 4) float
            ``T_rest_part``: maps the rest frame, as carried by part k, to the rest frame. Identity for
            every part at the rest state.

        Raises
        ------
        KinematicsError
            When ``q`` does not fit the tree or is not finite.
        """
        q = np.asarray(q, dtype=np.float64)
        if q.ndim == 1 and self._last_poses[0] == q.tobytes():
            return self._last_poses[1].copy()
        T_rest_part = self.motions(q)
        for k in range(1, len(self)):
            parent = self.parents[k]
            if parent > 0:
                T_rest_part[..., k, :, :] = matmul(T_rest_part[..., parent, :, :], T_rest_part[..., k, :, :])
        if q.ndim == 1:  # a state is often asked for twice: where to look from, then what is seen
            self._last_poses = q.tobytes(), T_rest_part.copy()
        return T_rest_part

    def posed_joints(self, T_frame_part: ArrayLike) -> tuple[Array, Array]:
        """Joint axes and origins carried by their parents into the frame that the poses map to.

        Parameters
        ----------
        T_frame_part : (..., K, 4, 4) float
            Pose of every part, for example ``T_camera_part`` or the result of ``forward_kinematics``.

        Returns
        -------
        axis, origin : (..., K, 3) float
            The root's own are those of the root part itself.
        """
        poses = np.asarray(T_frame_part, dtype=np.float64)
        carrier = poses[..., np.maximum(self.parents, 0), :, :]
        rotation, position = carrier[..., :3, :3], carrier[..., :3, 3]
        return apply(rotation, self.axes), apply(rotation, self.origins) + position

    def scaled(self, scale: float) -> KinematicTree:
        """The tree of the same object made ``scale`` times as large: every length is multiplied."""
        length = [t == "prismatic" for t in self.types]

        def resize(k: int, joint: Joint) -> Joint:
            unit = scale if length[k] else 1.0
            mimic = joint.mimic
            if mimic is not None:
                source_unit = scale if length[mimic.source] else 1.0
                mimic = Mimic(mimic.source, mimic.multiplier * unit / source_unit, mimic.offset * unit)
            x, y, z = joint.origin
            return replace(
                joint,
                origin=(x * scale, y * scale, z * scale),
                lower=joint.lower * unit,
                upper=joint.upper * unit,
                rest=joint.rest * unit,
                pitch=joint.pitch * scale,
                mimic=mimic,
            )

        return KinematicTree([resize(k, joint) for k, joint in enumerate(self.joints)])

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready description, inverse of :meth:`from_dict` (infinite limits become null)."""
        return {"joints": [joint_record(j) for j in self.joints]}

    @staticmethod
    def from_dict(data: object) -> KinematicTree:
        """Rebuild a tree from :meth:`to_dict`.

        Raises
        ------
        KinematicsError
            When ``data`` is anything else, or describes no tree.
        """
        joints = data.get("joints") if isinstance(data, Mapping) else None
        if not isinstance(joints, list) or len(joints) > MAX_JOINTS:
            raise KinematicsError("a tree has no list of joints", fix="make the file again")
        return KinematicTree([joint_of_record(d, f"joint {k}") for k, d in enumerate(joints)])
