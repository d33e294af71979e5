"""The ManiSkill 3 task: a robot brings every joint of an articulated object to its goal."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import sapien
import torch
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.envs.utils.observations import parse_obs_mode_to_struct
from mani_skill.sensors.camera import CameraConfig
from mani_skill.utils.building.ground import build_ground
from mani_skill.utils.registration import REGISTERED_ENVS, register
from mani_skill.utils.structs import Pose
from scipy.spatial.transform import Rotation
from torch import Tensor

from artsim.camera import Camera
from artsim.envs.maniskill import ENV_ID, EPISODE_LENGTH
from artsim.envs.maniskill.build import OBJECT_BIT, build
from artsim.envs.maniskill.goal import BEST, LEAST_OPEN, Goal, dense_reward, start_and_goal
from artsim.envs.maniskill.mechanism import Mechanism
from artsim.envs.maniskill.places import ONLOOKER_FOV, ROBOTS, T_world_object, onlooker, robot_stand
from artsim.envs.maniskill.truth import Record, Truth, truth_of
from artsim.episode import Episode, EpisodeOptions, widest_state
from artsim.errors import ConfigError
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject
from artsim.renderers.sapien import import_sapien
from artsim.sampling import Scale, ViewOptions, sample_view

CAMERA = "base_camera"
"""The camera of the observations."""
_SEEDS = 2**31
_TRIES = 100  # objects drawn until one fits
# SAPIEN's camera looks along x with z up.
SAPIEN_FROM_CV = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
CV_FROM_SAPIEN = SAPIEN_FROM_CV.T


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
    views: ViewOptions = field(
        default_factory=lambda: ViewOptions(width=128, height=128, azimuth=(30.0, 75.0), elevation=(25.0, 55.0))
    )
    """Where the camera of the observations is."""
    max_joints: int = 16
    """Objects with more joints are passed over. Observations have as many rows, infos one more, for the root."""

    def __post_init__(self) -> None:
        if self.goal not in get_args(Goal):
            raise ConfigError(f"there is no goal {self.goal!r}", "goal", "use open, close or random")
        if not 0.0 < self.tolerance < LEAST_OPEN:
            raise ConfigError(f"{self.tolerance} is not within 0..{LEAST_OPEN}", "tolerance", "use 0.1")
        if self.max_joints < 1:
            raise ConfigError(f"{self.max_joints} is not a count", "max_joints", "use 1 or more")


class ArticulatedTask(BaseEnv):  # type: ignore[misc]  # ManiSkill has no types
    """Bring every joint of an articulated object to its goal.

    **Objects** are drawn when ManiSkill reconfigures: one for each sub-scene, procedural or of files. Alone
    (``num_envs=1``), that is at every reset; in batches only at the first, unless ``reconfiguration_freq`` says
    otherwise. An object stands on the ground, its front towards -x and towards the robot.

    **Observations** are those of ManiSkill's modes. ``state`` holds, for each of ``max_joints`` joints: where it is and
    how far it has to go (shares of its range), its speed, where its handle is from the gripper, in which direction it
    moves, and whether it counts. The other modes tell of joints only how far each has to go at first.

    The **info** is the ground truth, batched: the record of ``artsim/Articulated-v0`` (without what belongs to its
    cloud) with P = ``max_joints + 1`` rows, seen from ``base_camera``, and

    - ``T_world_object`` (B, 4, 4), ``T_world_part`` (B, P, 4, 4): ManiSkill's world; points of the mode ``pointcloud``
      are in it,
    - ``segmentation_id`` (B, P): what segmentation images call each part; -1 beyond an object's parts,
    - ``time`` (B,), ``joint_velocity`` (B, P), ``openness`` (B,),
    - ``joint_goal`` (B, P), ``joint_error`` (B, P): way left over the joint's range, ``joint_free`` (B, P): which
      count, ``handle``, ``handle_direction`` (B, P, 3): where to take hold of parts, and which way opening moves that,
    - ``success`` (B,): whether all of these are within ``tolerance``.

    **Reward**: :func:`artsim.envs.maniskill.goal.dense_reward`. Success ends an episode.

    Parameters
    ----------
    robot_uids : str
        "panda", "panda_wristcam" or "floating_panda_gripper".
    num_envs : int
        Sub-scenes; more than one need a CUDA device, as everywhere in ManiSkill.
    obs_mode : str
        state, state_dict, pointcloud, rgb+depth+segmentation, or any other of ManiSkill's.
    render_backend : str
        auto: none where nothing is drawn (states only, no ``render_mode``), else a GPU, else the CPU.
    **options
        Fields of :class:`TaskOptions`, and ManiSkill's own.

    Raises
    ------
    ConfigError, AssetError
        When an option makes no sense, or an object cannot be used.
    RenderError
        When something is to be drawn, and there is no device that can.
    """

    SUPPORTED_ROBOTS = tuple(ROBOTS)
    SUPPORTED_REWARD_MODES = ("normalized_dense", "dense", "sparse", "none")

    truth: Truth
    objects: tuple[ArticulatedObject, ...]
    """The object of each sub-scene."""

    def __init__(
        self,
        *args: Any,
        robot_uids: str = "panda",
        num_envs: int = 1,
        obs_mode: str = "state",
        reconfiguration_freq: int | None = None,
        render_backend: str = "auto",
        robot_init_qpos_noise: float = 0.02,
        **options: Any,
    ):
        own = {f.name for f in fields(TaskOptions)}
        self.options = TaskOptions(**{name: options.pop(name) for name in own & options.keys()})
        self.robot_init_qpos_noise = robot_init_qpos_noise
        self._source = Episode(
            EpisodeOptions(
                categories=self.options.categories,
                objects=self.options.objects,
                obj=self.options.obj,
                scale=self.options.scale,
            )
        )
        _check(robot_uids, num_envs, obs_mode, options)
        if render_backend == "auto":
            seen = obs_mode not in ("state", "state_dict", "none") or options.get("render_mode") is not None
            render_backend = "none" if not seen else "gpu" if torch.cuda.is_available() else "cpu"
        if render_backend != "none":
            import_sapien()  # tells what to do where nothing can be drawn
        super().__init__(
            *args,
            robot_uids=robot_uids,
            num_envs=num_envs,
            obs_mode=obs_mode,
            reconfiguration_freq=int(num_envs == 1) if reconfiguration_freq is None else reconfiguration_freq,
            render_backend=render_backend,
            **options,
        )

    def _load_agent(self, options: dict[str, Any]) -> None:
        super()._load_agent(options, sapien.Pose([-3.0, 0.0, 0.0]))

    def _load_scene(self, options: dict[str, Any]) -> None:
        rngs = [np.random.default_rng(int(seed)) for seed in self._batched_episode_rng.randint(_SEEDS)]
        self.objects = tuple(self._draw_object(rng) for rng in rngs)
        self.truth = truth_of(self.objects, self.options.max_joints, self.device)
        self._cameras = [_look(obj, self.options.views, rng) for obj, rng in zip(self.objects, rngs, strict=True)]
        ground = build_ground(self.scene)
        ground.set_collision_group_bit(group=2, bit_idx=OBJECT_BIT, bit=1)
        built = [build(self.scene, obj, number, self.options.gravity) for number, obj in enumerate(self.objects)]
        for each in built:
            self.remove_from_state_dict_registry(each.articulation)
        self.mechanism = Mechanism(self.scene, built, self.truth)
        self.add_to_state_dict_registry(self.mechanism.articulation)
        self._stands = torch.tensor(
            np.array([robot_stand(obj, self.robot_uids, self.options.goal) for obj in self.objects]),
            dtype=torch.float32,
            device=self.device,
        )
        self.goal = torch.zeros_like(self.truth.low)

    def _draw_object(self, rng: np.random.Generator) -> ArticulatedObject:
        """An object that has joints, and not too many."""
        least, most = 1, self.options.max_joints
        for _ in range(_TRIES):
            obj = self._source.draw_object(rng)
            if least <= len(obj.tree.free_joints) and len(obj) - 1 <= most:
                return obj
        raise ConfigError(
            f"has {len(obj) - 1} joints; {least} to {most} are asked for, and {_TRIES} draws gave no other object",
            f"{obj.category} {obj.object_id}",
            f"set max_joints={max(len(obj) - 1, least)}, or name other objects",
        )

    @property
    def _default_sensor_configs(self) -> list[CameraConfig]:
        first, views = self._cameras[0], self.options.views
        lens: dict[str, Any] = {"fov": float(np.deg2rad(views.fov))}
        if views.custom is not None:
            lens = {"intrinsic": np.stack([camera.K for camera in self._cameras])}
        pose = _poses([camera.T_world_camera for camera in self._cameras])
        return [CameraConfig(CAMERA, pose, first.width, first.height, near=0.01, far=100.0, **lens)]

    @property
    def _default_human_render_camera_configs(self) -> CameraConfig:
        pose = _poses(
            [onlooker(obj, stand) for obj, stand in zip(self.objects, self._stands.cpu().numpy(), strict=True)]
        )
        return CameraConfig(
            "render_camera", pose, 512, 512, fov=ONLOOKER_FOV, near=0.01, far=100.0, shader_pack="default"
        )

    def _after_reconfigure(self, options: dict[str, Any]) -> None:
        """What the camera of the observations is in the end: users may have changed it."""
        config = self._sensor_configs[CAMERA] if self.scene.can_render() else self._default_sensor_configs[0]
        count = self.num_envs
        T_world_camera = config.pose.to_transformation_matrix().to(self.device) @ _tensor(SAPIEN_FROM_CV, self.device)
        if config.intrinsic is not None:
            K = _tensor(config.intrinsic, self.device).reshape(-1, 3, 3)
        else:
            focal = 0.5 * config.height / np.tan(0.5 * config.fov)
            K = _tensor([[focal, 0, 0.5 * config.width], [0, focal, 0.5 * config.height], [0, 0, 1]], self.device)[None]
        size = torch.tensor([[config.width, config.height]], device=self.device).expand(count, 2)
        self._camera = {
            "K": K.expand(count, 3, 3),
            "T_world_camera": T_world_camera.expand(count, 4, 4),
            "width": size[:, 0],
            "height": size[:, 1],
        }
        self._T_camera_world = torch.linalg.inv(self._camera["T_world_camera"])

    def _initialize_episode(self, env_idx: Tensor, options: dict[str, Any]) -> None:
        rng, truth = self._batched_episode_rng[env_idx], self.truth
        draw = torch.zeros(2, *self.goal.shape, device=self.device)
        draw[:, env_idx] = _tensor(rng.random_sample((2, truth.rows)), self.device).transpose(0, 1)
        start, goal = start_and_goal(self.options.goal, truth, draw)
        self.goal[env_idx] = goal[env_idx]
        self.mechanism.set_state(start, env_idx)
        robot = self.agent.robot
        qpos = _tensor(ROBOTS[self.robot_uids], self.device)
        noise = rng.normal(0.0, self.robot_init_qpos_noise, len(qpos))
        noise[:, -2:] = 0.0  # fingers
        robot.set_qpos(qpos + _tensor(noise, self.device))
        robot.set_pose(Pose.create_from_pq(self._stands[env_idx]))

    def _after_simulation_step(self) -> None:
        self.mechanism.settle()

    def evaluate(self) -> Record:
        """The ground truth; see the class."""
        truth, T_world_part = self.truth, self.mechanism.T_world_part()
        q, speed = self.mechanism.state()
        error = truth.error(q, self.goal)
        posed = truth.posed(T_world_part, self._T_camera_world)
        handle, direction = truth.handles(posed["T_world_part"])
        return {
            **truth.fixed,
            **self._camera,
            **posed,
            "segmentation_id": self.mechanism.segmentation_id,
            "time": self.elapsed_steps * self.control_timestep,
            "joint_state": q,
            "joint_velocity": speed,
            "joint_goal": self.goal.clone(),
            "joint_error": error,
            "joint_free": truth.free,
            "openness": truth.openness(q),
            "handle": handle,
            "handle_direction": direction,
            "success": (error.abs() <= self.options.tolerance).all(1),
        }

    def _get_obs_extra(self, info: Record) -> Record:
        span = (self.truth.high - self.truth.low).clamp(min=1e-9)
        seen = {"tcp_pose": self.agent.tcp.pose.raw_pose, "goal": (self.goal - self.truth.low) / span}
        if self.obs_mode_struct.use_state:
            free = info["joint_free"]
            seen |= {
                "joint_free": free.float(),
                "joint_place": (info["joint_state"] - self.truth.low) / span,
                "joint_error": info["joint_error"],
                "joint_velocity": info["joint_velocity"],
                "tcp_to_handle": (info["handle"] - self.agent.tcp.pose.p[:, None]) * free[..., None],
                "handle_direction": info["handle_direction"] * free[..., None],
            }
        # The first row is the root's.
        return {name: value if name == "tcp_pose" else value[:, 1:].flatten(1) for name, value in seen.items()}

    def compute_dense_reward(self, obs: Any, action: Any, info: Record) -> Tensor:
        """(B,) see :func:`artsim.envs.maniskill.goal.dense_reward`."""
        distance = torch.linalg.vector_norm(info["handle"] - self.agent.tcp.pose.p[:, None], dim=-1)
        return dense_reward(info["joint_error"], info["joint_free"], self.options.tolerance, distance)

    def compute_normalized_dense_reward(self, obs: Any, action: Any, info: Record) -> Tensor:
        """(B,) within 0..1."""
        return self.compute_dense_reward(obs, action, info) / BEST

    def step(self, action: Any) -> Any:
        """One control step; see ManiSkill.

        Raises
        ------
        ConfigError
            When the action has another shape, or is not finite.
        """
        if action is not None and not isinstance(action, dict):
            given = torch.as_tensor(action)
            single = self.single_action_space.shape
            whole = (self.num_envs, *single)
            if (
                tuple(given.shape) not in ({single, whole} if self.num_envs == 1 else {whole})
                or not given.isfinite().all()
            ):
                raise ConfigError(
                    f"an action of shape {tuple(given.shape)} is not {self.num_envs} times {single[0]} finite numbers",
                    ENV_ID,
                    f"pass one of shape {whole}: control mode {self.control_mode} of {self.robot_uids}",
                )
        return super().step(action)


def _check(robot_uids: Any, num_envs: int, obs_mode: str, options: dict[str, Any]) -> None:
    """Refuse what ManiSkill would stumble on."""
    theirs = set(inspect.signature(BaseEnv.__init__).parameters) - {"self"}
    unknown = options.keys() - theirs
    if unknown:
        ours = ", ".join(f.name for f in fields(TaskOptions))
        raise ConfigError(f"there is no option {', '.join(sorted(unknown))}", ENV_ID, f"use {ours}, or ManiSkill's own")
    if robot_uids not in ROBOTS:
        raise ConfigError(f"{robot_uids!r} does not do this task", "robot_uids", f"use {', '.join(ROBOTS)}")
    try:
        if not isinstance(obs_mode, str):
            raise AssertionError("an observation mode is a word")
        parse_obs_mode_to_struct(obs_mode)
    except AssertionError as error:
        raise ConfigError(
            str(error), "obs_mode", "use state, state_dict, pointcloud, rgb+depth+segmentation or other textures"
        ) from error
    reward_mode = options.get("reward_mode")
    if reward_mode not in (None, *ArticulatedTask.SUPPORTED_REWARD_MODES):
        raise ConfigError(
            f"there is no {reward_mode!r}", "reward_mode", f"use {', '.join(ArticulatedTask.SUPPORTED_REWARD_MODES)}"
        )
    on_cpu = options.get("sim_backend", "auto") in ("cpu", "physx_cpu") or not torch.cuda.is_available()
    if num_envs > 1 and on_cpu:
        raise ConfigError(
            f"PhysX simulates {num_envs} sub-scenes on a CUDA device only",
            "num_envs",
            "use 1 here, and processes for more: gymnasium.vector.AsyncVectorEnv over ManiSkill's CPUGymWrapper",
        )


def _look(obj: ArticulatedObject, views: ViewOptions, rng: np.random.Generator) -> Camera:
    """A camera that sees the object wherever its joints are, in the world's frame."""
    camera = sample_view(obj, widest_state(obj), views, rng)
    return replace(camera, T_world_camera=T_world_object(obj) @ camera.T_world_camera)


def _poses(T_world_camera: Sequence[Array]) -> Pose:
    """ManiSkill's (B,) poses of cameras with OpenCV's axes."""
    T = np.stack(T_world_camera) @ CV_FROM_SAPIEN
    quaternion = Rotation.from_matrix(T[:, :3, :3]).as_quat()[:, [3, 0, 1, 2]]
    return Pose.create(torch.from_numpy(np.concatenate([T[:, :3, 3], quaternion], axis=1)).float())


def _tensor(values: Any, device: Any) -> Tensor:
    return torch.as_tensor(np.asarray(values), dtype=torch.float32, device=device)


if ENV_ID not in REGISTERED_ENVS:  # gymnasium knows it from artsim.envs
    register(ENV_ID, ArticulatedTask, max_episode_steps=EPISODE_LENGTH)
