"""What users choose of the ManiSkill task, and what they are told when it makes no sense."""

import inspect
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, get_args

import mani_skill.agents.robots  # noqa: F401  # registers them
import torch
from mani_skill import ASSET_DIR
from mani_skill.agents.registration import REGISTERED_AGENTS
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.envs.utils.observations import ALL_VISUAL_TEXTURES, parse_obs_mode_to_struct
from mani_skill.envs.utils.system.backend import CPU_SIM_BACKENDS, render_backend_name_mapping, sim_backend_name_mapping
from mani_skill.utils import assets

from artsim.common.sequences import wrap_singles
from artsim.envs.maniskill import ENV_ID
from artsim.envs.maniskill.goal import LEAST_OPEN, Goal
from artsim.envs.maniskill.robots import NO_ROBOT, ROBOTS
from artsim.errors import ConfigError
from artsim.model.draws import Scale, ViewOptions
from artsim.model.objects import ArticulatedObject

REWARD_MODES = ("normalized_dense", "dense", "sparse", "none")
_OBS_MODES = (
    "use state, state_dict, none, pointcloud, rgbd, sensor_data, or some of "
    f"state, {', '.join(ALL_VISUAL_TEXTURES)} with + between them"
)


@dataclass(frozen=True)
class TaskOptions:
    """What an episode is about; ManiSkill's own options besides."""

    categories: tuple[str, ...] = ("drawer",)
    """Procedural categories, such as drawer: every sub-scene has a new object of one, unless objects are named."""
    objects: tuple[Path, ...] = ()
    """URDF files, object folders, or folders of them: every sub-scene has one of these."""
    obj: ArticulatedObject | None = None
    """The one object of all."""
    scale: Scale = "native"
    """Size of the object: native (as in its file), unit (diagonal of 1 m), or a range of diagonals in metres."""
    goal: Goal = "open"
    """open: from rest to half open or more; close: the other way; random: from anywhere to anywhere."""
    tolerance: float = 0.1
    """Share of its range within which a joint is at its goal."""
    gravity: bool = False
    """Whether gravity pulls on the object's parts; without it, lids stay where they are left."""
    collision: Literal["hull", "pieces"] = "hull"
    """What of loaded parts collides: their convex hulls, or convex pieces (CoACD, the extra sim; seconds for each
    hollow piece, once), which leave drawers open."""
    views: ViewOptions = field(
        default_factory=lambda: ViewOptions(width=128, height=128, azimuth=(30.0, 75.0), elevation=(25.0, 55.0))
    )
    """Where the camera of the observations is."""
    max_joints: int = 16
    """Objects with more joints are passed over. Observations have as many rows, infos one more, for the root."""

    def __post_init__(self) -> None:
        wrap_singles(self)
        if self.goal not in get_args(Goal):
            raise ConfigError(f"there is no goal {self.goal!r}", "goal", "use open, close or random")
        if not 0.0 < self.tolerance < LEAST_OPEN:
            raise ConfigError(f"{self.tolerance} is not within 0..{LEAST_OPEN}", "tolerance", "use 0.1")
        if self.collision not in ("hull", "pieces"):
            raise ConfigError(f"there is no {self.collision!r}", "collision", "use hull or pieces")
        if self.max_joints < 1:
            raise ConfigError(f"{self.max_joints} is not a count", "max_joints", "use 1 or more")


def check(robot_uids: Any, num_envs: int, obs_mode: str, options: dict[str, Any]) -> None:
    """Refuse what ManiSkill would stumble on.

    Parameters
    ----------
    robot_uids : str
    num_envs : int
    obs_mode : str
    options : dict
        What is left for ManiSkill.

    Raises
    ------
    ConfigError
    """
    theirs = set(inspect.signature(BaseEnv.__init__).parameters)
    unknown = options.keys() - theirs
    if unknown:
        ours = ", ".join(f.name for f in fields(TaskOptions))
        raise ConfigError(f"there is no option {', '.join(sorted(unknown))}", ENV_ID, f"use {ours}, or ManiSkill's own")
    _check_robot(robot_uids)
    try:
        if not isinstance(obs_mode, str):
            raise AssertionError("an observation mode is a word")
        parse_obs_mode_to_struct(obs_mode)
    except AssertionError as error:
        raise ConfigError(f"there is no mode {obs_mode!r}", "obs_mode", _OBS_MODES) from error
    reward_mode = options.get("reward_mode")
    if reward_mode not in (None, *REWARD_MODES):
        raise ConfigError(f"there is no {reward_mode!r}", "reward_mode", f"use {', '.join(REWARD_MODES)}")
    _check_backend(options.get("sim_backend", "auto"), num_envs)


def choose_renderer(render_backend: str | None, obs_mode: str, render_mode: str | None) -> str:
    """The device that draws, by ManiSkill's names; ``auto`` is "none" where nothing is to be drawn.

    Raises
    ------
    ConfigError
        When there is no such device, or none for observations that are drawn.
    """
    drawn = obs_mode not in ("state", "state_dict", "none")
    if render_backend == "auto":
        return "none" if not drawn and render_mode is None else "gpu" if torch.cuda.is_available() else "cpu"
    name = "none" if render_backend is None else render_backend
    if name.partition(":")[0] not in ("none", "pci", *render_backend_name_mapping):
        raise ConfigError(f"there is no {name!r}", "render_backend", "use auto, cpu, gpu or none")
    if name == "none" and drawn:
        raise ConfigError("draws nothing", f"render_backend: {name}", "use auto, or obs_mode='state'")
    return name


def _check_robot(robot_uids: Any) -> None:
    """Refuse robots that do not do the task, and those whose files are not here."""
    if not isinstance(robot_uids, str) or robot_uids not in (*ROBOTS, NO_ROBOT):
        raise ConfigError(
            f"{robot_uids!r} does not do this task", "robot_uids", f"use {', '.join(ROBOTS)}, or {NO_ROBOT}"
        )
    lacking = lacking_files(robot_uids)
    if lacking:
        raise ConfigError(
            f"the files of {robot_uids!r} are not in {ASSET_DIR}",
            "robot_uids",
            f"python -m mani_skill.utils.download_asset {' '.join(lacking)}",
        )


def lacking_files(robot_uids: str) -> list[str]:
    """What ManiSkill has to download before it can load a robot, by the names of its ``download_asset``."""
    needed = [] if robot_uids == NO_ROBOT else REGISTERED_AGENTS[robot_uids].asset_download_ids
    return [name for name in needed if not assets.is_data_source_downloaded(name)]


def _check_backend(sim_backend: str, num_envs: int) -> None:
    """Refuse backends that there are not, or not on this machine, and batches on the CPU."""
    name = sim_backend.partition(":")[0]  # cuda:1 is a device
    if name not in ("auto", *sim_backend_name_mapping):
        raise ConfigError(f"there is no {sim_backend!r}", "sim_backend", "use auto, cpu or gpu")
    cuda, on_cpu = torch.cuda.is_available(), name in CPU_SIM_BACKENDS
    if not (cuda or on_cpu or name == "auto"):
        raise ConfigError(
            f"{sim_backend!r} needs a CUDA device, and PyTorch finds none", "sim_backend", "use cpu, or auto"
        )
    if num_envs > 1 and (on_cpu or not cuda):
        raise ConfigError(
            f"PhysX simulates {num_envs} sub-scenes on a CUDA device only",
            "num_envs",
            "use 1 here, and processes for more: gymnasium.vector.AsyncVectorEnv over ManiSkill's CPUGymWrapper",
        )
