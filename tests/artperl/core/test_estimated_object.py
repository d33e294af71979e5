"""An estimate becomes an object that simulators load, with its parts where they were estimated."""

import json
from pathlib import Path

import numpy as np
import pytest

import artsim
from artperl.core.estimate import Estimate
from artperl.core.estimated_object import boxes_without, estimated_object, swept
from artsim.checks.validity import check_file
from artsim.errors import ConfigError
from artsim.making.assembly import prismatic, revolute
from artsim.model.draws import StateOptions, sample_state
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import compose_transform, rotation_about


def true_estimate(obj: ArticulatedObject, seed: int = 0) -> Estimate:
    """What a perfect method says of an object in a random state before a camera."""
    rng = np.random.default_rng(seed)
    q = sample_state(obj, StateOptions(), rng)
    T_camera_object = compose_transform(np.array([0.2, -0.1, 2.0]), rotation_about((1.0, 2.0, 3.0), 1.1))
    T = T_camera_object @ obj.tree.forward_kinematics(q)
    axes, origins = obj.tree.posed_joints(T)
    center = (T @ np.append(obj.box_center, np.ones((len(obj), 1)), axis=1)[..., None])[:, :3, 0]
    return Estimate(
        rotation=T[:, :3, :3], translation=center, size=obj.box_size, T_camera_part=T, state=q, joint_axis=axes,
        visibility=np.ones(len(obj)), joint_type=obj.tree.types, joint_parent=obj.tree.parents, joint_origin=origins,
        trajectory=T[None], part=np.zeros(0, np.int64), part_names=tuple(p.label for p in obj.parts),
        joint_limits=obj.tree.limits,
    )  # fmt: skip


def test_a_saved_estimate_says_what_the_estimate_says(tmp_path: Path) -> None:
    estimate = true_estimate(artsim.make("fan", 2))
    assert np.isinf(estimate.joint_limits).any()  # JSON has no word for it
    told = json.loads(estimate.save(tmp_path / "pose.json", ["seen at dusk"]).read_text(), parse_constant=pytest.fail)
    assert told == {**json.loads(json.dumps(estimate.to_dict())), "notes": ["seen at dusk"]}
    np.testing.assert_array_equal(told["T_camera_part"], estimate.T_camera_part)
    limits = np.where(np.isinf(estimate.joint_limits), None, estimate.joint_limits)
    assert told["joint_limits"] == limits.tolist()
    arrays = np.load(estimate.save(tmp_path / "pose.npz"))
    np.testing.assert_array_equal(arrays["joint_limits"], estimate.joint_limits)
    assert arrays["part_names"].tolist() == list(estimate.part_names)
    with pytest.raises(ConfigError, match=r"no \.json or \.npz"):
        estimate.save(tmp_path / "pose.txt")


@pytest.mark.parametrize("category", ["storage_furniture", "laptop", "refrigerator", "fan", "eyeglasses"])
def test_parts_stand_where_they_were_estimated_in_mujoco(category: str, tmp_path: Path) -> None:
    import mujoco

    estimate = true_estimate(artsim.make(category, 2))
    estimate.export(tmp_path, ("urdf", "mjcf"), category)
    obj, T_camera_object, q = estimated_object(estimate, category)
    notes = json.loads((tmp_path / "meta.json").read_text())["estimate"]
    np.testing.assert_allclose(notes["T_camera_object"], T_camera_object)
    np.testing.assert_allclose(notes["q"], q)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "mobility.xml"))
    data = mujoco.MjData(model)
    for name, value in obj.source_state(q).items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    for k, part in enumerate(obj.parts):
        body = data.body(part.name)
        local = obj.box_center[k] - (obj.tree.origins[k] if k else 0.0)
        center = T_camera_object @ np.append(body.xpos + body.xmat.reshape(3, 3) @ local, 1.0)
        opened = 0.5 * np.linalg.norm(obj.box_size[k] - estimate.size[k])  # by an opening through the box's side
        np.testing.assert_allclose(center[:3], estimate.translation[k], atol=opened + 1e-6)
        np.testing.assert_allclose(T_camera_object[:3, :3] @ body.xmat.reshape(3, 3), estimate.rotation[k], atol=1e-6)
    failed = {gate.name for gate in check_file(obj, tmp_path) if not gate.passed}
    # Boxes of siblings that pass each other meet; that of a fan's head encloses its neck.
    assert failed <= {"collision free", *(["joined parts apart"] if category == "fan" else [])}


def test_boxes_of_parts_do_not_overlap_at_rest() -> None:
    obj, _, _ = estimated_object(true_estimate(artsim.make("storage_furniture", 3)))
    rng = np.random.default_rng(0)
    points = rng.uniform(*obj.bounds, (4000, 3))
    pieces = [part.body.pieces for part in obj.parts if part.body is not None]
    inside = np.array(
        [np.any([((points > v.min(0)) & (points < v.max(0))).all(1) for v, _ in own], axis=0) for own in pieces]
    )
    assert inside.sum(axis=0).max() == 1
    assert inside.any(axis=0).mean() > 0.5


def test_what_is_left_of_a_box_is_the_box_without_the_others() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        others = [tuple(np.sort(rng.uniform(-0.5, 1.5, (2, 3)), axis=0)) for _ in range(rng.integers(1, 5))]
        left = boxes_without(np.zeros(3), np.ones(3), others, 0.0)  # type: ignore[arg-type]
        points = rng.random((500, 3))
        held = np.sum([((points > a) & (points < b)).all(1) for a, b in left], axis=0)
        taken = np.any([((points > a) & (points < b)).all(1) for a, b in others], axis=0)
        if not taken.all():
            np.testing.assert_array_equal(held, ~taken)


def test_a_box_without_size_is_refused() -> None:
    estimate = true_estimate(artsim.make("laptop", 0))
    estimate.size[1] = 0.0
    with pytest.raises(ConfigError, match="no size"):
        estimated_object(estimate)


@pytest.mark.parametrize("turns", [True, False])
def test_a_swept_box_holds_the_box_in_every_state(turns: bool) -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        low, high = np.sort(rng.uniform(-1.0, 1.0, (2, 3)), axis=0)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        make = revolute if turns else prismatic
        joint = make("root", tuple(axis), lower=-0.4, upper=1.9, origin=tuple(rng.uniform(-1, 1, 3)))
        boxes = swept((low, high), joint)
        for state in rng.uniform(-0.4, 1.9, 20):
            points = rng.uniform(low, high, (100, 3))
            moved = (points - joint.origin) @ rotation_about(axis, state).T + joint.origin
            moved = moved if turns else points + state * axis
            assert np.any([((moved > a - 0.004) & (moved < b + 0.004)).all(1) for a, b in boxes], axis=0).all()
