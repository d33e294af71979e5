"""What procedural objects weigh and how their joints feel: within the ranges of real ones.

``physical.json`` has the ranges. ``source`` says who measured or stated them; null marks common knowledge.

- A mass is that of the solids' volume and density, times ``filled``, the share of it that is matter in hollow things.
  What would lie in the last tenth of its category's range, or beyond it, in logarithms, is pressed into that tenth.
- ``running`` is the friction of a joint, ``hold`` what it takes to open it against that and a magnet, gasket or latch,
  which pulls less and less until the joint has gone ``over`` degrees, and ``spring`` what it takes at the end of its
  travel. They are newtons at the part's handle, or at its joint (newton metres where it turns). Parts of one label have
  the same.
"""

import json
import zlib
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from artsim.common.elementary import exp, log
from artsim.common.products import dot, norm
from artsim.model.details import GRIPS
from artsim.model.joints import ROTATING
from artsim.model.objects import ArticulatedObject, JointDynamics

_EDGE = 0.1
"""Share of a range of masses, in logarithms, into which what lies beyond is pressed."""
_STRENGTH = 3.0
"""Effort limit over what holds a joint: drives and hands are to open it."""


@lru_cache(maxsize=1)
def physical_ranges() -> dict[str, Any]:
    """``mass`` by category, and rows of ``joints``."""
    found: dict[str, Any] = json.loads(Path(__file__).with_name("physical.json").read_text())
    return found


def feel_of(category: str, label: str, kind: str) -> dict[str, Any] | None:
    """The row of a joint, by its part's label and its type; None where nothing is known."""
    for row in physical_ranges()["joints"]:
        named = any(f"_{part}_" in f"_{label}_" for part in row["parts"])
        if named and category in row["categories"] and kind in row.get("types", (kind,)):
            return dict(row)
    return None


def with_physics(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with its mass, and with what its joints feel like."""
    share = _share(obj)
    parts = []
    for k, part in enumerate(obj.parts):
        assert part.body is not None
        body = replace(part.body, density=part.body.density * share, joint=_dynamics(obj, k))
        parts.append(replace(part, body=body))
    return replace(obj, parts=tuple(parts))


def _share(obj: ArticulatedObject) -> float:
    """Mass over that of the solids."""
    row = physical_ranges()["mass"].get(obj.category)
    if row is None:
        return 1.0
    mass = sum(part.body.density * _volume(part.vertices, part.faces) for part in obj.parts if part.body is not None)
    filled = float(row.get("filled", 1.0))
    low, high = log(float(row["low"])), log(float(row["high"]))
    at = (log(filled * mass) - low) / (high - low)
    beyond = max(_EDGE - at, at - (1.0 - _EDGE), 0.0)
    pressed = _EDGE * (1.0 - exp(-beyond / _EDGE))
    inside = at if beyond == 0 else _EDGE - pressed if at < 0.5 else 1.0 - _EDGE + pressed
    return exp(low + inside * (high - low)) / mass


def _volume(vertices: Any, faces: Any) -> float:
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(dot(a, np.cross(b, c)).sum()) / 6.0


def _dynamics(obj: ArticulatedObject, k: int) -> JointDynamics:
    """Of the joint of part k, drawn by the object's digest and the part's label."""
    joint, part = obj.tree.joints[k], obj.parts[k]
    row = feel_of(obj.category, part.label, joint.type) if k > 0 else None
    if row is None:
        return JointDynamics()
    rng = np.random.default_rng([int(obj.sha256[:16], 16), zlib.crc32(part.label.encode())])
    drawn = {name: rng.uniform(*row[name]) if name in row else 0.0 for name in ("running", "hold", "spring", "over")}
    arm = lever_arm(obj, k) if row["at"] == "handle" and joint.type in ROTATING else 1.0
    travel = max(abs(joint.lower), abs(joint.upper))
    friction, hold = drawn["running"] * arm, max(drawn["hold"] - drawn["running"], 0.0) * arm
    over = np.deg2rad(drawn["over"])
    spring = drawn["spring"] * arm / travel if np.isfinite(travel) and travel > 0 else 0.0
    effort = _STRENGTH * (friction + hold + drawn["spring"] * arm)
    return JointDynamics(
        friction=friction or None, least_effort=effort, hold=hold or None, hold_over=over or None, spring=spring or None
    )


def lever_arm(obj: ArticulatedObject, k: int) -> float:
    """Metres from the axis of part k's joint to its handle, or to the corner of its box farthest from the axis."""
    joint = obj.tree.joints[k]
    grips = [detail.T_rest_detail[:3, 3] for detail in obj.details if detail.part == k and detail.label in GRIPS]
    low, high = obj.part_bounds[k]
    corners = np.array(np.meshgrid(*np.stack([low, high], axis=1))).reshape(3, -1).T
    points = np.array(grips) if grips else corners
    arms: Any = norm(np.cross(points - np.asarray(joint.origin), np.asarray(joint.axis)))
    return float(arms.max())
