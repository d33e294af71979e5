"""What the ManiSkill task refuses, and what it says where something is not installed or not on this machine."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import trimesh

import artsim.envs  # noqa: F401  # registers the task
from artsim.errors import AssetError, ConfigError
from tests.conftest import ASSETS, absent, installed, rigid, valve
from tests.without import beyond_the_core, environment

torch = installed("torch")
installed("mani_skill")

pytestmark = pytest.mark.slow

ID = "ArtSimArticulated-v1"
GRIPPER = "floating_panda_gripper"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"obs_mode": "rgbx"}, r"obs_mode.*use state, state_dict, .*pointcloud, .*segmentation, position, normal"),
        ({"obs_mode": 3}, "obs_mode"),
        ({"sim_backend": "tpu"}, "use auto, cpu or gpu"),
        ({"render_backend": "tpu"}, "use auto, cpu, gpu or none"),
        ({"render_backend": None, "obs_mode": "rgbd"}, "render_backend: none: draws nothing"),
        ({"reward_mode": "lavish"}, "reward_mode"),
        ({"robot_uids": "anymal_c"}, "floating_panda_gripper, fetch, .*none"),
        ({"robot_uids": ["panda"]}, "robot_uids"),
        ({"goal": "slam"}, "open, close"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"categories": ("spaceship",)}, "spaceship"),
        ({"colour": "red"}, "colour"),
        ({"max_joints": 0}, "max_joints"),
        ({"obj": valve(), "max_joints": 2}, "max_joints=4"),
        ({"obj": rigid(trimesh.creation.box((1, 1, 1)))}, "0 joints"),
        ({"num_envs": 4, "sim_backend": "physx_cpu"}, "AsyncVectorEnv"),
    ],
    ids=lambda value: "" if isinstance(value, str) else "+".join(value),
)
def test_wrong_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        gymnasium.make(ID, **options)


@pytest.mark.parametrize("action", [np.zeros(3), np.zeros((2, 7)), np.full(7, np.nan), 0.5])
def test_actions_of_another_shape_are_refused(action: Any) -> None:
    env = gymnasium.make(ID, robot_uids=GRIPPER, categories=("laptop",))
    env.reset(seed=0)
    with pytest.raises(ConfigError, match=r"\(1, 7\)"):
        env.step(action)


def test_folders_without_objects_or_meshes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="no URDF"):
        gymnasium.make(ID, objects=(tmp_path,))
    (tmp_path / "mobility.urdf").write_text((ASSETS / "laptop" / "mobility.urdf").read_text())
    with pytest.raises(AssetError, match="mobility"):
        gymnasium.make(ID, objects=(tmp_path,))


@pytest.mark.parametrize("backend", ["gpu", "cuda", "physx_cuda", "cuda:0"])
def test_without_cuda_gpus_are_refused(backend: str) -> None:
    if torch.cuda.is_available():
        absent("this machine has a CUDA device")
    with pytest.raises(ConfigError, match=r"sim_backend: .* needs a CUDA device.* Fix: use cpu, or auto$"):
        gymnasium.make(ID, sim_backend=backend)


def test_robots_without_files_name_the_command_that_downloads_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MS_ASSET_DIR", str(tmp_path))
    source = (
        "import gymnasium, artsim.envs\n"
        "from artsim.errors import ConfigError\n"
        "try:\n"
        f"    gymnasium.make({ID!r}, robot_uids='xarm6_robotiq')\n"
        "except ConfigError as error:\n"
        "    print('said', error)\n"
    )
    said = output_of(source).splitlines()[-1]
    assert said.startswith("said robot_uids: the files of 'xarm6_robotiq' are not in ")
    assert said.endswith("Fix: python -m mani_skill.utils.download_asset xarm6")


def test_without_a_vulkan_device_states_are_there_and_images_name_the_mend(monkeypatch: pytest.MonkeyPatch) -> None:
    source = (
        "import gymnasium, artsim.envs\n"
        "from artsim.errors import RenderError\n"
        f"env = gymnasium.make({ID!r}, robot_uids={GRIPPER!r}, categories=('laptop',))\n"
        "env.reset(seed=0); env.step(env.action_space.sample())\n"
        "try:\n"
        f"    gymnasium.make({ID!r}, obs_mode='pointcloud')\n"
        "except RenderError as error:\n"
        "    print('said', error)\n"
    )
    monkeypatch.setenv("VK_DRIVER_FILES", "/nonexistent")
    monkeypatch.setenv("VK_ICD_FILENAMES", "/nonexistent")
    assert "install-vulkan.sh" in output_of(source)


def test_without_maniskill_the_environment_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", environment(tmp_path, ["mani_skill"])["PYTHONPATH"])
    source = (
        "import gymnasium, artsim.envs\n"
        "from artsim.errors import ConfigError\n"
        "gymnasium.make('artsim/Articulated-v0', num_points=8)\n"
        "try:\n"
        f"    gymnasium.make({ID!r})\n"
        "except ConfigError as error:\n"
        "    print('said', error)\n"
    )
    assert "[maniskill]" in output_of(source)


def test_the_extra_alone_is_enough_and_brings_no_pybullet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = beyond_the_core("maniskill")
    assert "pybullet" in missing
    assert "mani_skill" not in missing
    monkeypatch.setenv("PYTHONPATH", environment(tmp_path, missing)["PYTHONPATH"])
    source = (
        "import gymnasium, artsim.envs\n"
        f"env = gymnasium.make({ID!r}, robot_uids={GRIPPER!r}, categories=('laptop',))\n"
        "env.reset(seed=0)\n"
        "print('said', env.step(env.action_space.sample())[4]['part_valid'].sum().item())\n"
    )
    assert "said 2" in output_of(source)


def test_nothing_heavy_is_imported_before_an_environment_is_made() -> None:
    heavy = "print('said', [name for name in ('torch', 'mani_skill', 'sapien') if name in sys.modules])"
    assert "said []" in output_of(f"import sys, artsim.envs; {heavy}")


def output_of(source: str) -> str:
    done = subprocess.run([sys.executable, "-c", source], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout
