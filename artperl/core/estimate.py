"""An estimate: 9D poses of the parts of one object, and what is worked out from them and the points."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation
from torch import Tensor

from artperl.core.confidence import Calibration, PartCalibration, PartSymptoms, Symptoms
from artperl.core.neighbours import tree_of
from artperl.core.pose import Posed, Theta, joint_axes, joint_states, pose_parts, reach
from artperl.core.shapes import Observed, Shapes
from artperl.core.trees import KINDS
from artperl.core.ways import likely_ways, unsure
from artsim.common.outputs import output_file, write_output
from artsim.common.showing import Showable
from artsim.errors import ConfigError

Array = NDArray[np.float64]

HEAD = ("part", "joint", "state", "limits", "box centre, m", "rotation vector, deg", "box size, m", "seen", "sure")
_MOST_PARTS = 40
"""Parts that are listed: as many as fit a screen."""
_NOT_IN_JSON = ("part", "part_symptoms", "ways")
"""The part of every point is long, and likely ways are told by their names."""

_ENOUGH_TO_WIDEN = 32
"""Points of a part from which they say how large it is."""
_OUTERMOST = 0.004
"""Of a cloud's points, that lie too far out on each side of a part to say how large it is."""
_SEEN = 0.03
"""A place of the reference's surface is seen when an observed point of its part is that near, in diagonals."""


