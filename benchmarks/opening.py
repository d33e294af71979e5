"""What it takes to open procedural objects, and what they weigh: ``python -m benchmarks.opening``.

Joints open quasi-statically: at each of many states, :mod:`artsim.physics` finds the least effort that moves the joint
on, without weight and damping. Ranges are those of ``artsim/families/physical.json``: newtons at the part's handle, or
newtons or newton metres at its joint. The peak is the most of the whole way, running what it takes half way.
MuJoCo tells the latter of the same joints in MJCF, which has no latches.
"""

import json
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import tyro

from artsim import make
from artsim.common.progress import track
from artsim.export.mjcf import mjcf_text
from artsim.export.options import ExportOptions
from artsim.export.text import obj_text
from artsim.families.physical import feel_of, lever_arm, physical_ranges
from artsim.model.draws import farther_ends
from artsim.model.joints import ROTATING
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import as_robot
from artsim.physics import PhysicsOptions, Simulation

CATEGORIES = ("refrigerator", "storage_furniture", "drawer", "microwave", "oven", "dishwasher", "washing_machine",
              "laptop", "keyboard", "window")  # fmt: skip
_SHARES = np.append(np.linspace(0.0, 0.99, 34) ** 2, 1.0 - 1e-6)
"""Of the way: dense where latches hold."""
_FAST = 1e5
"""Speed at which MuJoCo's friction, a soft one, has its whole strength on light knobs too."""


@dataclass(frozen=True)
class Options:
    """Measure what opens joints, and weigh objects."""

    objects: int = 10
    """Of each of ten categories; 0 for masses alone."""
    masses: int = 40
    """Objects of every category that are weighed."""
    picture: Path | None = None
    """Draw forces over the opening here (.png)."""


def in_artsim(obj: ArticulatedObject, k: int, end: float) -> list[float]:
    """Least effort that moves the joint of part k on, at shares of its way to a state."""
    simulation = Simulation(obj, PhysicsOptions(substeps=1, gravity=0.0, damping=0.0))
    chosen = obj.tree.free_joints == k
    found = []
    for share in _SHARES:
        low, high = 0.0, float(simulation.effort_limit[chosen][0])
        while high - low > 1e-4 * high:
            effort, q = 0.5 * (low + high), np.zeros(len(obj))
            q[k] = share * end
            simulation.reset(q)
            simulation.step(np.where(chosen, np.sign(end) * effort, 0.0))
            moves = (simulation.state[k] - q[k]) * np.sign(end) > 1e-10
            low, high = (low, effort) if moves else (effort, high)
        found.append(high)
    return found


def in_mujoco(obj: ArticulatedObject, k: int, state: float) -> float:
    """Effort that keeps the joint of part k moving away from rest, by inverse dynamics."""
    robot = as_robot(obj)
    files = {f"{mesh.name}.obj": obj_text(mesh).encode() for mesh in robot.meshes}
    model = mujoco.MjSpec.from_string(mjcf_text(robot, ExportOptions()), assets=files).compile()
    data = mujoco.MjData(model)
    model.opt.gravity[:], model.dof_damping[:] = 0.0, 0.0
    here, on = (robot.states(np.where(np.arange(len(obj)) == k, q, 0.0)) for q in (state, state * (1.0 + 1e-3)))
    for name, value in here.items():
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]] = value, (on[name] - value) / abs(1e-3 * state) * _FAST
    mujoco.mj_inverse(model, data)
    return float(data.qfrc_inverse @ data.qvel) / _FAST


def openings(category: str, seed: int) -> dict[tuple[str, str, str], dict[str, Any]]:
    """What opens the first part of each label whose joint has a range, by category, label and unit."""
    obj = make(category, seed)
    rows: dict[tuple[str, str, str], dict[str, Any]] = {}
    for k in obj.tree.free_joints:
        joint, label = obj.tree.joints[k], obj.parts[k].label
        feel = feel_of(category, label, joint.type)
        turns = feel is not None and joint.type in ROTATING
        key = (category, label, "N m" if turns and feel and feel["at"] == "joint" else "N")
        if feel is None or key in rows:
            continue
        end = float(farther_ends(obj)[k])
        end = end if np.isfinite(end) else 0.5 * np.pi
        arm = lever_arm(obj, k) if turns and feel["at"] == "handle" else 1.0
        force = np.array(in_artsim(obj, k, end)) / arm
        half = float(np.interp(0.5, _SHARES, force))
        apart = abs(in_mujoco(obj, k, 0.5 * end) / arm / half - 1.0)
        rows[key] = {"feel": feel, "force": force, "peak": float(force.max()), "running": half, "apart": apart}
    return rows


