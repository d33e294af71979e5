"""Are exported objects ready for simulators? ``python -m benchmarks.simready``.

Objects of every category go through NVIDIA's ``simready-validate`` with the profile Robotics-Prop, as packages of
``artsim export --formats simready``; a failed requirement of a feature that the profile needs is a failure. Of objects
with handles, knobs or latches it counts those that pass the feature of grasps as well, which the profile does not need.
The same packages go through all rules of the validator beneath, ``usd-validation-nvidia`` (Omniverse's asset
validator); its warnings are counted apart. Then the same objects are read by MuJoCo (MJCF), Newton (USD) and SAPIEN
(URDF), and what each says of limits, friction, damping, springs, effort, speed and masses is compared with the object.
A dash: the format has no such value, or the simulator does not read it. SAPIEN's friction is a coefficient of its own
and no effort; of a screw's turning joint, which URDF has as continuous, it reads no limits.

Kitchens of ten objects in a row (``artsim scene --place row --simulate``) are run by MuJoCo on one core.
"""

import json
import logging
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artsim import make
from artsim.common.progress import say, track
from artsim.export import FORMATS, export
from artsim.families import FAMILIES
from artsim.model.details import GRIPS
from artsim.model.robot import Robot, as_robot
from artsim.scenes.random_scene import SceneOptions, make_scene
from artsim.scenes.simulation import write_simulation

Values = dict[str, dict[str, float]]
"""By quantity, then by joint or link."""
QUANTITIES = ("lower", "upper", "friction", "damping", "spring", "effort", "velocity", "mass")
GRASPS = "FET_005_STANDARD"


@dataclass(frozen=True)
class Options:
    """Validate exported objects, and read them by three simulators."""

    objects: int = 5
    """Of each category; 0 for kitchens alone."""
    kitchens: int = 3
    """Kitchens of ten objects, with which two seconds are simulated."""
    first_seed: int = 0


def in_mujoco(folder: Path) -> Values:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(folder / FORMATS["mjcf"]))
    joints = [model.joint(j) for j in range(model.njnt)]
    limited = [joint for joint in joints if joint.limited[0]]
    return {
        "lower": {joint.name: joint.range[0] for joint in limited},
        "upper": {joint.name: joint.range[1] for joint in limited},
        "friction": {joint.name: model.dof_frictionloss[joint.dofadr[0]] for joint in joints},
        "damping": {joint.name: model.dof_damping[joint.dofadr[0]] for joint in joints},
        "spring": {joint.name: model.jnt_stiffness[joint.id] for joint in joints},
        "effort": {joint.name: model.jnt_actfrcrange[joint.id][1] for joint in joints},
        "mass": {model.body(b).name: model.body(b).mass[0] for b in range(1, model.nbody)},
    }


def in_newton(folder: Path) -> Values:
    import newton

    read = newton.ModelBuilder()
    read.add_usd(str(folder / FORMATS["usd"]))
    moving = [(name, place) for name, place in zip(read.joint_label, read.joint_qd_start, strict=True)
              if "/fixed_base" not in name]  # fmt: skip
    names = [(name.rsplit("/", 1)[-1], place) for name, place in moving]
    arrays = {"lower": read.joint_limit_lower, "upper": read.joint_limit_upper, "friction": read.joint_friction,
              "damping": read.joint_target_kd, "spring": read.joint_target_ke, "effort": read.joint_effort_limit,
              "velocity": read.joint_velocity_limit}  # fmt: skip
    values = {quantity: {name: array[place] for name, place in names} for quantity, array in arrays.items()}
    bodies = (name.rsplit("/", 1)[-1] for name in read.body_label)
    return {**values, "mass": dict(zip(bodies, read.body_mass, strict=True))}


def in_sapien(folder: Path) -> Values:
    import sapien

    scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    loader = scene.create_urdf_loader()
    loader.fix_root_link = True
    builders, _, _ = loader.parse(str(folder / FORMATS["urdf"]))
    for link in builders[0].link_builders:
        link.visual_records.clear()
    built = builders[0].build()
    joints = built.get_active_joints()
    return {
        "lower": {joint.name: joint.limits[0][0] for joint in joints if np.isfinite(joint.limits).all()},
        "upper": {joint.name: joint.limits[0][1] for joint in joints if np.isfinite(joint.limits).all()},
        "mass": {link.name: link.mass for link in built.links},
    }


KITCHEN = ("refrigerator", "oven", "dishwasher", "microwave", "storage_furniture", "washing_machine", "trash_can",
           "storage_furniture", "drawer", "table")  # fmt: skip
_SECONDS = 2.0

READERS = {"mujoco": in_mujoco, "newton": in_newton, "sapien": in_sapien}


