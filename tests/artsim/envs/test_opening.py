"""Hands open what they see: by true physics, from true points, and not without looking."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from PIL import Image

import artsim.envs  # noqa: F401  # registers artsim/Opening-v0
from artsim.envs.handles import STIFFNESS, HeldJoints, find_handles
from artsim.envs.opening import CONTROL_STEP, SPEED, OpeningVectorEnv
from artsim.errors import ConfigError
from artsim.families import make
from artsim.physics import PhysicsOptions, Simulation
from artsim.renderers import render
from tests.conftest import installed
from tests.programs import run_here

ID = "artsim/Opening-v0"


def episode(envs: OpeningVectorEnv, policy: Any, seed: int = 0) -> tuple[Any, Any]:
    """The return and the info at the end."""
    envs.reset(seed=seed)
    total, over = np.zeros(envs.num_envs), False
    while not over:
        _, reward, _, truncated, info = envs.step(policy())
        total, over = total + reward, bool(truncated.all())
    return total, info


@pytest.mark.parametrize(("category", "seed"), [("drawer", 0), ("microwave", 0), ("oven", 1), ("washing_machine", 1)])
def test_a_joint_that_is_let_go_moves_as_in_the_simulation(category: str, seed: int) -> None:
    installed("mujoco")
    handle = find_handles(make(category, seed))[0]
    joints, reach = HeldJoints([handle]), handle.joint.upper
    joints.q, joints.speed = np.array([0.5 * reach]), np.array([reach])
    k = handle.detail.part
    simulation = Simulation(handle.obj, PhysicsOptions(engine="mujoco"))
    start, still = handle.object_state(0.5 * reach), handle.object_state(0.0)
    way = np.sign(start - still)[k]
    speed = np.zeros(len(handle.obj))
    speed[k] = way * reach
    simulation.reset(start, speed)
    for _ in range(10):
        simulation.step(np.zeros_like(simulation.effort_limit))
        joints.move(np.zeros((1, 3)), CONTROL_STEP)
        assert joints.q[0] == pytest.approx(way * (simulation.state - still)[k], abs=0.02 * reach)
        place = handle.obj.tree.forward_kinematics(handle.object_state(float(joints.q[0])))[k]
        np.testing.assert_allclose(joints.place[0], (place @ np.append(handle.place, 1.0))[:3], atol=1e-9)


def test_a_latch_holds_until_it_is_pulled_hard_enough() -> None:
    handle = find_handles(make("microwave", 0))[0]
    needed = (handle.joint.hold + handle.joint.friction) / handle.lever
    for force, opens in ((0.9 * needed, False), (1.1 * needed, True)):
        joints = HeldJoints([handle])
        joints.grasp(np.array([True]))
        along = joints.lever(joints.place) / handle.lever
        joints.hand = joints.hand + force / STIFFNESS * along
        for _ in range(10):
            joints.move(np.zeros((1, 3)), CONTROL_STEP)
        assert (joints.q[0] > 0.001) == opens


def test_a_pull_aside_slips_and_a_hand_beside_the_handle_takes_nothing() -> None:
    envs = OpeningVectorEnv(4, pool=4, observe="state")
    envs.reset(seed=0)
    for _ in range(20):
        seen, *_ = envs.step(np.tile(np.float32([0, 0, 1]), (4, 1)))  # drawers do not go up
    assert not seen["hand"][:, 4].any()
    assert (envs.joints.q < 0.1 * envs.joints.reach).all()
    free = OpeningVectorEnv(4, pool=4, observe="state", task="grasp")
    free.reset(seed=0)
    seen, *_ = free.step(np.tile(np.float32([0, 0, 0, 1]), (4, 1)))
    assert seen["hand"][:, 3].all()
    assert not seen["hand"][:, 4].any()


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"categories": ("microwave", "drawer", "table"), "count": 3}])
def test_points_are_where_the_camera_sees_something(options: dict[str, Any]) -> None:
    envs = OpeningVectorEnv(2, pool=3, **options)
    envs.reset(seed=1)
    for _ in range(25):
        seen, *_ = envs.step(envs.oracle())
    assert (envs.joints.q > 0.1 * envs.joints.reach).all()
    for view, q, hand, points in zip(envs.views, envs.joints.q, envs.joints.hand, seen["points"], strict=True):
        depths = [render(view.handle.obj, view.handle.object_state(float(q)), view.camera).depth]
        depths += [render(obj, obj.tree.rest, view.camera, T).depth for obj, T in view.others]
        nearest = np.min([np.where(depth > 0, depth, np.inf) for depth in depths], axis=0)
        depth = nearest[view.row, view.column]
        met = np.isfinite(depth)
        assert met.mean() > 0.5
        world = points.astype(float) @ view.R_level_world + hand
        np.testing.assert_allclose((world[met] - view.camera.T_world_camera[:3, 3]) @ view.camera.T_world_camera[:3, 2],
                                   depth[met], atol=1e-4)  # fmt: skip
        column, row = np.floor(view.camera.project(world[met] @ view.camera.T_camera_world[:3, :3].T
                                                   + view.camera.T_camera_world[:3, 3])).astype(int).T  # fmt: skip
        np.testing.assert_array_equal(row, view.row[met])
        np.testing.assert_array_equal(column, view.column[met])
        assert (points[~met] == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("task", ["pull", "grasp"])
def test_who_knows_the_state_opens_and_who_does_not_look_fails(task: Any) -> None:
    envs = OpeningVectorEnv(32, pool=16, task=task, observe="state")
    rewards, info = episode(envs, envs.oracle)
    assert info["success"].mean() > 0.9
    np.testing.assert_allclose(rewards[info["success"]], 2.0 if task == "pull" else 3.0, atol=0.11)
    for fast in (0.2, 0.4, 0.6):
        constant = np.tile(np.float32([-fast, 0, 0, 1])[: envs.single_action_space.shape[0]], (32, 1))
        assert episode(envs, lambda constant=constant: constant)[1]["success"].mean() < 0.4
    envs.action_space.seed(0)
    assert episode(envs, envs.action_space.sample)[1]["success"].mean() < 0.1


@pytest.mark.slow
def test_stable_baselines_begins_anew_what_ends_together() -> None:
    installed("stable_baselines3")
    from artperl.training.stable_baselines import StableBaselinesEnvs

    envs = StableBaselinesEnvs(OpeningVectorEnv(2, pool=1, observe="state", episode_length=3))
    envs.reset()
    for step in range(3):
        seen, _, done, infos = envs.step(np.tile(np.float32([-0.1, 0, 0]), (2, 1)))
        assert done.tolist() == [step == 2] * 2
    last = np.stack([info["terminal_observation"]["hand"] for info in infos])
    np.testing.assert_allclose(last[:, :3], [[-3 * 0.1 * SPEED * CONTROL_STEP, 0, 0]] * 2, atol=1e-6)
    assert (seen["hand"][:, :3] == 0).all()


@pytest.mark.slow
def test_the_example_teaches_tries_and_shows(tmp_path: Path) -> None:
    ppo = installed("stable_baselines3").PPO
    few = {"seeds": 1, "objects": 8, "hands": 8, "episode-length": 30, "rounds": 2, "trials": 8}
    words = [word for name, value in few.items() for word in (f"--{name}", value)]
    done = run_here("examples/opening/main.py", tmp_path, *words)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["oracle"] == 1.0
    assert max(told["best constant"], told["random"]) < 0.5
    (row,) = told["seeds"]
    assert [steps for steps, _ in row["curve"]] == [0, 240, 480, 720, 960]
    with Image.open(tmp_path / "opening_policy.webp") as film, Image.open(tmp_path / "opening_policy.png") as curve:
        assert film.size == (800, 150)
        assert 10 < film.n_frames <= 30  # equal pictures in a row are one
        assert curve.width > 500
    envs = OpeningVectorEnv(2, pool=1)
    seen, _ = envs.reset(seed=0)
    action, _ = ppo.load(tmp_path / "policy_1.zip", device="cpu").predict(seen, deterministic=True)
    assert action.shape == (2, 3)
    assert not np.allclose(*action, atol=1e-3)  # it looks: other hands stand before other drawers


def test_gymnasium_finds_nothing_wrong_and_equal_seeds_make_equal_episodes() -> None:
    check_env(gymnasium.make(ID, pool=2, observe=("cloud", "state")).unwrapped, skip_render_check=True)
    one, other = (gymnasium.make_vec(ID, 2, pool=2, task="grasp") for _ in range(2))
    other.reset(seed=9)
    first, again = one.reset(seed=4)[0], other.reset(seed=4)[0]
    one.action_space.seed(0)
    action = one.action_space.sample()
    for before, after in ((first, again), (one.step(action)[0], other.step(action)[0])):
        assert all(np.array_equal(before[name], after[name]) for name in before)


def test_a_picture_shows_every_episode() -> None:
    envs = OpeningVectorEnv(2, "rgb_array", pool=2)
    envs.reset(seed=0)
    pictures = envs.render()
    assert pictures is not None
    assert [picture.shape for picture in pictures] == [(72, 96, 3)] * 2
    assert all((picture == (20, 20, 20)).all(axis=2).any() for picture in pictures)  # the hand


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"category": "drawer"}, "no option category.*categories"),
        ({"task": "push"}, "pull or grasp"),
        ({"observe": ("image",)}, "cloud, state"),
        ({"pool": 0}, "use 1 or more"),
        ({"count": 2}, "more categories"),
        ({"categories": ("drawr",)}, "no category drawr"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        OpeningVectorEnv(**options)


def test_objects_without_handles_and_wrong_actions_are_refused() -> None:
    with pytest.raises(ConfigError, match="no object has a handle"):
        OpeningVectorEnv(categories="laptop", pool=1).reset(seed=0)
    envs = OpeningVectorEnv(2, pool=1)
    envs.reset(seed=0)
    with pytest.raises(ConfigError, match="finite numbers"):
        envs.step(np.zeros((2, 4)))
