"""The ManiSkill 3 task: a robot brings every joint of an articulated object to its goal."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import sapien
import torch
from gymnasium.envs.registration import EnvSpec
from gymnasium.spaces import Box
from gymnasium.vector.utils import batch_space
from mani_skill.agents.robots.fetch import FETCH_WHEELS_COLLISION_BIT
from mani_skill.envs.sapien_env import BaseEnv
from mani_skill.sensors.camera import CameraConfig
from mani_skill.utils.building.ground import build_ground
from mani_skill.utils.registration import REGISTERED_ENVS, register
from mani_skill.utils.structs import Pose
from mani_skill.utils.structs.types import GPUMemoryConfig, SimConfig
from torch import Tensor

from artsim.envs.maniskill import ENV_ID, EPISODE_LENGTH, RECORDED_ID
from artsim.envs.maniskill.build import OBJECT_BIT, build
from artsim.envs.maniskill.cameras import camera_record, look, poses
from artsim.envs.maniskill.goal import BEST, dense_reward
from artsim.envs.maniskill.mechanism import Mechanism
from artsim.envs.maniskill.options import REWARD_MODES, TaskOptions, check, choose_renderer
from artsim.envs.maniskill.places import ONLOOKER_FOV, onlooker, robot_start
from artsim.envs.maniskill.recorded import read_options, recorded_options
from artsim.envs.maniskill.robots import NO_ROBOT, ROBOTS
from artsim.envs.maniskill.truth import Record, Truth, start_and_goal, truth_of
from artsim.errors import ConfigError
from artsim.loading.painted import painted_coats
from artsim.model.appearance.finishes import draw_coats
from artsim.model.objects import ArticulatedObject
from artsim.physics.episode import Episode, EpisodeOptions
from artsim.renderers.sapien import import_sapien

CAMERA = "base_camera"
"""The camera of the observations."""
_SEEDS = 2**31
_TRIES = 100  # objects drawn until one fits


class ArticulatedTask(BaseEnv):  # type: ignore[misc]  # ManiSkill has no types
    """Bring every joint of an articulated object to its goal.

    **Objects** are drawn when ManiSkill reconfigures: one for each sub-scene, procedural or of files. Alone
    (``num_envs=1``), that is at every reset; in batches only at the first, unless ``reconfiguration_freq`` says
    otherwise. An object stands on the ground, its front towards -x and towards the robot. Its files tell how it looks;
    the looks of procedural objects are drawn.

    **Observations** are those of ManiSkill's modes. ``state`` holds, for each of ``max_joints`` joints: where it is and
    how far it has to go (shares of its range), its speed, where its handle is from the gripper, in which direction it
    moves, and whether it counts. The other modes tell only where each is to go (``goal``, shares of its range).

    The **info** is the ground truth, batched: the record of ``artsim/Articulated-v0`` (without its cloud and
    visible fractions) with P = ``max_joints + 1`` rows, seen from ``base_camera``, and

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
        "panda", "panda_wristcam", "floating_panda_gripper", "fetch", "xarm6_robotiq" (whose files ManiSkill
        downloads), or "none": actions are empty then, and nothing moves the object but gravity.
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

    SUPPORTED_ROBOTS = (*ROBOTS, NO_ROBOT)
    SUPPORTED_REWARD_MODES = REWARD_MODES

    truth: Truth
    objects: tuple[ArticulatedObject, ...]
    """The object of each sub-scene."""
    _spec: EnvSpec | None = None

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
        self.options = read_options({name: options.pop(name) for name in own & options.keys()})
        self.robot_init_qpos_noise = robot_init_qpos_noise
        self._source = Episode(
            EpisodeOptions(
                categories=self.options.categories,
                objects=self.options.objects,
                obj=self.options.obj,
                scale=self.options.scale,
            )
        )
        check(robot_uids, num_envs, obs_mode, options)
        render_backend = choose_renderer(render_backend, obs_mode, options.get("render_mode"))
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
        # Flat states are read by the names in here, which ManiSkill leaves out where there are no actors.
        self._init_raw_state.setdefault("actors", {})
        if self.agent is None:
            self.single_action_space = self._orig_single_action_space = Box(-1.0, 1.0, (0,))
            self.action_space = (
                batch_space(self.single_action_space, num_envs) if num_envs > 1 else self.single_action_space
            )

    @property
    def spec(self) -> EnvSpec | None:
        """What gymnasium made the environment of, as recordings keep it: the id names the module that registers it."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec) -> None:
        # ManiSkill's command line makes the environment of this id and these options, after a way through JSON.
        self._spec = replace(spec, id=RECORDED_ID, kwargs=recorded_options(spec.kwargs))

    @property
    def _default_sim_config(self) -> SimConfig:
        # Objects have many convex pieces.
        return SimConfig(gpu_memory_config=GPUMemoryConfig(max_rigid_contact_count=2**21, max_rigid_patch_count=2**19))

    def _load_agent(self, options: dict[str, Any]) -> None:
        super()._load_agent(options, sapien.Pose([-3.0, 0.0, 0.0]))

    @property
    def control_mode(self) -> str:
        """The robot's control mode; "none" where there is no robot."""
        return NO_ROBOT if self.agent is None else self.agent.control_mode

    def _load_scene(self, options: dict[str, Any]) -> None:
        rngs = [np.random.default_rng(int(seed)) for seed in self._batched_episode_rng.randint(_SEEDS)]
        self.objects = tuple(self._draw_object(rng) for rng in rngs)
        self.truth = truth_of(self.objects, self.options.max_joints, self.device)
        self._cameras = [look(obj, self.options.views, rng) for obj, rng in zip(self.objects, rngs, strict=True)]
        ground = build_ground(self.scene)
        for bit in (OBJECT_BIT, FETCH_WHEELS_COLLISION_BIT):  # the wheels reach below the ground
            ground.set_collision_group_bit(group=2, bit_idx=bit, bit=1)
        built = []
        for number, (obj, rng) in enumerate(zip(self.objects, rngs, strict=True)):
            coats = (painted_coats(obj) or draw_coats(obj, rng)) if self.scene.can_render() else ()
            built.append(
                build(self.scene, obj, coats, number, self.options.gravity, self.options.collision == "pieces")
            )
        for each in built:
            self.remove_from_state_dict_registry(each.articulation)
        self.mechanism = Mechanism(self.scene, built, self.truth)
        self.add_to_state_dict_registry(self.mechanism.articulation)
        self._stands, self._begins = torch.zeros(self.num_envs, 3, device=self.device), None
        if self.agent is not None:
            starts = [robot_start(obj, self.robot_uids, self.options.goal) for obj in self.objects]
            self._stands, self._begins = (_tensor(np.stack(each), self.device) for each in zip(*starts, strict=True))
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
        pose = poses([camera.T_world_camera for camera in self._cameras])
        return [CameraConfig(CAMERA, pose, first.width, first.height, near=0.01, far=100.0, **lens)]

    @property
    def _default_human_render_camera_configs(self) -> CameraConfig:
        pose = poses(
            [
                onlooker(obj, self.robot_uids, stand)
                for obj, stand in zip(self.objects, self._stands.cpu().numpy(), strict=True)
            ]
        )
        return CameraConfig(
            "render_camera", pose, 512, 512, fov=ONLOOKER_FOV, near=0.01, far=100.0, shader_pack="default"
        )

    def _after_reconfigure(self, options: dict[str, Any]) -> None:
        """What the camera of the observations is in the end: users may have changed it."""
        config = self._sensor_configs[CAMERA] if self.scene.can_render() else self._default_sensor_configs[0]
        self._camera = camera_record(config, self.num_envs, self.device)
        self._T_camera_world = torch.linalg.inv(self._camera["T_world_camera"])

    def _initialize_episode(self, env_idx: Tensor, options: dict[str, Any]) -> None:
        rng, truth = self._batched_episode_rng[env_idx], self.truth
        draw = torch.zeros(2, *self.goal.shape, device=self.device)
        draw[:, env_idx] = _tensor(rng.random_sample((2, truth.rows)), self.device).transpose(0, 1)
        start, goal = start_and_goal(self.options.goal, truth, draw)
        self.goal[env_idx] = goal[env_idx]
        self.mechanism.set_state(start, env_idx)
        if self._begins is None:
            return
        robot = self.agent.robot
        noise = rng.normal(0.0, self.robot_init_qpos_noise, self._begins.shape[1])
        noise[:, -ROBOTS[self.robot_uids].fingers :] = 0.0
        robot.set_qpos(self._begins[env_idx] + _tensor(noise, self.device))
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

    def _get_obs_agent(self) -> Any:
        return {} if self.agent is None else super()._get_obs_agent()

    def _get_obs_extra(self, info: Record) -> Record:
        span = (self.truth.high - self.truth.low).clamp(min=1e-9)
        seen = {} if self.agent is None else {"tcp_pose": self.agent.tcp.pose.raw_pose}
        seen["goal"] = (self.goal - self.truth.low) / span
        if self.obs_mode_struct.use_state:
            free = info["joint_free"]
            seen |= {
                "joint_free": free.float(),
                "joint_place": (info["joint_state"] - self.truth.low) / span,
                "joint_error": info["joint_error"],
                "joint_velocity": info["joint_velocity"],
            }
            if self.agent is not None:
                seen["tcp_to_handle"] = self._tcp_to_handle(info) * free[..., None]
            seen["handle_direction"] = info["handle_direction"] * free[..., None]
        # The first row is the root's.
        return {name: value if name == "tcp_pose" else value[:, 1:].flatten(1) for name, value in seen.items()}

    def _tcp_to_handle(self, info: Record) -> Tensor:
        """(B, P, 3) metres; infinite without a robot."""
        handle = info["handle"]
        return torch.full_like(handle, torch.inf) if self.agent is None else handle - self.agent.tcp.pose.p[:, None]

    def compute_dense_reward(self, obs: Any, action: Any, info: Record) -> Tensor:
        """(B,) see :func:`artsim.envs.maniskill.goal.dense_reward`."""
        distance = torch.linalg.vector_norm(self._tcp_to_handle(info), dim=-1)
        return dense_reward(info["joint_error"], info["joint_free"], self.options.tolerance, distance)

    def compute_normalized_dense_reward(self, obs: Any, action: Any, info: Record) -> Tensor:
        """(B,) within 0..1."""
        return self.compute_dense_reward(obs, action, info) / BEST

    def get_state_dict(self) -> dict[str, Any]:
        """ManiSkill's state of the simulation, with the goals (B, P) and the diagonals (B, 1) of the objects."""
        # ManiSkill asks the robot for its controllers' state.
        state = self.scene.get_sim_state() if self.agent is None else super().get_state_dict()
        return {**state, "goal": self.goal.clone(), "diagonal": self.truth.fixed["diagonal"][:, None].clone()}

    def set_state_dict(self, state: dict[str, Any], env_idx: Tensor | None = None) -> None:
        """Inverse of :meth:`get_state_dict`; goals stay as they are where the state tells of none, as flat ones do.

        Tensors or NumPy arrays, with or without the axis of sub-scenes where there is one: recordings have none.

        Raises
        ------
        ConfigError
            When the state is one of another object.
        """
        rows = slice(None) if env_idx is None else env_idx
        if "diagonal" in state:
            there = _tensor(state["diagonal"], self.device).reshape(-1)
            if not torch.allclose(there, self.truth.fixed["diagonal"][rows], rtol=1e-5):
                names = ", ".join(f"{obj.category} {obj.object_id}" for obj in self.objects[:3])
                raise ConfigError(
                    f"a state of another object than {names}",
                    "set_state_dict",
                    'begin the episode that it is of: reset(seed=..., options={"reconfigure": True})',
                )
        super().set_state_dict(state, env_idx)
        if "goal" in state:
            self.goal[rows] = _tensor(state["goal"], self.device)

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
        return super().step(None if self.agent is None else action)


def _tensor(values: Any, device: Any) -> Tensor:
    return torch.as_tensor(values, dtype=torch.float32, device=device)


if ENV_ID not in REGISTERED_ENVS:  # gymnasium knows it from artsim.envs
    register(ENV_ID, ArticulatedTask, max_episode_steps=EPISODE_LENGTH)
