"""The gymnasium environment keeps its promises: to gymnasium, to physics and to its seed."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv

import artsim.envs
from artsim.datasets.sample_checks import sample_problems
from artsim.envs.articulated import EPISODE_LENGTH, ArticulatedEnv
from artsim.errors import ArtsimError, ConfigError
from artsim.families import make
from artsim.model.camera import Camera
from artsim.model.draws import ViewOptions
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform
from artsim.physics.episode import openness
from tests.conftest import ASSETS

ID = "artsim/Articulated-v0"
SMALL = {"num_points": 128, "views": ViewOptions(width=64, height=48)}
IMAGES = {"images": ("depth", "part_mask"), "noise": "d435", "camera": "orbit", "categories": ("laptop", "valve")}


def new(**options: Any) -> ArticulatedEnv:
    env = gymnasium.make(ID, **{**SMALL, **options}).unwrapped
    assert isinstance(env, ArticulatedEnv)
    return env


@pytest.mark.slow
@pytest.mark.parametrize("options", [{}, {"control": "velocity", **IMAGES}], ids=["plain", "images"])
def test_gymnasium_finds_nothing_wrong(options: dict[str, Any]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*-?infinity")  # a point may be anywhere
        check_env(new(**options))


@pytest.mark.slow
@pytest.mark.parametrize("options", [{"control": "velocity", "categories": ("safe", "window")}, IMAGES])
def test_equal_seeds_make_equal_episodes(options: dict[str, Any]) -> None:
    def episode(env: ArticulatedEnv, seed: int | None) -> list[Any]:
        seen = [env.reset(seed=seed)]
        env.action_space.seed(3)
        return seen + [env.step(env.action_space.sample()) for _ in range(4)]

    one, other = new(**options), new(**options)
    other.reset(seed=1)  # whatever came before does not matter
    first, again, further = episode(one, 7), episode(other, 7), episode(one, None)
    for (seen, *_, info), (seen_again, *_, info_again), (seen_further, *_) in zip(first, again, further, strict=True):
        for name, array in seen.items():
            assert np.array_equal(array, seen_again[name])
        assert info.keys() == info_again.keys()
        assert all(np.array_equal(info[name], info_again[name]) for name in info)
        assert not np.array_equal(seen["points"], seen_further["points"])


def test_every_episode_has_an_object_of_its_own() -> None:
    env = new(categories=("laptop", "drawer"))
    objects = [env.reset(seed=0 if n == 0 else None)[1] for n in range(12)]
    assert len({info["object_id"] for info in objects}) == 12
    assert {info["category"] for info in objects} == {"laptop", "drawer"}


def test_an_env_can_hold_one_object_or_a_folder_of_them() -> None:
    obj = make("door", 5)
    env = new(obj=obj)
    assert [env.reset()[1]["object_id"] for _ in range(2)] == ["5", "5"]
    folder = new(objects=(ASSETS,))
    assert len({folder.reset(seed=seed)[1]["object_id"] for seed in range(8)}) > 2


@pytest.mark.parametrize("camera", ["fixed", "orbit"])
def test_what_is_seen_is_true(camera: str) -> None:
    obj = make("storage_furniture", 0)
    env = new(obj=obj, camera=camera, images=("depth", "part_mask"))
    _, info = env.reset(seed=0)
    start = info["T_world_camera"]
    for n in range(1, 6):
        seen, _, _, _, info = env.step(np.ones(16))
        assert list(sample_problems(env.sample, obj)) == []
        assert info["time"] == pytest.approx(n / 20)
        np.testing.assert_array_equal(info["joint_state"][: len(obj)], env.simulation.state)
        near = Camera(info["K"], 64, 48, np.eye(4)).project(seen["points"])
        column, row = np.floor(near[:, :2]).astype(int).T
        np.testing.assert_allclose(seen["depth"][row, column], seen["points"][:, 2], atol=1e-5)
        np.testing.assert_array_equal(seen["part_mask"][row, column], info["part"])
    turned = invert_transform(start) @ info["T_world_camera"]
    angle = np.rad2deg(np.arccos(np.clip(0.5 * (np.trace(turned[:3, :3]) - 1), -1, 1)))
    assert angle == pytest.approx(0.0 if camera == "fixed" else 5.0, abs=1e-4)


def test_opening_an_object_is_rewarded(one_drawer: ArticulatedObject) -> None:
    env = new(obj=one_drawer, episode_length=30)
    env.reset(seed=0)
    steps = [env.step(np.ones(16)) for _ in range(30)]
    assert sum(reward for _, reward, *_ in steps) == pytest.approx(1.0)
    assert steps[-1][4]["openness"] == pytest.approx(openness(one_drawer, one_drawer.tree.limits[:, 1]))
    assert [truncated for *_, truncated, _ in steps] == [False] * 29 + [True]
    assert not any(terminated for _, _, terminated, _, _ in steps)


def test_an_action_is_a_share_of_the_limits(one_drawer: ArticulatedObject) -> None:
    env, simulated = new(obj=one_drawer), new(obj=one_drawer)
    _, info = env.reset(seed=0)
    simulated.reset(seed=0)
    assert info["action_valid"].sum() == len(one_drawer.tree.free_joints)
    action = np.full(16, 0.02, np.float32)
    env.step(action)
    simulated.simulation.step(action[:1].astype(float) * info["action_limit"][:1])
    np.testing.assert_array_equal(env.simulation.state, simulated.simulation.state)
    action[1:] = 1.0  # beyond the object's only joint
    env.step(action)
    simulated.simulation.step(action[:1].astype(float) * info["action_limit"][:1])
    np.testing.assert_array_equal(env.simulation.state, simulated.simulation.state)


def small_env() -> ArticulatedEnv:
    return new(categories=("laptop", "chair"))


def test_many_envs_run_side_by_side() -> None:
    makers: list[Callable[[], ArticulatedEnv]] = [small_env, small_env]
    envs = AsyncVectorEnv(makers)
    try:
        seen, info = envs.reset(seed=[4, 5])
        assert seen["points"].shape == (2, 128, 3)
        assert info["T_camera_part"].shape == (2, 17, 4, 4)
        seen, reward, *_, info = envs.step(np.ones((2, 16), np.float32))
        assert reward.shape == (2,)
        alone = small_env()
        alone.reset(seed=5)
        expected, gained, *_ = alone.step(np.ones(16, np.float32))
        np.testing.assert_array_equal(seen["points"][1], expected["points"])
        assert reward[1] == gained
    finally:
        envs.close()


def test_a_picture_shows_the_object() -> None:
    env = new(render_mode="rgb_array", images=("part_mask",))
    seen, _ = env.reset(seed=0)
    picture = env.render()
    assert picture is not None
    assert picture.shape == (48, 64, 3)
    drawn = (picture < 255).any(axis=2)
    assert np.mean(drawn == (seen["part_mask"] < 255)) > 0.98


@pytest.mark.parametrize("action", [np.zeros(3), np.zeros((1, 16)), np.full(16, np.nan), 0.5])
def test_a_wrong_action_is_refused(action: Any) -> None:
    env = new()
    env.reset(seed=0)
    with pytest.raises(ArtsimError, match=r"16 finite numbers.*max_joints"):
        env.step(action)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"category": "laptop"}, "no option category.*categories"),
        ({"categories": ("lap",)}, "no category lap"),
        ({"control": "torque"}, "effort or velocity"),
        ({"camera": "wild"}, "fixed or orbit"),
        ({"images": ("rgb",)}, "depth, part_mask"),
        ({"episode_length": 0}, "use 1 or more"),
        ({"render_mode": "human"}, "rgb_array"),
        ({"noise": "snow"}, "no sensor"),
        ({"objects": ("nowhere",)}, "nowhere"),
    ],
)
def test_options_that_make_no_sense_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ArtsimError, match=words):
        ArticulatedEnv(**options)


def test_an_object_with_too_many_joints_is_refused() -> None:
    obj = make("keyboard", 0)
    with pytest.raises(ConfigError, match=f"max_joints={len(obj.tree.free_joints)}"):
        new(obj=obj, max_joints=4).reset(seed=0)


def test_a_step_before_the_first_reset_is_refused() -> None:
    with pytest.raises(ArtsimError, match=r"reset\(\)"):
        ArticulatedEnv().step(np.zeros(16))


def test_the_environment_is_registered_on_import() -> None:
    assert artsim.envs.__name__ == "artsim.envs"
    assert ID in gymnasium.registry


def test_an_episode_has_the_category_the_object_and_the_state_that_reset_is_told() -> None:
    env = new(categories=("drawer",))
    _, info = env.reset(seed=1, options={"category": "laptop"})
    assert info["category"] == "laptop"
    laptop = artsim.make("laptop", 3)
    options = {"object": laptop, "state": [0.0, 0.5]}
    seen, info = env.reset(seed=1, options=options)
    assert env.unwrapped.episode.obj.sha256 == laptop.sha256
    np.testing.assert_allclose(info["joint_state"][:2], [0.0, 0.5], atol=1e-9)
    again, _ = new(categories=("drawer",)).reset(seed=1, options=options)
    np.testing.assert_array_equal(again["points"], seen["points"])
    assert env.reset(seed=1)[1]["category"] == "drawer"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stat": [0.0, 0.5]}, "stat"),
        ({"category": "laptp"}, "laptp"),
        ({"category": "laptop", "state": [0.0, 9.0]}, "joint 1 cannot be at 9"),
        ({"category": "laptop", "state": [0.0]}, "no state"),
        ({"category": "laptop", "object": artsim.make("laptop", 0)}, "one object"),
    ],
)
def test_reset_refuses_what_it_does_not_know(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        new().reset(options=options)


@pytest.mark.parametrize("mode", ["sync", "async"])
def test_gymnasium_makes_vectors_of_environments(mode: str) -> None:
    envs = gymnasium.make_vec(ID, 2, vectorization_mode=mode, **SMALL)
    try:
        points = envs.reset(seed=[3, 4])[0]["points"]
        np.testing.assert_array_equal(points[1], new().reset(seed=4)[0]["points"])
        observation, reward, *_ = envs.step(envs.action_space.sample())
        assert observation["points"].shape == points.shape
        assert reward.shape == (2,)
    finally:
        envs.close()


def _steps(env: gymnasium.Env[Any, Any]) -> int:
    env.reset(seed=0)
    for n in range(1, 200):
        *_, terminated, truncated, _ = env.step(np.zeros(16, np.float32))
        if terminated or truncated:
            return n
    raise AssertionError("it does not end")


@pytest.mark.slow
def test_the_length_is_what_gymnasium_is_told() -> None:
    small = {**SMALL, "num_points": 8, "categories": "laptop", "physics": "mujoco"}
    assert _steps(gymnasium.make(ID, max_episode_steps=130, **small)) == 130
    assert _steps(gymnasium.make(ID, max_episode_steps=20, **small)) == 20
    env = gymnasium.make(ID, episode_length=30, **small)
    assert _steps(env) == 30
    assert env.spec is not None
    assert _steps(gymnasium.make(env.spec)) == 30
    assert _steps(gymnasium.make(ID, **small)) == EPISODE_LENGTH
    assert _steps(ArticulatedEnv(**small)) == EPISODE_LENGTH
    long = gymnasium.make(ID, max_episode_steps=130, **small)
    assert long.spec is not None
    assert long.spec.max_episode_steps == 130
    assert _steps(gymnasium.make(long.spec)) == 130
    both = gymnasium.make_vec(ID, num_envs=2, vectorization_mode="sync", max_episode_steps=20, **small)
    both.reset(seed=0)
    ends = [both.step(np.zeros((2, 16), np.float32))[3].all() for _ in range(20)]
    assert ends == [False] * 19 + [True]


@pytest.mark.parametrize("physics", ["mujoco", "pybullet"])
@pytest.mark.parametrize("control", ["effort", "velocity"])
def test_a_copy_goes_on_by_itself_from_the_same_state(physics: Any, control: Any) -> None:
    env = gymnasium.make(ID, **SMALL, categories="drawer", physics=physics, control=control)
    copy.deepcopy(env)  # before the first episode, too
    env.reset(seed=3)
    push = np.ones(16, np.float32)
    env.step(push)
    twin = copy.deepcopy(env)
    first, again = ([one.step(push) for _ in range(3)] for one in (env, twin))
    for (seen, reward, *_, info), (seen_again, reward_again, *_, info_again) in zip(first, again, strict=True):
        assert reward == pytest.approx(reward_again, abs=1e-12)
        np.testing.assert_allclose(info["joint_velocity"], info_again["joint_velocity"], atol=1e-9)
        np.testing.assert_allclose(seen["points"], seen_again["points"], atol=1e-6)
    env.close()
    twin.step(push)
    env.reset(seed=5)
    twin.reset(seed=5)
    np.testing.assert_array_equal(env.step(push)[0]["points"], twin.step(push)[0]["points"])


@pytest.mark.parametrize("kind", [str, Path])
def test_one_name_or_path_is_a_list_of_one(kind: Any, tmp_path: Path) -> None:
    assert new(categories="laptop").reset(seed=0)[1]["category"] == "laptop"
    with pytest.raises(ArtsimError, match="no such file or folder"):
        new(objects=kind(tmp_path / "missing"))
    assert new(objects=kind(ASSETS / "laptop")).reset(seed=0)[1]["part_names"]
    assert "depth" in new(images="depth").reset(seed=0)[0]