@dataclass(frozen=True, eq=False)
class Estimate(Showable):
    """9D poses of the K parts of one object. Camera frame, metres, radians.

    Attributes
    ----------
    rotation : (K, 3, 3) float
        Of ``T_camera_part``.
    translation : (K, 3) float
        Box centres.
    size : (K, 3) float
        Box sizes.
    T_camera_part : (K, 4, 4) float
        Maps the estimated object's rest frame, as carried by each part, to the camera.
    state : (K,) float
        0 for the root.
    joint_type : tuple of str, length K
    joint_parent : (K,) int64
    joint_axis, joint_origin : (K, 3) float
        As posed.
    part : (N,) int64
        Part of each given point; -1 for points that are not finite, outliers, or of something else.
    reference : str
        Retrieved object.
    residual : float
        Root of the mean robust squared distance of the cloud from the fitted reference, over the diagonal; parts count
        by the root of how many points they have.
    disagreement : float
        Median distance between where perception and the fit place the points in the rest frame, over the diagonal; of
        the method artperl, between where the two best ends of the agent do.
    expected_error : float
        Median error that perception expects of where it places the points in the rest frame, over the diagonal; of the
        method artperl, the mean probability that a point's label is wrong.
    outlier_share : float
        Share of the points that are taken for something else, such as the table.
    visibility : (K,) float
        Share of each part's surface that is seen. A part with 0 is inferred from its joint's limits, not measured.
    confidence : float
        That every part is within 10 degrees and 5 % of the diagonal, 0 to 1.
    part_confidence : (K,) float
        That each part is there, and within these bounds, 0 to 1.
    part_symptoms : PartSymptoms
        What it goes by.
    trajectory : (S, K, 4, 4) float
        ``T_camera_part`` at the start, after each step of the agent where it was needed, and in the end.
    milliseconds : dict
        By stage.
    part_names : tuple of str, length K
        Such as "base" and "lid"; ``part_<k>`` where they are unknown.
    joint_limits : (K, 2) float
        Least and largest state of each joint, as the reference has them: radians, and metres of slides at the
        estimated size. Infinite for what turns without end, 0 for the root.
    warnings : tuple of str
        What looks wrong with the cloud, one sentence with its fix each.
    ways : (K, W) float
        Probability that each part opens in each of :data:`artperl.core.ways.WAYS`; (0, 0) where the estimator does not
        tell.
    """

    rotation: Array
    translation: Array
    size: Array
    T_camera_part: Array
    state: Array
    joint_type: tuple[str, ...]
    joint_parent: NDArray[np.int64]
    joint_axis: Array
    joint_origin: Array
    part: NDArray[np.int64]
    visibility: Array
    trajectory: Array
    reference: str = ""
    residual: float = np.inf
    disagreement: float = np.inf
    expected_error: float = np.inf
    outlier_share: float = 0.0
    confidence: float = 0.0
    part_confidence: Array = field(default_factory=lambda: np.zeros(0))
    part_symptoms: PartSymptoms = field(default_factory=PartSymptoms)
    milliseconds: dict[str, float] = field(default_factory=dict)
    part_names: tuple[str, ...] = ()
    joint_limits: Array = field(default_factory=lambda: np.zeros((0, 2)))
    warnings: tuple[str, ...] = ()
    ways: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def alternatives(self) -> tuple[dict[str, float], ...]:
        """Of each part, in which of :data:`artperl.core.ways.WAYS` it may open, the likeliest first, and how likely.

        Empty for the root, and where the estimator does not tell. Ways of less than 5 % are left out.
        """
        return likely_ways(self.ways, self.joint_type)

    @property
    def symptoms(self) -> Symptoms:
        """What the estimate says about itself."""
        least = float(self.visibility.min())
        return Symptoms(self.residual, self.disagreement, least, self.expected_error, self.outlier_share)

    def judged(self, calibration: Calibration, part_calibration: PartCalibration, parts: PartSymptoms) -> Estimate:
        """The estimate with its confidence, and that of its parts, which say this about themselves."""
        return replace(
            self, part_symptoms=parts, confidence=calibration(self.symptoms),
            part_confidence=part_calibration(calibration.log_odds(self.symptoms), parts),
        )  # fmt: skip

    @property
    def state_unit(self) -> tuple[str, ...]:
        """Unit of each part's state and limits, length K: "rad", "m", or "" for what does not move."""
        units = {"free": "", "fixed": "", "prismatic": "m"}
        return tuple(units.get(kind, "rad") for kind in self.joint_type)

    def export(
        self, folder: str | Path, formats: Sequence[str] = ("urdf",), category: str = "object", name: str = "estimate"
    ) -> dict[str, Any]:
        """Write the estimate as an articulated object that simulators load; see :func:`artsim.export.export`.

        ``meta.json`` has ``T_camera_object`` and the joint states ``q``, in the order of its parts.

        Raises
        ------
        ConfigError
            When a format is unknown, or a box has no size.
        """
        from artperl.core.estimated_object import estimated_object
        from artsim.export import export

        obj, T, q = estimated_object(self, category, name)
        estimated = {"T_camera_object": T.tolist(), "q": q.tolist(), "confidence": self.confidence}
        return export(obj, folder, formats, notes={"estimate": estimated})

    def to_dict(self) -> dict[str, Any]:
        """The estimate in JSON's terms, but for the part of every point: lists, and None for what is infinite."""
        record = {name: _plain(value) for name, value in vars(self).items() if name not in _NOT_IN_JSON}
        return {**record, "state_unit": list(self.state_unit), "alternatives": list(self.alternatives)}

    def save(self, path: str | Path, notes: Sequence[str] = ()) -> Path:
        """Write the estimate as ``.json``, as :meth:`to_dict` has it, or as ``.npz`` with the part of every point.

        Parameters
        ----------
        path : path
        notes : sequence of str
            Remarks that are written with it.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ConfigError
            When the file is of another kind, or cannot be written.
        """
        path = Path(path)
        if path.suffix == ".json":
            write_output(path, (json.dumps({**self.to_dict(), "notes": list(notes)}, indent=1) + "\n").encode())
        elif path.suffix == ".npz":
            values = {**vars(self), "state_unit": self.state_unit, "notes": tuple(notes)}
            texts = ("joint_type", "part_names", "state_unit", "warnings", "notes", "reference")
            with output_file(path) as out:
                np.savez(
                    out, allow_pickle=False,
                    **{name: np.asarray(value, dtype=str if name in texts else None) for name, value in values.items()
                       if name not in ("milliseconds", "part_symptoms")},
                )  # fmt: skip
        else:
            raise ConfigError("it is no .json or .npz file", path, "name one")
        return path

    def __str__(self) -> str:
        rows = [HEAD, *cells(self)[:_MOST_PARTS]]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
        more = len(self.joint_type) - _MOST_PARTS
        lines += [f"... and {more} parts more"] if more > 0 else []
        lines += unsure(self.alternatives, self.part_names)
        return "\n".join([*(f"warning: {text}" for text in self.warnings), summary(self), *lines])

    def __repr__(self) -> str:
        states = [f"{name} {state}".strip() for name, _, state, *_ in cells(self)[:8]]
        states += ["..."] if len(self.joint_type) > 8 else []
        warnings = f", {len(self.warnings)} warnings" if self.warnings else ""
        sure = f"confidence {100 * self.confidence:.0f} %"
        return f"<Estimate of {self.reference}: {', '.join(states)}; {sure}{warnings}>"


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def summary(estimate: Estimate) -> str:
    """One line: how sure it is, how well it fits, and by which reference."""
    reference = f"reference {estimate.reference}, " if estimate.reference else ""  # some methods have none
    other = f"{100 * estimate.outlier_share:.0f} % of the points left out, " if estimate.outlier_share >= 0.005 else ""
    return (
        f"confidence {100 * estimate.confidence:.0f} %, residual {100 * estimate.residual:.2f} % of the diagonal, "
        f"{other}{reference}{sum(estimate.milliseconds.values()):.0f} ms"
    )


