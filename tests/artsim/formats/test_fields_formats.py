"""Formats of the field, read by their specifications: what they say of objects, clouds and motions is true."""

from __future__ import annotations

import io
import json
import os
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

import artsim
from artsim import ArticulatedObject, Dataset
from artsim.errors import ArtsimError, AssetError, ConfigError
from artsim.formats import two_state
from artsim.formats.conversion import convert
from artsim.formats.huggingface import COLUMNS
from artsim.formats.lerobot import Recording, write_lerobot
from artsim.formats.op_align import read_op_align
from artsim.formats.particulate import particulate_npz
from artsim.model.transforms import transform_points
from tests.conftest import installed

pytestmark = pytest.mark.usefixtures("quick_workers")


def converted(dataset: Dataset, to: Any, out: Path) -> Path:
    return convert(dataset, to, out, workers=1, progress=False).folder


def objects(dataset: Dataset) -> dict[str, ArticulatedObject]:
    return {planned.key: dataset.objects[planned.file] for planned in dataset.plan.objects}


def turned(points: NDArray[Any], point: Any, axis: Any, angle: float) -> NDArray[Any]:
    """Points turned about a line."""
    return Rotation.from_rotvec(angle * np.asarray(axis)).apply(points - point) + point


def most_open(obj: ArticulatedObject) -> NDArray[Any]:
    """All joints at their upper limits."""
    return obj.tree.complete_state([np.pi if np.isinf(j.upper) else j.upper for j in obj.tree.joints])


@pytest.mark.parametrize(("category", "seed"), [("laptop", 0), ("drawer", 0), ("scissors", 1)])
def test_particulate_joints_move_its_points_as_the_object_moves(category: str, seed: int) -> None:
    obj = artsim.make(category, seed=seed)
    arrays = dict(np.load(io.BytesIO(particulate_npz(obj, 2000))))
    points, part = arrays["points"].astype(float), arrays["part_ids"]
    assert np.ptp(points, axis=0).max() == pytest.approx(1.0, abs=0.02)
    assert [tuple(row) for row in arrays["motion_hierarchy"]] == [(p, k) for k, p in enumerate(obj.tree.parents)][1:]
    moved = points.copy()
    for k in range(1, len(obj)):  # these objects have no chains
        if arrays["is_part_revolute"][k]:
            line = arrays["revolute_plucker"][k]
            foot = np.cross(line[3:], line[:3])  # the point of the axis nearest to the origin
            moved[part == k] = turned(points[part == k], foot, line[:3], arrays["revolute_range"][k, 1])
        if arrays["is_part_prismatic"][k]:
            moved[part == k] += arrays["prismatic_axis"][k] * arrays["prismatic_range"][k, 1]
    size, middle = (obj.bounds[1] - obj.bounds[0]).max(), obj.bounds.mean(axis=0)
    T = obj.tree.forward_kinematics(most_open(obj))
    true = transform_points(T[part], (points * size + middle)[:, None])[:, 0]
    np.testing.assert_allclose(moved * size + middle, true, atol=1e-6 * size)


def test_singapo_boxes_hold_their_meshes_and_joints_open_the_object(exact: Dataset, tmp_path: Path) -> None:
    out = converted(exact, "singapo", tmp_path / "out")
    splits = json.loads((out / "data_split.json").read_text())
    assert sorted(splits["train"]) == sorted(objects(exact))
    R = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]])  # up is y, the front is towards z
    names = set()
    for key, obj in objects(exact).items():
        document = json.loads((out / key / "object.json").read_text())
        nodes, scale = document["diffuse_tree"], document["meta"]["scale"]
        names |= {node["name"] for node in nodes}
        assert [node["id"] for node in nodes] == list(range(len(nodes)))
        assert all(node["id"] in nodes[node["parent"]]["children"] for node in nodes[1:])
        for node in nodes:
            mesh = trimesh.load(out / key / node["plys"][0], process=False)
            np.testing.assert_allclose(mesh.bounds.mean(axis=0), node["aabb"]["center"], atol=1e-6)
            np.testing.assert_allclose(np.ptp(mesh.bounds, axis=0), node["aabb"]["size"], atol=1e-6)
            k, joint = node["id"], node["joint"]
            if k and k < len(obj):
                q = most_open(obj)
                axis, way = np.array(joint["axis"]["direction"]), joint["range"][1]
                opened = {
                    "revolute": lambda p, a=axis, j=joint, w=way: turned(p, j["axis"]["origin"], a, np.deg2rad(w)),
                    "prismatic": lambda p, a=axis, w=way: p + a * w,
                }[joint["type"]](mesh.vertices)
                T = obj.tree.forward_kinematics(q)[k]
                true = transform_points(T, mesh.vertices @ R / scale) @ R.T * scale
                np.testing.assert_allclose(opened, true, atol=1e-5)
    assert {"base", "drawer", "handle"} <= names


