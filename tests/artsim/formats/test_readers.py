"""What the readers that people use find in converted datasets is what the samples say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import trimesh
import webdataset
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from pycocotools import mask as coco_mask
from pycocotools.coco import COCO

import artsim
from artsim import Dataset
from artsim.common.palette import PALETTE
from artsim.datasets.shards import sample_key
from artsim.formats.coco import run_lengths
from artsim.formats.conversion import convert
from artsim.formats.webdataset import decode_values


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_webdataset_reads_shards_of_the_asked_size_with_plain_keys(imaged: Dataset, tmp_path: Path) -> None:
    convert(imaged, "webdataset", tmp_path, group=5, progress=False)
    shards = sorted(map(str, tmp_path.glob("*.tar")))
    samples = {sample.index: sample for sample in imaged}
    assert len(shards) == sum(-(-len(artsim.open_dataset(imaged.folder, s)) // 5) for s in ("train", "test"))
    found = list(webdataset.WebDataset(shards, shardshuffle=False).decode(decode_values, "rgb8"))
    assert sorted(int(entry["__key__"]) for entry in found) == sorted(samples)
    for entry in found:
        sample, record = samples[int(entry["__key__"])], entry["json"]
        assert np.array_equal(entry["points.npy"], sample.points)
        assert np.array_equal(entry["part.npy"], sample.part)
        assert np.array_equal(entry["npcs.npy"], sample.npcs)
        assert np.array_equal(entry["rgb.png"], sample.rgb)
        assert np.array_equal(entry["mask.png"], sample.part_mask)
        assert np.array_equal(record["T_camera_part"], sample.T_camera_part)
        depth = entry["depth.png"]
        assert np.array_equal(depth > 0, sample.depth > 0)
        assert np.abs(depth * record["depth_unit"] - sample.depth).max() <= 0.5001 * record["depth_unit"]
        assert record["depth_unit"] <= 1e-4  # these objects are seen from less than 6.5 m


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_pycocotools_finds_every_part_that_is_seen(imaged: Dataset, tmp_path: Path) -> None:
    convert(imaged, "coco", tmp_path, progress=False)
    for split in ("train", "test"):
        coco = COCO(tmp_path / "annotations" / f"instances_{split}.json")
        samples = {sample.index: sample for sample in artsim.open_dataset(imaged.folder, split)}
        assert set(coco.imgs) == set(samples)
        assert len({a["id"] for a in coco.anns.values()}) == len(coco.anns)
        for index, sample in samples.items():
            picture = Image.open(tmp_path / "images" / split / coco.imgs[index]["file_name"])
            assert np.array_equal(np.asarray(picture), sample.rgb)
            seen = coco.loadAnns(coco.getAnnIds(index))
            assert [a["part"] for a in seen] == [
                k for k in range(len(sample.joint_type)) if (sample.part_mask == k).any()
            ]
            for annotation in seen:
                mask = sample.part_mask == annotation["part"]
                assert np.array_equal(coco.annToMask(annotation), mask)
                assert annotation["area"] == mask.sum()
                assert annotation["bbox"] == coco_mask.toBbox(annotation["segmentation"]).tolist()
                category = coco.cats[annotation["category_id"]]
                assert category["name"] == f"{sample.category}/{sample.part_names[annotation['part']]}"


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_pictures_without_colour_show_what_is_near_as_bright(exact: Dataset, tmp_path: Path) -> None:
    convert(exact, "coco", tmp_path, progress=False)
    for sample in exact:
        picture = np.asarray(Image.open(tmp_path / "images" / "train" / f"{sample_key(sample.index)}.png"))
        seen = sample.depth > 0
        assert np.array_equal(picture > 0, seen)
        order = np.argsort(sample.depth[seen], kind="stable")
        assert (np.diff(picture[seen][order].astype(int)) <= 0).all()
        assert picture.max() == 255


@given(arrays(bool, st.tuples(st.integers(1, 40), st.integers(1, 40))))
def test_run_lengths_are_those_of_pycocotools(mask: np.ndarray) -> None:
    assert run_lengths(mask) == coco_mask.encode(np.asfortranarray(mask, np.uint8))["counts"].decode()


def test_run_lengths_of_long_and_short_runs_are_those_of_pycocotools() -> None:
    mask = np.zeros((700, 900), bool)
    mask[100:600, 5:700] = mask[3, :] = True
    mask[300:310, 200:400:3] = False
    assert run_lengths(mask) == coco_mask.encode(np.asfortranarray(mask, np.uint8))["counts"].decode()


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_h5py_reads_images_and_the_camera(imaged: Dataset, tmp_path: Path) -> None:
    convert(imaged, "hdf5", tmp_path, progress=False)
    for split in ("train", "test"):
        for sample in artsim.open_dataset(imaged.folder, split):
            with h5py.File(tmp_path / split / f"{sample_key(sample.index)}.hdf5") as file:
                images = {
                    key: np.asarray(file[key]) for key in ("colors", "depth", "instance_segmaps", "category_id_segmaps")
                }
                instances, camera, record = (
                    json.loads(file[key][()]) for key in ("instance_attribute_maps", "camera_pose", "artsim")
                )
            assert np.array_equal(images["colors"], sample.rgb)
            assert np.array_equal(images["depth"], sample.depth)
            seen = sample.part_mask != 255
            assert np.array_equal(images["instance_segmaps"] - 1, np.where(seen, sample.part_mask, 255))
            assert np.array_equal(images["category_id_segmaps"] > 0, seen)
            assert set(np.unique(images["category_id_segmaps"][seen])) == {instances[1]["category_id"]}
            assert [i["name"] for i in instances] == ["background", *sample.part_names]
            T_camera_world = np.eye(4)
            T_camera_world[:3, :3] = np.reshape(camera["cam_R_w2c"], (3, 3))
            T_camera_world[:3, 3] = camera["cam_t_w2c"]
            assert np.allclose(T_camera_world @ sample.T_world_camera, np.eye(4), atol=1e-12)
            assert np.array_equal(record["T_camera_part"], sample.T_camera_part)


@pytest.mark.slow
@pytest.mark.usefixtures("quick_workers")
def test_trimesh_reads_clouds_with_a_colour_for_each_part(imaged: Dataset, tmp_path: Path) -> None:
    convert(imaged, "ply", tmp_path, progress=False)
    sample = artsim.open_dataset(imaged.folder, "train")[0]
    path = tmp_path / "train" / f"{sample_key(sample.index)}.ply"
    cloud = trimesh.load(path)
    assert np.array_equal(cloud.vertices, sample.points)
    assert np.array_equal(cloud.colors[:, :3], PALETTE[sample.part])
    assert np.array_equal(cloud.metadata["_ply_raw"]["vertex"]["data"]["part"].ravel(), sample.part)
    assert sample.save_ply(tmp_path / "own.ply").read_bytes() == path.read_bytes()
    foreign = replace(sample, part=np.where(np.arange(len(sample.part)) < 9, 255, sample.part).astype(np.uint8))
    foreign.save_ply(tmp_path / "own.ply")
    assert np.array_equal(trimesh.load(tmp_path / "own.ply").colors[:9, :3], np.full((9, 3), 128))