def cells(estimate: Estimate) -> list[tuple[str, ...]]:
    """What `HEAD` names, of each part."""
    rows: list[tuple[str, ...]] = []
    for k, kind in enumerate(estimate.joint_type):
        name = estimate.part_names[k] if k < len(estimate.part_names) else f"{k}"
        limits = estimate.joint_limits[k] if k < len(estimate.joint_limits) else (np.nan, np.nan)
        joint = joint_cells(kind, float(estimate.state[k]), limits)
        pose = pose_cells(estimate.rotation[k], estimate.translation[k], estimate.size[k])
        sure = f"{100 * estimate.part_confidence[k]:.0f} %" if k < len(estimate.part_confidence) else ""
        rows.append((name, kind, *joint, *pose, f"{100 * estimate.visibility[k]:.0f} %", sure))
    return rows


def joint_cells(kind: str, state: float, limits: ArrayLike) -> tuple[str, str]:
    """State and limits (2,) of a joint in words; empty for what does not move, or has no limits."""
    if kind in ("free", "fixed"):
        return "", ""
    low, high = np.asarray(limits, np.float64)
    ends = f"{_amount(kind, low)} to {_amount(kind, high)}" if np.isfinite([low, high]).all() else ""
    return _amount(kind, state), ends


def pose_cells(rotation: Array, center: Array, size: Array) -> tuple[str, str, str]:
    """Box centre (3,), rotation (3, 3) and box size (3,) of a part, as `HEAD` names them."""
    turn = Rotation.from_matrix(rotation).as_rotvec(degrees=True)
    return (
        " ".join(f"{x:.3f}" for x in center), " ".join(f"{x:.1f}" for x in turn),
        " x ".join(f"{x:.3f}" for x in size),
    )  # fmt: skip


def _amount(kind: str, state: float) -> str:
    """A joint's state with its unit: centimetres of a slide, degrees of what turns."""
    return f"{100 * state:.1f} cm" if kind == "prismatic" else f"{np.rad2deg(state):.1f}°"


def slide_parts(estimate: Estimate, farther: Array) -> Estimate:
    """The estimate with parts that have slid farther (K,), metres, along their axes, and are where they were.

    Where they are at rest changes, and with them where everything is at rest that they carry.
    """
    T, rotation = estimate.T_camera_part.copy(), estimate.rotation
    shift = farther[:, None] * estimate.joint_axis
    for k, parent in enumerate(estimate.joint_parent):
        if parent >= 0:
            shift[k] += rotation[k] @ rotation[parent].T @ shift[parent]
    T[:, :3, 3] += shift
    trajectory = np.concatenate([estimate.trajectory[:-1], T[None]])
    return replace(estimate, T_camera_part=T, state=estimate.state + farther, trajectory=trajectory)