def test_gapartnet_urdf_loads_as_the_object_and_its_boxes_lie_on_the_parts(exact: Dataset, tmp_path: Path) -> None:
    out, found = converted(exact, "gapartnet", tmp_path / "out"), set()
    for key, obj in objects(exact).items():
        loaded = artsim.load(out / key / "mobility_annotation_gapartnet.urdf")
        assert loaded.tree.types == obj.tree.types
        np.testing.assert_allclose(loaded.box_size, obj.box_size, atol=1e-6)
        np.testing.assert_allclose(np.ptp(loaded.tree.limits, axis=1), np.ptp(obj.tree.limits, axis=1), atol=1e-6)
        for link in json.loads((out / key / "link_annotation_gapartnet.json").read_text()):
            assert link["is_gapart"] == bool(link["category"]) == bool(link["bbox"])
            found.add(link["category"])
            if link["is_gapart"]:
                box = np.array(link["bbox"])
                mesh = trimesh.load(out / key / "textured_objs" / f"{link['link_name']}.obj", process=False)
                np.testing.assert_allclose([box.min(0), box.max(0)], mesh.bounds, atol=2e-3)
                out_of_part = box[0] - box[4]
                assert np.argmax(np.abs(out_of_part)) == (2 if link["category"].endswith("_lid") else 0)
                if link["category"] == "line_fixed_handle":
                    sides = [np.linalg.norm(box[1] - box[0]), np.linalg.norm(box[3] - box[0])]
                    assert sides[0] >= 2 * sides[1]
                    assert out_of_part[0] < 0  # the front is towards -x
    assert {"hinge_lid", "slider_drawer", "line_fixed_handle", ""} <= found


def test_op_align_has_the_cloud_the_parts_and_the_joints(exact: Dataset, tmp_path: Path) -> None:
    out = converted(exact, "op-align", tmp_path / "out")
    samples = {sample.index: sample for sample in exact}
    files = sorted(out.glob("*_output/train/*/*/input_2/*.npz"))  # as its loader looks for them
    assert len(files) == len(exact)
    for file in files:
        sample = samples[int(file.stem)]
        with np.load(file, allow_pickle=True) as archive:  # as its loader reads it; this test wrote the file
            record = archive["arr_0"].item()
        read = read_op_align(file)
        assert record.keys() == read.keys()
        assert all(np.array_equal(record[name], read[name]) for name in record)
        part = sample.part.astype(int)
        np.testing.assert_array_equal(read["segmentation"], part + 1)
        # In the frame of its part, a point lies within its part's box.
        pose = read["part"][part]
        local = np.einsum("nji,nj->ni", pose[:, :9].reshape(-1, 3, 3), read["pc"] - pose[:, 9:12])
        assert (np.abs(local) <= 0.5 * pose[:, 12:] + 1e-3 * sample.diagonal).all()
        np.testing.assert_allclose(read["joint"][:, 3:], sample.joint_axis_camera[1:])


class Harmful:
    def __reduce__(self) -> tuple[Any, ...]:
        return os.mkdir, ("harmed",)


