"""ManiSkill's own programs record the task and replay it: the object moves as it did."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest

from artsim.errors import ConfigError
from artsim.families import make
from artsim.model.draws import ViewOptions
from tests.conftest import ASSETS, installed

installed("torch")
installed("mani_skill")
import h5py  # noqa: E402
from mani_skill.utils.wrappers.record import RecordEpisode  # noqa: E402

from artsim.envs.maniskill import RECORDED_ID  # noqa: E402
from artsim.envs.maniskill.options import TaskOptions  # noqa: E402
from artsim.envs.maniskill.recorded import read_options, recorded_options  # noqa: E402

pytestmark = pytest.mark.slow

STEPS = 12
OPTIONS = {"goal": "close", "max_joints": 1, "robot_uids": "floating_panda_gripper", "render_backend": "none"}


def recorded(folder: Path, **options: Any) -> Path:
    """Two episodes in which a hand, if there is one, pushes an object; the second has no seed."""
    env = RecordEpisode(
        gymnasium.make(RECORDED_ID, **{**OPTIONS, **options}), str(folder), trajectory_name="made", save_video=False
    )
    for seed in (5, None):
        env.reset(seed=seed)
        for _ in range(STEPS):
            env.step(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], np.float32)[: env.action_space.shape[-1]])
    env.close()
    return folder / "made.h5"


def replayed(file: Path, *words: str) -> Path:
    """As a shell does it."""
    done = subprocess.run(
        [sys.executable, "-m", "mani_skill.trajectory.replay_trajectory", "--traj-path", str(file), *words]
        + ["--save-traj", "--allow-failure"],
        capture_output=True,
        text=True,
        cwd=file.parent,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert "Replayed 2 episodes, 2/2" in done.stdout
    (made,) = file.parent.glob("made.state.*.physx_cpu.h5")
    return made


def object_states(file: Path) -> list[Any]:
    """(T + 1, 13 + 2 D) of the object in each episode."""
    with h5py.File(file) as data:
        return [data[f"traj_{i}/env_states/articulations/object"][:] for i in range(len(data))]


@pytest.fixture(scope="module")
def drawers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("drawers"), categories=("drawer",))


def test_objects_are_pushed_in_replays_of_actions_as_they_were(drawers: Path) -> None:
    before, after = object_states(drawers), object_states(replayed(drawers))
    for then, now in zip(before, after, strict=True):
        assert then.shape == now.shape
        assert np.abs(then - now).max() < 1e-4
    assert np.ptp(before[0][:, 13]) > 0.05, "the hand moves the drawer"
    assert not np.allclose(before[0][0], before[1][0]), "two objects"


def test_objects_are_put_in_replays_of_states_where_they_were(drawers: Path) -> None:
    # ManiSkill writes what a step makes of each state that it has set, and first the second state: there is no zeroth.
    before, after = object_states(drawers), object_states(replayed(drawers, "--use-env-states"))
    for then, now in zip(before, after, strict=True):
        assert np.abs(then[1:] - now[1:]).max() < 1e-4


def test_files_that_move_by_themselves_are_replayed_by_two_processes(tmp_path: Path) -> None:
    """The lid of a laptop falls, and no robot is there."""
    file = recorded(
        tmp_path, objects=(ASSETS / "laptop",), gravity=True, views=ViewOptions(width=32), robot_uids="none"
    )
    before, after = object_states(file), object_states(replayed(file, "--num-envs", "2"))
    for then, now in zip(before, after, strict=True):
        assert np.abs(then - now).max() < 1e-4
        assert np.ptp(then[:, 13]) > 0.1


def test_states_of_a_recording_can_be_set(drawers: Path) -> None:
    from mani_skill.trajectory.utils import dict_to_list_of_dicts

    options = json.loads(drawers.with_suffix(".json").read_text())["env_info"]["env_kwargs"]
    env = gymnasium.make(RECORDED_ID, **options).unwrapped
    env.reset(seed=5)
    with h5py.File(drawers) as data:
        states = dict_to_list_of_dicts(data["traj_0/env_states"])
    for state in states[::-4]:
        env.set_state_dict(state)
        assert np.allclose(env.get_state_dict()["articulations"]["object"][0], state["articulations"]["object"])
        assert np.allclose(env.get_state_dict()["goal"][0], state["goal"])


def test_states_of_another_object_are_refused(drawers: Path) -> None:
    from mani_skill.trajectory.utils import dict_to_list_of_dicts

    env = gymnasium.make(RECORDED_ID, **OPTIONS, categories=("drawer",)).unwrapped
    env.reset(seed=6)
    before = env.get_state()
    with h5py.File(drawers) as data:
        states = dict_to_list_of_dicts(data["traj_0/env_states"])
    with pytest.raises(ConfigError, match=r"another object than drawer .*Fix: .*reset\(seed="):
        env.set_state_dict(states[0])
    assert env.get_state().equal(before)


@pytest.mark.parametrize(
    "options",
    [
        {"categories": ("laptop", "drawer"), "scale": (0.5, 1.0), "goal": "random"},
        {"objects": (ASSETS.absolute() / "laptop",), "views": ViewOptions(width=32, azimuth=(0.0, 10.0))},
    ],
    ids="+".join,
)
def test_options_come_back_from_json(options: dict[str, Any]) -> None:
    assert read_options(json.loads(json.dumps(recorded_options(options)))) == TaskOptions(**options)


def test_an_object_that_was_passed_itself_is_recorded_by_its_name_and_refused_in_replays(tmp_path: Path) -> None:
    file = recorded(tmp_path, obj=make("laptop", 0))
    options = json.loads(file.with_suffix(".json").read_text())["env_info"]["env_kwargs"]
    with pytest.raises(ConfigError, match=r"laptop.*Fix: record with categories.*objects"):
        gymnasium.make(RECORDED_ID, **options)
