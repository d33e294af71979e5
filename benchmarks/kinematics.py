"""Kinematics against independent oracles: ``python -m benchmarks.kinematics``.

For every real object, part transforms at random states are compared with PyBullet's and yourdfpy's own kinematics of
the same, unrepaired file. PyBullet reads a copy without meshes and inertias, which do not enter kinematics. Both
multiply the travel of a slide by the length of its axis, which URDF and MuJoCo take for a direction: both are given
unit axes. The last line is one JSON object.
"""

from __future__ import annotations

import importlib.util
import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
import tyro
from lxml import etree

from artsim import load
from artsim.common.extras import silence_output
from artsim.common.progress import track
from artsim.loading.sources import find_sources
from artsim.model.draws import StateOptions, sample_state
from artsim.model.kinematics import Array, invert_transform
from artsim.model.objects import ArticulatedObject
from artsim.physics.simulators import LinkPoses, poses_in_file
from artsim.renderers.bullet import import_pybullet


@dataclass(frozen=True)
class Options:
    """Compare kinematics with PyBullet and yourdfpy."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects; those that come with PyBullet are always compared."""
    states: int = 20
    """Random states of each object."""


@dataclass
class Comparison:
    """What came out against one oracle."""

    compared: int = 0
    max_m: float = 0.0
    max_rad: float = 0.0
    not_loaded: list[str] = field(default_factory=list)


def main(options: Options) -> None:
    """Compare and print."""
    files = ([s.path for s in find_sources([options.partnet])] if options.partnet else []) + bullet_robots()
    result, failed = compare(files, options.states)
    for name, comparison in result.items():
        print(f"{name}: {comparison.compared} objects, {comparison.max_m:.2g} m, {comparison.max_rad:.2g} rad at most")
        for reason in comparison.not_loaded:
            print(f"  not compared: {reason}")
    for reason in failed:
        print(f"artsim does not load {reason}")
    print(json.dumps({"objects": len(files), "failed": failed, **{n: vars(c) for n, c in result.items()}}))


def bullet_robots() -> list[Path]:
    """URDF files of arms and other articulated things that come with PyBullet."""
    spec = importlib.util.find_spec("pybullet_data")
    if spec is None or not spec.submodule_search_locations:
        return []
    names = (
        "franka_panda/panda",
        "kuka_iiwa/model",
        "xarm/xarm6_robot",
        "r2d2",
        "a1/a1",
        "laikago/laikago",
    )
    files = [Path(spec.submodule_search_locations[0]) / f"{name}.urdf" for name in names]
    return [file for file in files if file.is_file()]


def compare(files: Sequence[Path], states: int) -> tuple[dict[str, Comparison], list[str]]:
    """Largest differences over objects, parts and states; and the files that artsim itself does not load."""
    oracles = {"pybullet": pybullet_poses, "yourdfpy": poses_in_file}
    result = {name: Comparison() for name in oracles}
    failed = []
    for file in track("objects", files, unit="object"):
        try:
            obj = load(file)
        except Exception as error:  # any failure of the loader is a finding
            failed.append(f"{file}: {error}")
            continue
        rng = np.random.default_rng(0)
        drawn = [obj.tree.rest, *(sample_state(obj, StateOptions(), rng) for _ in range(states))]
        for name, oracle in oracles.items():
            try:
                poses = oracle(file)
            except Exception as error:  # an oracle may refuse a file in any way it likes
                result[name].not_loaded.append(f"{file.parent.name}/{file.name}: {type(error).__name__}: {error}")
                continue
            metres, radians = differences(obj, drawn, poses)
            result[name].compared += 1
            result[name].max_m = max(result[name].max_m, metres)
            result[name].max_rad = max(result[name].max_rad, radians)
    return result, failed


def differences(obj: ArticulatedObject, states: Sequence[Array], poses: LinkPoses) -> tuple[float, float]:
    """Largest translation and rotation between an oracle's motion of each part since rest, and ours.

    ``states[0]`` is the rest state. Translation is compared at the part's own box centre's frame, the base link's.
    """
    at_rest = poses(obj.source_state(states[0]))
    T_rest_base = invert_transform(obj.T_base_rest)
    metres = radians = 0.0
    for q in states:
        posed = poses(obj.source_state(q))
        ours = obj.T_base_rest @ obj.native_tree.forward_kinematics(q) @ T_rest_base
        for k, part in enumerate(obj.parts):
            theirs = posed[part.name] @ invert_transform(at_rest[part.name])
            error = invert_transform(theirs) @ ours[k]
            metres = max(metres, float(np.linalg.norm(theirs[:3, 3] - ours[k, :3, 3])))
            # Frobenius distance: exact for small angles, where the arc cosine of a trace is not.
            radians = max(radians, float(np.linalg.norm(error[:3, :3] - np.eye(3)) / np.sqrt(2)))
    return metres, radians


@cache
def _client() -> int:
    """One physics server for all files: each takes tens of megabytes."""
    bullet = import_pybullet()
    return int(bullet.connect(bullet.DIRECT))


def pybullet_poses(file: Path) -> LinkPoses:
    """PyBullet's own forward kinematics of a file without meshes and inertias, slides' axes made unit vectors.

    Valid until the next call.
    """
    bullet = import_pybullet()
    root = etree.parse(str(file)).getroot()
    for link in root.findall("link"):
        for child in list(link):
            link.remove(child)
    for joint in root.iterfind("joint[@type='prismatic']"):
        axis = joint.find("axis")
        if axis is not None:
            direction = np.array(axis.get("xyz", "1 0 0").split(), dtype=np.float64)
            axis.set("xyz", " ".join(map(repr, (direction / np.linalg.norm(direction)).tolist())))
    client = _client()
    bullet.resetSimulation(physicsClientId=client)
    with tempfile.NamedTemporaryFile(suffix=".urdf") as bare, silence_output():
        bare.write(etree.tostring(root))
        bare.flush()
        body = bullet.loadURDF(bare.name, useFixedBase=True, physicsClientId=client)
    infos = [bullet.getJointInfo(body, j, physicsClientId=client) for j in range(bullet.getNumJoints(body, client))]
    numbers = {info[1].decode(): info[0] for info in infos}
    links = {info[12].decode(): info[0] for info in infos}
    base = bullet.getBodyInfo(body, physicsClientId=client)[0].decode()

    def poses(state: dict[str, float]) -> dict[str, Array]:
        for name, number in numbers.items():
            bullet.resetJointState(body, number, state.get(name, 0.0), physicsClientId=client)
        found = {base: np.eye(4)}
        for name, link in links.items():
            at = bullet.getLinkState(body, link, computeForwardKinematics=True, physicsClientId=client)
            found[name] = np.eye(4)
            found[name][:3, :3] = np.reshape(bullet.getMatrixFromQuaternion(at[5]), (3, 3))
            found[name][:3, 3] = at[4]
        return found

    return poses


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