def points_at_rest(posed: Array, T_camera_part: Array) -> Array:
    """(K, 3) one posed point of each part, in the rest frame that its part carries (K, 4, 4)."""
    rest: Array = np.einsum("kji,kj->ki", T_camera_part[:, :3, :3], posed - T_camera_part[:, :3, 3])
    return rest


def widen(rotation: Array, center: Array, size: Array, points: Array, part: NDArray[np.int64]) -> tuple[Array, Array]:
    """Boxes that hold the points of their parts, but for the outermost few on each side.

    As many are left out of a small part as of a large one: they are points of its neighbours, while the feet of a
    cabinet may be no more than a percent of its points. What is fitted is a reference's shape, which real parts stick
    out of; points never make a box smaller, since a part is seen from one side only.

    Parameters
    ----------
    rotation, center, size : (K, 3, 3), (K, 3), (K, 3) float
    points : (N, 3) float
    part : (N,) int
        -1 for points of no part.

    Returns
    -------
    center, size : (K, 3) float
    """
    center, size = center.copy(), size.copy()
    outermost = round(_OUTERMOST * len(points))
    for k in range(len(size)):
        own = points[part == k]
        if len(own) >= _ENOUGH_TO_WIDEN:
            across, left_out = np.sort((own - center[k]) @ rotation[k], axis=0), min(outermost, len(own) // 4)
            low = np.minimum(-0.5 * size[k], across[left_out])
            high = np.maximum(0.5 * size[k], across[-1 - left_out])
            center[k] += rotation[k] @ (0.5 * (low + high))
            size[k] = high - low
    return center, size


def visibility(shapes: Shapes, observed: Observed, posed: Posed) -> Array:
    """(P,) share of the surface of each part, of the first object, that has an observed point of the part near it."""
    points = posed.points(shapes.points, shapes.box_center)[0].numpy()
    seen = np.zeros(len(points))
    cloud, part = observed.points[0].numpy(), observed.part[0].numpy()
    for k in np.unique(part):
        within = _SEEN * float(shapes.diagonal[0])
        near = tree_of(cloud[part == k]).query(points[k], distance_upper_bound=within)[0]
        seen[k] = np.isfinite(near).mean()
    return seen


def estimate_of_fit(shapes: Shapes, observed: Observed, path: Sequence[Theta], part: NDArray[np.int64]) -> Estimate:
    """What a fitted reference says of K parts; nothing yet of how sure it is.

    Parameters
    ----------
    shapes : Shapes
        Of one row.
    observed : Observed
    path : sequence of Theta
        States of one row, the start first, the fit last.
    part : (N,) int64
        Of each given point.
    """
    theta, trees = path[-1], shapes.trees
    K = int(trees.valid[0].sum())
    posed = pose_parts(trees, theta, shapes.box_center)
    axis, origin = joint_axes(trees, posed)
    poses = [_transforms(shapes, step)[:K] for step in path]
    limits = torch.stack([trees.lower, trees.upper], dim=-1)
    limits = torch.where((trees.turn == 0)[..., None], limits * reach(trees, theta.log_scale)[..., None], limits)
    return Estimate(
        rotation=_first(posed.rotation)[:K],
        translation=_first(posed.center)[:K],
        size=_first(shapes.box_size * posed.scale)[:K],
        T_camera_part=poses[-1],
        state=_first(joint_states(trees, theta))[:K],
        joint_type=tuple(KINDS[k] for k in trees.kind[0, :K].tolist()),
        joint_parent=np.where(np.arange(K) == 0, -1, trees.parent[0, :K].numpy()),
        joint_axis=_first(axis)[:K],
        joint_origin=_first(origin)[:K],
        part=part,
        visibility=visibility(shapes, observed, posed)[:K],
        trajectory=np.stack(poses),
        joint_limits=_first(limits)[:K],
    )


def _transforms(shapes: Shapes, theta: Theta) -> Array:
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    transforms = np.tile(np.eye(4), (posed.rotation.shape[1], 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = _first(posed.rotation), _first(posed.translation)
    return transforms


def _first(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().numpy()