def peak_of(feel: dict[str, Any]) -> list[float]:
    """The cited range of the peak."""
    bounds: list[float] = next(feel[name] for name in ("hold", "spring", "running") if name in feel)
    return bounds


def report(key: tuple[str, str, str], rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The measured and the cited ranges of a kind of joint, printed and as a record."""
    feel = rows[0]["feel"]
    cited = {"peak": peak_of(feel), "running": feel.get("running")}
    inside, cells = [True] * len(rows), []
    for name, bounds in cited.items():
        values = [row[name] for row in rows]
        if bounds is not None:  # what bisection leaves open is 1e-4 of the effort
            inside = [x and 0.999 * bounds[0] < v < 1.001 * bounds[1] for x, v in zip(inside, values, strict=True)]
        cells += [f"{min(values):.3g} to {max(values):.3g} ({bounds[0]} to {bounds[1]})" if bounds else "-"]
    apart = max(row["apart"] for row in rows)
    print(f"| {key[0]} {key[1]}, {key[2]} | {' | '.join(cells)} | {sum(inside)} of {len(rows)} | {apart:.0e} | "
          f"{feel['source'] or 'common knowledge'} |")  # fmt: skip
    return {"joint": key, "joints": len(rows), "within": sum(inside), "mujoco": apart}


def draw(found: dict[tuple[str, str, str], list[dict[str, Any]]], path: Path) -> None:
    """Forces of the commonest kind of joint of each category over the opening, and the cited range of the peak."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 5, figsize=(11, 4.4), layout="constrained")
    for axis, category in zip(axes.flat, CATEGORIES, strict=True):
        keys = [key for key in found if key[0] == category]
        key = max(keys, key=lambda key: ("hold" in found[key][0]["feel"], len(found[key])))
        axis.axhspan(*peak_of(found[key][0]["feel"]), color="0.9")
        for row in found[key]:
            axis.plot(100 * _SHARES, row["force"], lw=0.9)
        axis.set_xscale("function", functions=(np.sqrt, np.square))
        axis.set(title=" ".join(dict.fromkeys(key[:2])).replace("_", " "), ylabel=key[2], ylim=(0, None), xlim=(0, 100))
        axis.set_xticks([1, 10, 30, 60, 100])
    figure.supxlabel("opened, % of the way; grey: cited range of the peak")
    figure.savefig(path, dpi=80)


def weigh(category: str, count: int) -> int:
    """How many objects of a category lie within its range of masses."""
    row = physical_ranges()["mass"][category]
    masses = [sum(link.inertia.mass for link in as_robot(make(category, seed)).links) for seed in range(count)]
    inside = sum(row["low"] <= mass <= row["high"] for mass in masses)
    print(
        f"| {category} | {min(masses):.3g} to {max(masses):.3g} ({row['low']} to {row['high']}) | {inside} of {count} |"
    )
    return inside


def main(options: Options) -> None:
    """Measure, weigh, print and draw."""
    found = defaultdict[tuple[str, str, str], list[dict[str, Any]]](list)
    keys = [(category, seed) for category in CATEGORIES for seed in range(options.objects)]
    for category, seed in track("joints", keys, unit="object"):
        for key, row in openings(category, seed).items():
            found[key].append(row)
    print("| joint | peak (cited) | running (cited) | within | MuJoCo apart | source |\n|---|---|---|---|---|---|")
    rows = [report(key, found[key]) for key in found]
    if options.picture is not None:
        draw(found, options.picture)
    print("\n| category | kg (cited) | within |\n|---|---|---|")
    weighed = [weigh(category, options.masses) for category in physical_ranges()["mass"] if options.masses]
    totals = {name: sum(row[name] for row in rows) for name in ("joints", "within")}
    print(json.dumps({**totals, "weighed": len(weighed) * options.masses, "in range": sum(weighed), "rows": rows}))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
