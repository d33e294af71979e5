"""One mask, saved in every way that people save masks, shows the same object; depth images likewise."""

from __future__ import annotations

import json
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artperl.inputs import InputOptions, points_of_depth, read_cloud, read_points
from artperl.inputs.depth_images import read_depth
from artperl.inputs.masks import read_mask
from artsim.errors import ArtsimError, ConfigError

CASES = Path(__file__).parents[2] / "cases"
SHOWN = np.zeros((24, 32), dtype=bool)
SHOWN[6:18, 8:26] = True
SHOWN[6:10, 8:12] = False
K = np.array([[30.0, 0.0, 16.0], [0.0, 30.0, 12.0], [0.0, 0.0, 1.0]])


def _palette(image: np.ndarray, colours: list[int], **info: object) -> Image.Image:
    picture = Image.fromarray(image.astype(np.uint8), "P")
    picture.putpalette(colours)
    picture.info.update(info)
    return picture


def _pictures() -> dict[str, Image.Image]:
    byte = (SHOWN * 255).astype(np.uint8)
    opaque, colour = np.full_like(byte, 255), np.dstack([byte // 2, byte, byte // 3])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return {
            "l.png": Image.fromarray(byte), "one.png": Image.fromarray(SHOWN), "ones.png": Image.fromarray(byte // 255),
            "deep.png": Image.fromarray(byte.astype(np.uint16) * 200), "rgb.png": Image.fromarray(colour),
            "rgba.png": Image.fromarray(np.dstack([byte, byte, byte, opaque])),
            "la.png": Image.fromarray(np.dstack([byte, opaque])),
            "cutout.png": Image.fromarray(np.dstack([colour * 0 + 90, byte])),
            "alpha.png": Image.fromarray(np.dstack([colour * 0, byte])),
            "black_one.png": _palette(SHOWN, [0, 0, 0, 200, 0, 0]),
            "white_first.png": _palette(~SHOWN, [255, 255, 255, 0, 0, 0]),
            "no_black.png": _palette(SHOWN, [9, 9, 9, 200, 0, 0]),
            "gif.gif": Image.fromarray(byte), "bmp.bmp": Image.fromarray(byte), "pgm.pgm": Image.fromarray(byte),
            "float.tif": Image.fromarray(SHOWN.astype(np.float32)), "jpeg.jpg": Image.fromarray(byte),
            "colour.jpg": Image.fromarray(np.dstack([byte, byte, byte])),
        }  # fmt: skip


@pytest.mark.parametrize("name", sorted(_pictures()))
@pytest.mark.filterwarnings("error")
def test_every_kind_of_picture_shows_the_same_object(name: str, tmp_path: Path) -> None:
    _pictures()[name].save(tmp_path / name)
    mask = read_mask(tmp_path / name)
    np.testing.assert_array_equal(mask.shown, SHOWN)
    assert mask.warnings == ()


@pytest.mark.parametrize(
    "array",
    [SHOWN, SHOWN.astype(np.int64) * 7, SHOWN[..., None], SHOWN[None], np.where(SHOWN, 0.9, 0.2),
     np.where(SHOWN, 1.0, np.nan)],
)  # fmt: skip
@pytest.mark.filterwarnings("error")
def test_arrays_are_masks(array: np.ndarray, tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", array)
    np.savez(tmp_path / "m.npz", mask=array, other=np.zeros(3))
    for name in ("m.npy", "m.npz"):
        np.testing.assert_array_equal(read_mask(tmp_path / name).shown, SHOWN)


def test_one_of_several_objects_is_chosen_by_its_number_or_colour(tmp_path: Path) -> None:
    ids = np.where(SHOWN, 3, 0).astype(np.uint8)
    ids[:4] = 1
    colours = [0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 128, 0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        _palette(ids, colours).save(tmp_path / "p.png")
    Image.fromarray(ids).save(tmp_path / "l.png")
    Image.fromarray(ids.astype(np.uint16)).save(tmp_path / "deep.png")
    Image.fromarray(np.array(colours, np.uint8).reshape(-1, 3)[ids]).save(tmp_path / "rgb.png")
    np.save(tmp_path / "stack.npy", np.stack([ids == n for n in range(5)]))
    chosen = {"p.png": "3", "l.png": "3", "deep.png": "3", "rgb.png": "255,128,0", "stack.npy": "3"}
    for name, number in chosen.items():
        np.testing.assert_array_equal(read_mask(tmp_path / name, number).shown, SHOWN)
    np.testing.assert_array_equal(read_mask(tmp_path / "rgb.png", "#ff8000").shown, SHOWN)
    np.testing.assert_array_equal(read_mask(tmp_path / "p.png", "255, 128, 0").shown, SHOWN)
    for name in ("p.png", "l.png", "deep.png", "rgb.png"):  # nothing is chosen: all are taken, and that is said
        mask = read_mask(tmp_path / name)
        np.testing.assert_array_equal(mask.shown, ids != 0)
        assert "--mask-id" in mask.warnings[0]
    for name, wrong in (("l.png", "2"), ("rgb.png", "1,2,3"), ("l.png", "red"), ("rgb.png", "red"), ("stack.npy", "9")):
        with pytest.raises(ConfigError):
            read_mask(tmp_path / name, wrong)
    with pytest.raises(ConfigError, match="stack of 5"):
        read_mask(tmp_path / "stack.npy")


def test_part_masks_of_artsim_are_recognised(tmp_path: Path) -> None:
    parts = np.where(SHOWN, 1, 255).astype(np.uint8)
    parts[8:12, 10:20][SHOWN[8:12, 10:20]] = 0
    Image.fromarray(parts).save(tmp_path / "any_name.png")
    mask = read_mask(tmp_path / "any_name.png")
    np.testing.assert_array_equal(mask.shown, SHOWN)
    assert "part mask of artsim" in mask.notes[0]
    np.testing.assert_array_equal(read_mask(tmp_path / "any_name.png", kind="binary").shown, parts != 0)
    base = np.where(SHOWN, 0, 255).astype(np.uint8)  # only the root shows: its name tells, or the user
    Image.fromarray(base).save(tmp_path / "000007.part_mask.png")
    Image.fromarray(base).save(tmp_path / "base.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "000007.part_mask.png").shown, SHOWN)
    np.testing.assert_array_equal(read_mask(tmp_path / "base.png", kind="parts").shown, SHOWN)
    doubtful = read_mask(tmp_path / "base.png")
    np.testing.assert_array_equal(doubtful.shown, ~SHOWN)
    assert "--mask-kind parts" in doubtful.warnings[0]
    voc = np.where(SHOWN, 1, 0).astype(np.uint8)  # 255 is no background where it is a thin line
    voc[12, 8:26] = 255
    Image.fromarray(voc).save(tmp_path / "voc.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "voc.png").shown, SHOWN)
    Image.fromarray(parts).save(tmp_path / "instance_ids.png")
    with pytest.raises(ConfigError, match="--mask-id"):
        read_mask(tmp_path / "instance_ids.png")
    np.testing.assert_array_equal(read_mask(tmp_path / "instance_ids.png", "0").shown, parts == 0)


def test_a_mask_of_another_size_names_both(tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.ones((24, 32)))
    np.save(tmp_path / "K.npy", K - [[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    Image.fromarray(np.ones((48, 64), np.uint8)).save(tmp_path / "mask.png")
    with pytest.raises(ConfigError, match=r"64 x 48 pixels does not fit a depth image of 32 x 24.*resize"):
        read_points(tmp_path / "depth.npy", tmp_path / "mask.png", tmp_path / "K.npy")
    with pytest.raises(ArtsimError, match=r"64 x 48 pixels does not fit a depth image of 32 x 24"):
        points_of_depth(np.ones((24, 32)), K, np.ones((48, 64)))


@pytest.mark.filterwarnings("error")
def test_one_depth_image_in_every_file(tmp_path: Path) -> None:
    millimetres = np.full((24, 32), 800, np.uint16)
    millimetres[:, ::2] = 1200
    metres = millimetres * 0.001
    lost = np.where(SHOWN, metres, np.inf)
    lost[0, 0] = np.nan
    (tmp_path / "cam.json").write_text(json.dumps({"K": K.tolist()}))
    Image.fromarray(millimetres).save(tmp_path / "d.png")
    Image.fromarray(millimetres).save(tmp_path / "d.pgm")
    Image.fromarray(millimetres).save(tmp_path / "d.tif")
    Image.fromarray(metres.astype(np.float32)).save(tmp_path / "f.tif")
    Image.fromarray(np.where(SHOWN, millimetres, 65535).astype(np.uint16)).save(tmp_path / "saturated.png")
    np.save(tmp_path / "d.npy", metres)
    np.save(tmp_path / "lost.npy", lost.astype(np.float32))
    np.savez(tmp_path / "d.npz", depth=metres[..., None], K=K)
    np.save(tmp_path / "mm.npy", millimetres.astype(np.float32))
    np.save(tmp_path / "back.npy", -metres)
    np.save(tmp_path / "mask.npy", SHOWN)
    expected = points_of_depth(metres, K, SHOWN)
    given = {"mask": tmp_path / "mask.npy", "intrinsics": tmp_path / "cam.json"}
    plain = ("d.png", "d.pgm", "d.tif", "f.tif", "saturated.png", "d.npy", "lost.npy", "d.npz")
    for name in plain:
        np.testing.assert_allclose(read_cloud(tmp_path / name, InputOptions(**given)).points, expected, atol=1e-7)
    for name, more in (
        ("mm.npy", {"unit": "mm"}), ("mm.npy", {"depth_scale": 0.001}), ("d.png", {"unit": "cm", "depth_scale": 0.1}),
        ("back.npy", {"camera": "opengl"}), ("d.npy", {"depth_scale": 1.0}),
    ):  # fmt: skip
        np.testing.assert_allclose(
            read_cloud(tmp_path / name, InputOptions(**given, **more)).points, expected, atol=1e-7
        )
    rays = np.linalg.norm(points_of_depth(np.ones((24, 32)), K), axis=1).reshape(24, 32)
    np.testing.assert_allclose(points_of_depth(metres * rays, K, SHOWN, "distance"), expected, atol=1e-12)
    with pytest.raises(ConfigError, match="--camera opengl"):
        read_cloud(tmp_path / "back.npy", InputOptions(**given))
    assert "65535" in read_depth(tmp_path / "saturated.png").notes[0]


def test_pictures_of_depth_are_not_depth(tmp_path: Path) -> None:
    grey = np.full((24, 32), 80, np.uint8)
    Image.fromarray(grey).save(tmp_path / "grey.png")
    assert "8 bits" in read_depth(tmp_path / "grey.png").warnings[0]
    Image.fromarray(np.dstack([grey] * 3)).save(tmp_path / "rgb.png")
    Image.fromarray(np.dstack([grey] * 4)).save(tmp_path / "rgba.png")
    Image.fromarray(grey).quantize(4).save(tmp_path / "p.png")
    Image.fromarray(grey).save(tmp_path / "d.jpg")
    (tmp_path / "d.exr").write_bytes(b"\x76\x2f\x31\x01")
    for name in ("rgb.png", "rgba.png", "p.png", "d.jpg", "d.exr"):
        with pytest.raises(ConfigError, match=name):
            read_depth(tmp_path / name)


def test_a_picture_of_too_many_pixels_is_not_decoded(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((8, 8), np.uint8)).save(tmp_path / "bomb.png")
    data = (tmp_path / "bomb.png").read_bytes()
    head = b"IHDR" + struct.pack(">II", 12_000, 12_000) + data[24:29]
    (tmp_path / "bomb.png").write_bytes(data[:12] + head + struct.pack(">I", zlib.crc32(head)) + data[33:])
    for read in (read_depth, read_mask):
        with pytest.raises(ConfigError, match="12000 x 12000 pixels is over the limit"):
            read(tmp_path / "bomb.png")


def test_masks_of_segment_anything_are_read(tmp_path: Path) -> None:
    from pycocotools import mask as coco

    rng, width, height = np.random.default_rng(0), 40, 30
    shown = rng.random((2, height, width)) < 0.3
    entries = [
        {"segmentation": coco.encode(np.asfortranarray(m.astype(np.uint8))), "bbox": [0, 0, 1, 1]} for m in shown
    ]
    for entry in entries:
        entry["segmentation"]["counts"] = entry["segmentation"]["counts"].decode()
    file = tmp_path / "sam.json"
    for content in (entries, {"image": {"width": width, "height": height}, "annotations": entries}):
        file.write_text(json.dumps(content))
        for number in range(2):
            np.testing.assert_array_equal(read_mask(file, str(number)).shown, shown[number])
        with pytest.raises(ConfigError, match="--mask-id 0 to 1"):
            read_mask(file)
    file.write_text(json.dumps(entries[1]["segmentation"]))
    np.testing.assert_array_equal(read_mask(file).shown, shown[1])
    for damaged in ([], [3], {"size": [10**9, 10**9], "counts": [10**18]}, {"size": [2, 2], "counts": [9]}):
        file.write_text(json.dumps(damaged))
        with pytest.raises(ConfigError, match="Fix"):
            read_mask(file)
