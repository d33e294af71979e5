"""The ManiSkill task tells the truth: about poses, clouds, masks, goals and rewards."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import trimesh

import artsim.envs  # noqa: F401  # registers the task
from artsim.families import make
from artsim.model.camera import Camera
from artsim.model.draws import joint_intervals
from artsim.model.frame import BACKGROUND
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.capture import observe
from artsim.physics.episode import openness
from artsim.renderers import render
from tests.conftest import backend, installed, valve

torch = installed("torch")
installed("mani_skill")
from artsim.envs.maniskill.goal import BEST, dense_reward  # noqa: E402
from artsim.envs.maniskill.options import lacking_files  # noqa: E402
from artsim.envs.maniskill.robots import ROBOTS  # noqa: E402
from artsim.envs.maniskill.task import ArticulatedTask  # noqa: E402
from artsim.envs.maniskill.truth import truth_of  # noqa: E402

pytestmark = pytest.mark.slow

ID = "ArtSimArticulated-v1"
GRIPPER = "floating_panda_gripper"
ROBOTS_HERE = [robot for robot in ROBOTS if not lacking_files(robot)]
"""ManiSkill brings the files of these, or has downloaded them."""


def new(**options: Any) -> ArticulatedTask:
    env = gymnasium.make(ID, **{"robot_uids": GRIPPER, **options}).unwrapped
    assert isinstance(env, ArticulatedTask)
    return env


def of(info: dict[str, Any], name: str, parts: int | None = None) -> Any:
    """What an info says of the one object, in double precision."""
    array = info[name][0].numpy()
    array = array.astype(np.float64) if array.dtype == np.float32 else array
    return array if parts is None else array[:parts]


def camera_of(info: dict[str, Any]) -> Camera:
    width, height = int(info["width"][0]), int(info["height"][0])
    return Camera(of(info, "K"), width, height, of(info, "T_world_camera"))


# Poses, joints, dynamics


@pytest.mark.parametrize("category", ["valve", "robot_arm", "coffee_machine", "eyeglasses", "chair"])
def test_parts_are_where_forward_kinematics_puts_them(category: str) -> None:
    env = new(categories=(category,), goal="random")
    _, info = env.reset(seed=3)
    env.action_space.seed(0)
    for _ in range(5):
        obj = env.objects[0]
        parts = len(obj)
        assert_true(obj, info)
        assert not of(info, "part_valid")[parts:].any()
        assert all(not of(info, name)[parts:].any() for name in ("T_camera_part", "joint_state", "joint_axis_camera"))
        *_, info = env.step(env.action_space.sample())


def assert_true(obj: ArticulatedObject, info: dict[str, Any]) -> None:
    """The info is what artsim says of the object in the state that the info tells."""
    parts, camera = len(obj), camera_of(info)
    q = of(info, "joint_state", parts)
    assert np.allclose(q, obj.tree.complete_state(q), atol=1e-5)
    T_world_object = of(info, "T_world_object")
    T_world_part = T_world_object @ obj.tree.forward_kinematics(q)
    assert np.allclose(of(info, "T_world_part", parts), T_world_part, atol=1e-5)
    sample = observe(obj, q, camera, T_world_object, num_points=16)
    for name in ("T_camera_part", "joint_axis_camera", "joint_origin_camera"):
        assert np.allclose(of(info, name, parts), getattr(sample, name), atol=2e-5), name
    for name in ("box_center", "box_size", "joint_axis", "joint_origin", "joint_limits", "joint_rest", "joint_parent"):
        assert np.allclose(of(info, name, parts), getattr(sample, name), atol=1e-5), name
    assert of(info, "openness") == pytest.approx(openness(obj, q), abs=1e-5)


def test_real_objects_are_where_forward_kinematics_puts_them(partnet_dir: Path) -> None:
    files = sorted(partnet_dir.glob("*/*/mobility.urdf"))
    env = new(objects=tuple(files[::20]), goal="random", max_joints=60)
    seen = set()
    for seed in range(4):
        _, info = env.reset(seed=seed)
        assert_true(env.objects[0], info)
        seen.add(env.objects[0].object_id)
    assert len(seen) > 1


def test_a_pushed_screw_drives_its_thread() -> None:
    env = new(obj=valve(), goal="random")
    _, info = env.reset(seed=0)
    obj = env.objects[0]
    articulation = env.mechanism.articulation
    at = of(info, "joint_state", len(obj))
    for _ in range(10):
        push = np.zeros((1, articulation.max_dof), np.float32)
        push[0, env.mechanism._place[0, obj.tree.free_joints[1]]] = 0.01
        articulation.set_qf(push)
        *_, info = env.step(None)
        assert_true(obj, info)
    assert abs(of(info, "joint_state", len(obj)) - at)[obj.tree.free_joints[1]] > 0.05


def test_lids_stay_where_they_are_left_unless_gravity_pulls() -> None:
    def moved(**options: Any) -> float:
        env = new(obj=make("laptop", 0), goal="close", **options)
        _, before = env.reset(seed=0)
        for _ in range(20):
            *_, after = env.step(np.zeros(env.single_action_space.shape, np.float32))
        return float((after["joint_state"] - before["joint_state"]).abs().max())

    assert moved() < 1e-4
    assert moved(gravity=True) > 0.05  # against the friction of its hinge


# Goals and rewards


@pytest.mark.parametrize(("goal", "opens"), [("open", True), ("close", False)])
def test_goals_are_open_or_closed(goal: str, opens: bool) -> None:
    env = new(categories=("storage_furniture",), goal=goal)
    _, info = env.reset(seed=1)
    obj = env.objects[0]
    at, there = of(info, "joint_state", len(obj)), of(info, "joint_goal", len(obj))
    assert (openness(obj, there) > 0.4) == opens
    assert (openness(obj, at) > 0.4) != opens
    assert not of(info, "success")


@pytest.mark.parametrize("category", ["drawer", "laptop", "faucet", "valve"])
def test_the_reward_rises_on_the_way_to_the_goal(category: str) -> None:
    env = new(categories=(category,), goal="open", reward_mode="normalized_dense")
    _, info = env.reset(seed=2)
    start, goal = info["joint_state"], info["joint_goal"]
    rewards = []
    for share in np.linspace(0.0, 1.0, 21):
        env.mechanism.set_state(start + share * (goal - start), torch.tensor([0]))
        info = env.evaluate()
        rewards.append(float(env.compute_normalized_dense_reward(None, None, info)))
        assert bool(info["success"]) == (rewards[-1] == 1.0)
    assert np.all(np.diff(rewards) >= 0)
    assert 0.0 <= rewards[0] < 0.7
    assert rewards[-1] == 1.0


def test_a_gripper_near_the_handle_is_worth_more() -> None:
    error, free = torch.tensor([[0.0, 0.5, 0.02]]), torch.tensor([[False, True, True]])
    near = dense_reward(error, free, 0.1, torch.tensor([[0.0, 0.1, 9.0]]))
    far = dense_reward(error, free, 0.1, torch.tensor([[0.0, 0.4, 0.0]]))  # what has arrived draws no more
    assert float(near) > float(far)
    assert float(near) < BEST


@pytest.mark.parametrize("goal", ["open", "close", "random"])
@pytest.mark.parametrize("robot", ROBOTS_HERE)
def test_robots_begin_clear_of_the_object(robot: str, goal: str) -> None:
    for category in ("drawer", "laptop"):
        env = new(robot_uids=robot, categories=(category,), goal=goal, max_joints=1)
        _, before = env.reset(seed=0)
        for _ in range(3):
            *_, after = env.step(np.zeros(env.single_action_space.shape, np.float32))
        assert torch.allclose(before["joint_state"], after["joint_state"], atol=1e-4)


@pytest.mark.parametrize("robot", [robot for robot in ROBOTS_HERE if robot != GRIPPER])
def test_robots_stand_still_behind_their_reach(robot: str) -> None:
    """No shape of the robot is farther forward than it is said to be, and none in the ground or in another one."""
    env = new(robot_uids=robot, categories=("drawer",), robot_init_qpos_noise=0.0)
    env.reset(seed=0)
    robot_links = [link._objs[0] for link in env.agent.robot.links]
    boxes = np.array([link.compute_global_aabb_tight() for link in robot_links if link.collision_shapes])
    base = env.agent.robot.pose.p[0].numpy()
    start = ROBOTS[robot]
    assert start.reach - 0.02 < boxes[:, 1, 0].max() - base[0] <= start.reach
    assert abs(boxes[..., 1] - base[1]).max() <= start.room[1]
    assert base[2] - 0.01 < boxes[..., 2].min()
    env.step(np.zeros(env.single_action_space.shape, np.float32))
    still = env.agent.robot.qpos[0, : -start.fingers].numpy()
    assert np.allclose(still, start.qpos[: -start.fingers], atol=0.01)


def test_without_a_robot_lids_fall_and_handles_are_still_known() -> None:
    env = new(robot_uids="none", obj=make("laptop", 0), goal="close", gravity=True, obs_mode="state_dict")
    observation, before = env.reset(seed=0)
    assert set(observation["extra"]).isdisjoint(("tcp_pose", "tcp_to_handle"))
    assert env.action_space.shape == env.action_space.sample().shape == (0,)
    for action in (None, env.action_space.sample(), np.zeros((1, 0))):
        observation, reward, *_, after = env.step(action)
    assert not torch.allclose(before["joint_state"], after["joint_state"])
    assert torch.isfinite(reward).all()
    assert torch.isfinite(observation["extra"]["handle_direction"]).all()
    flat = env.get_state()
    env.step(None)
    env.set_state(flat)
    assert torch.allclose(env.get_state(), flat, atol=1e-5)


def test_success_ends_an_episode() -> None:
    env = new(categories=("drawer",), goal="close")
    env.reset(seed=0)
    env.mechanism.set_state(env.goal, torch.tensor([0]))
    _, reward, terminated, _, info = env.step(None)
    assert bool(terminated)
    assert bool(info["success"])
    assert float(reward) == 1.0


# What is seen


@pytest.fixture(scope="module")
def drawn() -> None:
    backend("sapien")


@pytest.mark.usefixtures("drawn")
def test_images_are_those_of_the_ray_caster() -> None:
    # Robots stand in the way of rays: what they hide is left out.
    env = new(
        categories=("storage_furniture",),
        goal="random",
        obs_mode="rgb+depth+segmentation",
        sensor_configs={"shader_pack": "default"},
    )
    observation, info = env.reset(seed=1)
    obj, images = env.objects[0], observation["sensor_data"]["base_camera"]
    frame = render(obj, of(info, "joint_state", len(obj)), camera_of(info), of(info, "T_world_object"))
    segmentation, depth = of(images, "segmentation")[..., 0], of(images, "depth")[..., 0]
    seen = part_ids(segmentation, info)
    robot = np.isin(segmentation, [int(link.per_scene_id[0]) for link in env.agent.robot.links])
    assert (seen == frame.part_ids)[~robot].mean() > 0.998
    both = (seen == frame.part_ids) & (seen != BACKGROUND) & ~robot
    assert both.sum() > 200
    # ManiSkill's depth is whole millimetres.
    assert np.median(abs(depth[both] / 1000 - frame.depth[both])) < 1e-3
    rgb = images["rgb"][0].numpy()
    assert rgb.shape == (*seen.shape, 3)
    assert rgb[both].std() > 0


def part_ids(segmentation: Any, info: dict[str, Any]) -> Any:
    """Part of each pixel or point."""
    ids = np.full(segmentation.shape, BACKGROUND, np.uint8)
    for k, number in enumerate(of(info, "segmentation_id")):
        if number >= 0:
            ids[segmentation == number] = k
    return ids


@pytest.mark.usefixtures("drawn")
def test_clouds_lie_on_the_posed_parts() -> None:
    env = new(categories=("storage_furniture",), goal="random", obs_mode="pointcloud")
    env.reset(seed=0)
    env.action_space.seed(0)
    observation, _, _, _, info = env.step(env.action_space.sample())
    obj, cloud = env.objects[0], observation["pointcloud"]
    part, points = part_ids(of(cloud, "segmentation")[:, 0], info), of(cloud, "xyzw")[:, :3]
    for k in np.unique(part[part != BACKGROUND]):
        own = transform_points(invert_transform(of(info, "T_world_part")[k]), points[part == k])
        away = trimesh.proximity.closest_point(obj.part_mesh(int(k)), own[:100])[1]
        assert np.median(away) < 2e-3, obj.parts[k].name
    assert len(np.unique(part)) > 2


@pytest.mark.usefixtures("drawn")
def test_the_camera_can_be_changed_as_in_other_tasks() -> None:
    env = new(
        categories=("laptop",), obs_mode="depth", sensor_configs={"width": 48, "height": 32}, render_mode="rgb_array"
    )
    observation, info = env.reset(seed=0)
    assert observation["sensor_data"]["base_camera"]["depth"].shape == (1, 32, 48, 1)
    params = observation["sensor_param"]["base_camera"]
    assert np.allclose(of(info, "K"), of(params, "intrinsic_cv"), atol=1e-4)
    extrinsic = np.vstack([of(params, "extrinsic_cv"), [0, 0, 0, 1]])
    assert np.allclose(extrinsic @ of(info, "T_world_camera"), np.eye(4), atol=1e-5)
    assert env.render().shape == (1, 512, 512, 3)


@pytest.mark.usefixtures("drawn")
def test_other_pictures_of_the_process_stay_as_they_were() -> None:
    obj = make("laptop", 0)
    camera = Camera.look_at((-1, 0.2, 0.6), (0, 0, 0), 64, 48)
    before = render(obj, obj.tree.rest, camera, renderer="sapien")
    env = new(categories=("laptop",), obs_mode="pointcloud")
    env.reset(seed=0)
    other = make("door", 0)
    after = render(obj, obj.tree.rest, camera, renderer="sapien")
    assert np.array_equal(before.depth, after.depth)
    fresh = render(other, other.tree.rest, Camera.look_at((-3, 0.2, 0.6), (0, 0, 0), 64, 48), renderer="sapien")
    assert (fresh.depth > 0).any()
    assert fresh.rgb is not None
    assert fresh.rgb.std() > 1


# Batches


def test_objects_of_many_sizes_share_tensors() -> None:
    objects = [make("chair", 0), make("drawer", 0), valve()]
    truth = truth_of(objects, 16, "cpu")
    rng = np.random.default_rng(0)
    states = [obj.tree.complete_state(rng.uniform(*np.clip(joint_intervals(obj), -9, 9).T)) for obj in objects]
    q = torch.zeros(3, 17)
    T = torch.eye(4).repeat(3, 17, 1, 1)
    for i, (obj, state) in enumerate(zip(objects, states, strict=True)):
        q[i, : len(obj)] = torch.from_numpy(state)
        T[i, : len(obj)] = torch.from_numpy(obj.tree.forward_kinematics(state))
    assert torch.allclose(truth.complete_state(q), q, atol=1e-5)
    camera = Camera.look_at((-2, 1, 1), (0, 0, 0))
    posed = truth.posed(T, torch.from_numpy(camera.T_camera_world).float().repeat(3, 1, 1))
    for i, (obj, state) in enumerate(zip(objects, states, strict=True)):
        parts = len(obj)
        expected = camera.T_camera_world @ obj.tree.forward_kinematics(state)
        axis, origin = obj.tree.posed_joints(expected)
        assert np.allclose(posed["T_camera_part"][i, :parts], expected, atol=1e-5)
        assert np.allclose(posed["joint_axis_camera"][i, :parts], axis, atol=1e-5)
        assert np.allclose(posed["joint_origin_camera"][i, :parts], origin, atol=1e-5)
        assert not posed["T_camera_part"][i, parts:].any()
        assert int(truth.fixed["part_valid"][i].sum()) == parts
        assert float(truth.openness(q)[i]) == pytest.approx(openness(obj, state), abs=1e-5)


@pytest.mark.parametrize("category", ["drawer", "laptop", "door", "valve"])
def test_handles_move_as_they_are_said_to(category: str) -> None:
    obj = make(category, 0)
    truth = truth_of([obj], len(obj) - 1, "cpu")
    for k in obj.tree.free_joints:
        low, high = joint_intervals(obj)[k]
        q, step = obj.tree.rest.copy(), 1e-3 * (high - low)
        q[k] = 0.5 * (low + high)
        first, direction = truth.handles(torch.from_numpy(obj.tree.forward_kinematics(q))[None].float())
        q[k] += step
        second, _ = truth.handles(torch.from_numpy(obj.tree.forward_kinematics(q))[None].float())
        way = (second - first)[0, k]
        assert float(way @ direction[0, k]) > 0.9 * float(way.norm()) > 0


# Seeds, and ManiSkill's own wrappers


def test_equal_seeds_make_equal_episodes() -> None:
    def episode(env: ArticulatedTask, seed: int | None) -> list[Any]:
        seen = [env.reset(seed=seed)]
        env.action_space.seed(3)
        return [env.objects[0].object_id, *seen, *(env.step(env.action_space.sample()) for _ in range(4))]

    one, other = (new(categories=("laptop", "drawer"), goal="random") for _ in range(2))
    other.reset(seed=1)  # whatever came before does not matter
    first, again, further = episode(one, 7), episode(other, 7), episode(one, None)
    assert first[0] == again[0] != further[0]
    for (seen, *_, info), (seen_again, *_, info_again) in zip(first[1:], again[1:], strict=True):
        assert torch.equal(seen, seen_again)
        assert all(torch.equal(info[name], info_again[name]) for name in info if name != "reconfigure")


def test_objects_with_too_many_joints_are_passed_over() -> None:
    env = new(categories=("drawer", "chair"), max_joints=1)
    for seed in range(4):
        observation, _ = env.reset(seed=seed)
        assert len(env.objects[0]) == 2
        assert observation.shape == env.observation_space.shape


def test_objects_change_as_often_as_asked() -> None:
    often, never = new(categories=("laptop",)), new(categories=("laptop",), reconfiguration_freq=0)
    assert len({often.reset(seed=seed)[1]["diagonal"].item() for seed in range(3)}) == 3
    assert len({never.reset(seed=seed)[1]["diagonal"].item() for seed in range(3)}) == 1


def test_states_can_be_kept_and_restored() -> None:
    env = new(categories=("drawer",), goal="random")
    _, info = env.reset(seed=0)
    kept, flat = env.get_state_dict(), env.get_state()
    env.action_space.seed(0)
    for _ in range(3):
        env.step(env.action_space.sample())
    assert not torch.equal(env.get_state(), flat)
    for restore, state in ((env.set_state_dict, kept), (env.set_state, flat)):
        restore(state)
        assert torch.allclose(env.get_state(), flat, atol=1e-5)
        assert torch.allclose(env.evaluate()["T_world_part"], info["T_world_part"], atol=1e-5)


def test_numpy_wrappers_take_the_info_apart() -> None:
    from mani_skill.utils.wrappers.gymnasium import CPUGymWrapper

    env = CPUGymWrapper(gymnasium.make(ID, robot_uids=GRIPPER, categories=("laptop",), max_episode_steps=3))
    observation, info = env.reset(seed=0)
    assert observation.dtype == np.float32
    assert observation.shape == env.observation_space.shape
    assert info["T_camera_part"].shape == (17, 4, 4)
    overs = [env.step(env.action_space.sample())[3] for _ in range(3)]
    assert overs == [False, False, True]


def test_a_panda_does_the_task_too() -> None:
    env = new(robot_uids="panda", obj=make("drawer", 0), control_mode="pd_ee_delta_pose")
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(5):
        observation, reward, *_ = env.step(env.action_space.sample())
    assert torch.isfinite(observation).all()
    assert 0 < float(reward) < 1
