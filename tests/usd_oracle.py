"""Where usd-core's own parser of UsdPhysics says that the bodies of a stage are."""

from __future__ import annotations

import warnings
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artsim.model.objects import ArticulatedObject

Array = NDArray[np.float64]
_AXES = [f"{word}{letter}" for word in ("trans", "rot") for letter in "XYZ"]


def assert_moves_as_parsed(obj: ArticulatedObject, file: Path, samples: int = 3, atol: float = 1e-6) -> None:
    """Every part moves from the zero of all joints as the body of its name does by usd-core's parser."""
    stage, rng = ParsedStage(file), np.random.default_rng(0)
    zero = stage.posed({})
    names = {path.rpartition("/")[2]: path for path in zero}
    parts = [(k, names[part.name]) for k, part in enumerate(obj.parts) if part.name in names]
    assert parts
    # The rest frame lies along the world's axes: from where to where is all that is not known of it.
    rows, targets, turns = [], [], []
    low, high = np.nan_to_num(obj.tree.limits, neginf=-1.0, posinf=1.0).T
    for _ in range(samples):
        q = obj.tree.complete_state(low + rng.random(len(obj.tree)) * (high - low))
        states = {joint.name: float(value) for joint, value in zip(obj.tree.joints, q, strict=True)}
        posed = stage.posed(states)
        ours = obj.tree.forward_kinematics(q) @ np.linalg.inv(
            obj.tree.forward_kinematics(obj.tree.complete_state(0 * q))
        )
        theirs = np.stack([posed[path] @ np.linalg.inv(zero[path]) for _, path in parts])
        for T, (k, _) in zip(np.linalg.inv(theirs[:1]) @ theirs, parts, strict=True):
            own = np.linalg.inv(ours[parts[0][0]]) @ ours[k]
            turns.append(own[:3, :3] - T[:3, :3])
            rows.append(np.eye(3) - T[:3, :3])
            targets.append(T[:3, 3] - own[:3, 3])
    np.testing.assert_allclose(turns, 0.0, atol=atol)
    A, b = np.concatenate(rows), np.concatenate(targets)
    np.testing.assert_allclose(A @ np.linalg.lstsq(A, b, rcond=None)[0], b, atol=atol)


class ParsedStage:
    """Bodies and joints as ``UsdPhysics.LoadUsdPhysicsFromRange`` gives them, in metres, Z up."""

    def __init__(self, file: Path):
        from pxr import Usd, UsdGeom, UsdPhysics

        self.stage = Usd.Stage.Open(str(file))
        self.meters = UsdGeom.GetStageMetersPerUnit(self.stage)
        self.world = np.eye(4)
        if UsdGeom.GetStageUpAxis(self.stage) == UsdGeom.Tokens.y:
            self.world[:3, :3] = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)
            found = UsdPhysics.LoadUsdPhysicsFromRange(self.stage, ["/"])
        self.bodies: dict[str, Array] = {}
        self.between: dict[tuple[str, str], list[tuple[str, Any]]] = defaultdict(list)
        parsed = [
            (str(p), d) for paths, descriptions in found.values() for p, d in zip(paths, descriptions, strict=True)
        ]
        for path, one in parsed:
            if one.type == UsdPhysics.ObjectType.RigidBody:
                self.bodies[path] = self.world @ self._pose(one.position, one.rotation)
        order = {str(prim.GetPath()): k for k, prim in enumerate(self.stage.Traverse(Usd.TraverseInstanceProxies()))}
        for path, one in sorted(parsed, key=lambda found: order[found[0]]):
            if str(one.type).endswith("Joint") and one.jointEnabled:
                ends = [str(end) if str(end) in self.bodies else "" for end in (one.body0, one.body1)]
                self.between[ends[0], ends[1]].append((path, one))

    def _pose(self, position: Any, turn: Any) -> Array:
        T = np.eye(4)
        T[:3, :3] = Rotation.from_quat([*turn.GetImaginary(), turn.GetReal()]).as_matrix()
        T[:3, 3] = np.array(position) * self.meters
        return T

    def posed(self, states: dict[str, float]) -> dict[str, Array]:
        """Pose of every body, for values of joints by name; what hangs on nothing is where it stands."""
        placed = {"": self.world}
        for root in ("", *self.bodies):
            placed.setdefault(root, self.bodies.get(root, self.world))
            waiting = [root]
            while waiting:
                body = waiting.pop(0)
                for (first, second), joints in self.between.items():
                    if body == first and second not in placed:
                        placed[second] = placed[first] @ self._carried(joints, states)
                        waiting.append(second)
                    elif body == second and first not in placed:
                        placed[first] = placed[second] @ np.linalg.inv(self._carried(joints, states))
                        waiting.append(first)
        del placed[""]
        return placed

    def _carried(self, joints: list[tuple[str, Any]], states: dict[str, float]) -> Array:
        """Pose of the second body in the first: the motion of each joint, then where their frames meet."""
        T = np.eye(4)
        for path, joint in joints:
            frame = self._pose(joint.localPose0Position, joint.localPose0Orientation)
            T = T @ frame @ self._motion(path, joint, states) @ np.linalg.inv(frame)
        _, first = joints[0]
        frames = (
            self._pose(first.localPose0Position, first.localPose0Orientation),
            self._pose(first.localPose1Position, first.localPose1Orientation),
        )
        return T @ frames[0] @ np.linalg.inv(frames[1])

    def _motion(self, path: str, joint: Any, states: dict[str, float]) -> Array:
        name = path.rpartition("/")[2]
        order = _AXES
        only = ""
        kind = str(joint.type).rpartition(".")[2]
        if kind in ("RevoluteJoint", "PrismaticJoint"):
            only = {"R": "rot", "P": "trans"}[kind[0]] + str(joint.axis)[-1]
        elif kind == "SphericalJoint":
            axis = "XYZ".index(str(joint.axis)[-1])
            order = [f"rot{'XYZ'[(axis + step) % 3]}" for step in (2, 1, 0)]
        elif kind == "D6Joint":
            ends = {str(limit.first).rpartition(".")[2]: limit.second for limit in joint.jointLimits}
            free = [one for one in ("TransX", "TransY", "TransZ", "RotX", "RotY", "RotZ")
                    if one not in ends or ends[one].lower < ends[one].upper]  # fmt: skip
            only = free[0][0].lower() + free[0][1:] if len(free) == 1 else ""
        T = np.eye(4)
        for axis_name in order:
            value = states.get(name if axis_name == only else f"{name}_{axis_name}", 0.0)
            direction, step = np.eye(3)["XYZ".index(axis_name[-1])], np.eye(4)
            if axis_name.startswith("trans"):
                step[:3, 3] = value * direction
            else:
                step[:3, :3] = Rotation.from_rotvec(value * direction).as_matrix()
            T = T @ step
        return T