class Huge:
    """An array of 8 TB in a file of 400 bytes."""

    def __init__(self, maker: Any, *words: Any):
        self.made = maker, words

    def __reduce__(self) -> tuple[Any, ...]:
        return self.made


HUGE = [Huge(np.ndarray, (10**12,)), Huge(np.zeros(0).__reduce__()[0], np.ndarray, (10**12,), b"b")]


@pytest.mark.parametrize("content", [*HUGE, Harmful(), {"pc": Harmful()}, {"pc": np.zeros((3, 3))}, [1, 2], "text"])
def test_op_align_files_run_nothing_and_lack_nothing(content: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    np.savez(tmp_path / "a.npz", np.array(content, dtype=object))
    with pytest.raises(AssetError, match="not a file of OP-Align"):
        read_op_align(tmp_path / "a.npz")
    assert not (tmp_path / "harmed").exists()


@pytest.mark.parametrize("damage", [b"", b"no archive", pickle.dumps({})])
def test_op_align_names_a_damaged_file(damage: bytes, tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(damage)
    with pytest.raises(AssetError, match=r"a\.npz"):
        read_op_align(tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("arr_0.npy", damage)
    with pytest.raises(AssetError, match=r"b\.npz"):
        read_op_align(tmp_path / "b.npz")


@pytest.mark.slow
def test_two_states_differ_by_the_joint_and_depth_lies_on_the_surface(
    exact: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(two_state, "VIEWS", {"train": 3, "val": 1, "test": 1})
    out = converted(exact, "two-state", tmp_path / "out")
    for key in objects(exact):
        folder = out / key
        told = json.loads((folder / "gt/trans.json").read_text())["trans_info"]
        axis, moved = told["axis"], told[told["type"]]
        before, after = (
            trimesh.load(folder / f"gt/{name}/{name}_dynamic_rotate.ply", process=False) for name in ("start", "end")
        )
        way = moved["r"] - moved["l"]
        opened = (
            turned(before.vertices, axis["o"], axis["d"], np.deg2rad(way))
            if told["type"] == "rotate"
            else before.vertices + np.array(axis["d"]) * way
        )
        np.testing.assert_allclose(opened, after.vertices, atol=1e-5)
        assert np.abs(opened - before.vertices).max() > 0.1
        still = [(folder / f"gt/{name}/{name}_static_rotate.ply").read_bytes() for name in ("start", "end")]
        assert still[0] == still[1]
        K, frames = np.loadtxt(folder / "cam_K.txt"), (folder / "init_keyframes.yml").read_text().split("frame_")[1:]
        for frame in frames:
            number, pose, time = frame[:4], frame.split("[")[1].split("]")[0], int(frame.split("time: ")[1])
            depth = np.asarray(Image.open(folder / f"depth_filtered/{number}.png")) / 1000.0
            colour = np.asarray(Image.open(folder / f"color_segmented/{number}.png"))
            seen = np.asarray(Image.open(folder / f"mask/{number}.png")) > 0
            assert ((depth > 0) == seen).all()
            assert colour[seen].any(axis=-1).mean() > 0.99
            assert not seen[[0, -1]].any()  # whole in the image
            assert not seen[:, [0, -1]].any()
            v, u = np.nonzero(seen)
            local = np.stack([(u - K[0, 2]) / K[0, 0], -(v - K[1, 2]) / K[1, 1], -np.ones(len(u))], 1)  # OpenGL's axes
            T = np.array(pose.split(","), float).reshape(4, 4)
            points = transform_points(T, local * depth[seen][:, None])[::197]
            name = ("start", "end")[time]
            surface = trimesh.load(folder / f"gt/{name}/{name}_rotate.ply", process=False)
            assert trimesh.proximity.closest_point(surface, points)[1].max() < 2e-3  # depth is in millimetres
        told = json.loads((folder / "end/camera_test.json").read_text())
        assert np.asarray(Image.open(folder / "end/test/0000.png")).shape == (400, 400, 4)
        assert np.array(told["0000"])[3].tolist() == [0.0, 0.0, 0.0, 1.0]


def test_hugging_face_columns_are_the_samples_and_digests_are_right(exact: Dataset, tmp_path: Path) -> None:
    parquet = installed("pyarrow.parquet")
    from artsim.common.files import file_sha256

    out = converted(exact, "huggingface", tmp_path / "out")
    rows = parquet.read_table(out / "data/train-000000.parquet").to_pylist()
    assert [row["index"] for row in rows] == [sample.index for sample in exact]
    for row, sample in zip(rows, exact, strict=True):
        for name, (kind, _) in COLUMNS.items():
            true = getattr(sample, name)
            if kind == "string":
                assert row[name] == (list(true) if isinstance(true, tuple) else true)
            else:
                np.testing.assert_array_equal(np.array(row[name], dtype=kind), true)
    described = json.loads((out / "croissant.json").read_text())
    for file in described["distribution"][:-1]:
        assert file_sha256(out / file["contentUrl"]) == file["sha256"]
    card = (out / "README.md").read_text()
    assert "path: data/train-*.parquet" in card.split("---")[1]


def test_lerobot_episodes_are_the_recordings(tmp_path: Path) -> None:
    parquet = installed("pyarrow.parquet")
    rng = np.random.default_rng(0)
    recordings = [
        Recording("open", rng.normal(size=(T, J)), rng.normal(size=(T, J)), rng.normal(size=(T, 5, 3)).astype("f4"))
        for T, J in ((4, 1), (3, 2))
    ]
    out = write_lerobot(tmp_path / "out", recordings, 20.0, joints=2, points=5)
    info = json.loads((out / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_frames"]) == ("v3.0", 20, 7)
    episodes = parquet.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    for episode, recording in zip(episodes, recordings, strict=True):
        place = {key: episode[f"data/{key}"] for key in ("chunk_index", "file_index")}
        frames = parquet.read_table(out / info["data_path"].format(**place)).to_pydict()
        assert set(frames) == set(info["features"])
        state, J = np.array(frames["observation.state"], "f4"), recording.state.shape[1]
        np.testing.assert_array_equal(state[:, :J], recording.state.astype("f4"))
        assert not state[:, J:].any()
        np.testing.assert_array_equal(np.array(frames["action"], "f4")[:-1], state[1:])
        np.testing.assert_array_equal(np.array(frames["observation.points"], "f4"), recording.points)
        assert frames["index"] == list(range(episode["dataset_from_index"], episode["dataset_to_index"]))
        np.testing.assert_allclose(frames["timestamp"], np.arange(len(state)) / 20, atol=1e-6)
    stats = json.loads((out / "meta/stats.json").read_text())
    first = np.concatenate([r.state[:, 0] for r in recordings]).astype("f4")
    assert stats["observation.state"]["mean"][0] == pytest.approx(first.mean(), abs=1e-6)
    with pytest.raises(ArtsimError, match="already holds something"):
        write_lerobot(out, recordings, 20.0, joints=2, points=5)
    with pytest.raises(ConfigError, match="whole number"):
        write_lerobot(tmp_path / "other", recordings, 12.5, joints=2, points=5)


@pytest.mark.slow
def test_motions_become_a_lerobot_dataset(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed("mujoco")
    parquet = installed("pyarrow.parquet")
    from artsim.commands.convert import Convert
    from artsim.physics import EpisodeOptions, open_motions, record

    record(tmp_path / "motions", EpisodeOptions(("laptop",), num_points=16), 1, 3, progress=False)
    Convert(path=tmp_path / "motions", to="lerobot", out=tmp_path / "out").run()
    (motion,) = open_motions(tmp_path / "motions")
    frames = parquet.read_table(tmp_path / "out/data/chunk-000/file-000.parquet").to_pydict()
    np.testing.assert_array_equal(np.array(frames["observation.state"], "f4"), motion.joint_state[:, 1].astype("f4"))
    np.testing.assert_array_equal(np.array(frames["observation.points"], "f4")[2], motion[2].points)