def wanted(robot: Robot) -> Values:
    """What the object itself says."""
    own = {name: {joint.name: getattr(joint, name) for joint in robot.joints} for name in QUANTITIES[:-1]}
    return {**own, "mass": {link.name: link.inertia.mass for link in robot.links}}


def differences(found: Values, own: Values) -> dict[str, float]:
    """Largest relative difference in each quantity that was read, over joints or links of which both have a number."""
    worst = {}
    for quantity, values in found.items():
        apart = [
            abs(value - own[quantity][name]) / max(abs(own[quantity][name]), 1e-6)
            for name, value in values.items()
            if name in own[quantity] and np.isfinite(own[quantity][name])
        ]
        worst[quantity] = float(max(apart, default=0.0))
    return worst


def in_kitchens(count: int) -> list[dict[str, float]]:
    """Joints, joints that meet another object, and how many times as fast as real time MuJoCo runs on one core."""
    import mujoco

    rows = []
    for seed in range(count):
        scene = make_scene(SceneOptions(categories=KITCHEN, place="row", distractors=0), seed)
        with tempfile.TemporaryDirectory() as place:
            written = write_simulation(scene.instances, Path(place))
            model = mujoco.MjModel.from_xml_path(str(written.folder / "scene.xml"))
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        start = time.process_time()
        while data.time < _SECONDS:
            mujoco.mj_step(model, data)
        speed = _SECONDS / (time.process_time() - start)
        rows.append({"seed": seed, "joints": model.njnt, "blocked": len(written.blocked), "times real time": speed})
        print(f"kitchen {seed}: {model.njnt} joints, {len(written.blocked)} blocked, {speed:.0f} times real time")
    return rows


def main() -> None:
    """Entry point of ``python -m benchmarks.simready``."""
    options = tyro.cli(Options)
    import simready.validate as validator
    import usd_validation_nvidia as rules
    import warp

    logging.getLogger().setLevel(logging.ERROR)  # the validator warns of its own code
    warp.config.quiet = True
    validator.initialize(rules_and_requirements_paths=[], features_paths=[], profiles_paths=[])
    engine = rules.ValidationEngine(init_rules=False)
    for rule in rules.CategoryRuleRegistry().rules:
        if rule.__module__.startswith(rules.__name__):  # not those of SimReady's features, which are for profiles
            engine.enable_rule(rule)
    keys = [(category, options.first_seed + n) for category in sorted(FAMILIES) for n in range(options.objects)]
    failed: Counter[str] = Counter()
    counts, issues, worst = Counter[str](), Counter[str](), defaultdict[str, dict[str, float]](dict)
    for category, seed in track("objects", keys, unit="object"):
        with tempfile.TemporaryDirectory() as place:
            folder, obj = Path(place), make(category, seed)
            export(obj, folder, ("urdf", "mjcf", "usd", "simready"))
            (file,) = (folder / FORMATS["simready"]).rglob("*.usdc")
            found = validator.validate_asset(
                validator.AssetValidationConfig(asset_path=str(file), profile_id="Robotics-Prop")
            )
            reasons = {
                reason for said in found.features_summary.values() if said["blocking_failure"]
                for reason in [str(said.get("failing requirements"))]
            }  # fmt: skip
            counts["passed"] += not reasons
            failed.update(f"{category} {seed}: {reason}" for reason in reasons)
            if any(detail.label in GRIPS for detail in obj.details):
                counts["with grips"] += 1
                counts["passed grasps"] += found.features_summary[GRASPS]["passed"]
            lines = [f"{issue.severity.name} {issue.rule.__name__}" for issue in engine.validate(str(file)).issues()]
            counts["passed rules"] += not any(line.startswith(("FAILURE", "ERROR")) for line in lines)
            issues.update(lines)
            own = wanted(as_robot(obj))
            for name, read in READERS.items():
                seen = read(folder)
                for quantity, value in differences(seen, own).items():
                    worst[name][quantity] = max(worst[name].get(quantity, 0.0), value)
    for line in failed:
        say(line)
    print(f"Robotics-Prop: {counts['passed']} of {len(keys)} pass")
    print(f"{GRASPS}: {counts['passed grasps']} of {counts['with grips']} with handles, knobs or latches pass")
    print(f"{len(engine.rules)} rules of {rules.__name__}: {counts['passed rules']} pass; {dict(issues)}")
    print("| largest relative difference | " + " | ".join(QUANTITIES) + " |\n|---" + "|---" * len(QUANTITIES) + "|")
    for name, values in worst.items():
        cells = [f"{values[quantity]:.1e}" if quantity in values else "-" for quantity in QUANTITIES]
        print(f"| {name} | " + " | ".join(cells) + " |")
    kitchens = in_kitchens(options.kitchens)
    told = {"objects": len(keys), **counts, "failed": list(failed), "issues": issues, "differences": worst}
    print(json.dumps({"kitchens": kitchens, **told}))


if __name__ == "__main__":
    main()
