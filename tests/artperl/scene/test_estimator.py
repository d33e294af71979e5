"""Every detected object is estimated, or said why not; images that do not fit are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl import load_scene_estimator
from artperl.inputs.detections import Detection
from artperl.scene.drawing import draw_scene, scene_gallery
from artperl.scene.estimator import SceneEstimate, check_images
from artsim import Camera, make, render
from artsim.common.files import open_image
from artsim.errors import ConfigError
from artsim.formats.coco import mask_record
from artsim.model.frame import BACKGROUND

CAMERA = Camera.look_at((-0.9, 0.35, 0.6), (0.0, 0.0, 0.05), 320, 240)


@pytest.mark.slow
def test_one_object_is_posed_and_the_others_say_why_they_are_not() -> None:
    obj = make("laptop", 1_000_003).with_diagonal(0.4)
    frame = render(obj, [0.0, 1.6], CAMERA)
    mask = frame.part_ids != BACKGROUND
    told = mask_record(mask)
    size = (320, 240)

    def detection(category: str, segmentation: object) -> Detection:
        return Detection(0, category, 0.8, segmentation, tuple(told["bbox"]), size)

    empty = [[0.0, 0.0, 3.0, 0.0, 3.0, 3.0, 0.0, 3.0]]
    found = [detection("laptop", told["segmentation"]), detection("spoon", empty), detection("laptop", empty)]
    rgb = np.full((240, 320, 3), 90, np.uint8)
    result = load_scene_estimator()(rgb, frame.depth, CAMERA.K, found)
    first, unknown, nothing = result.objects
    assert first.estimate is not None
    T = CAMERA.T_camera_world @ obj.tree.forward_kinematics(np.array([0.0, 1.6]))
    angle = np.rad2deg(np.arccos(np.clip((np.trace(T[1, :3, :3].T @ first.estimate.rotation[1]) - 1) / 2, -1, 1)))
    assert angle < 10
    assert first.score == pytest.approx(0.8 * first.estimate.confidence)
    assert "--estimators spoon=" in unknown.problem
    assert unknown.score == 0.0
    assert "no depth within the mask" in nothing.problem
    assert "laptop" in str(result)
    drawn = np.asarray(open_image(draw_scene(rgb, CAMERA.K, result)))
    assert drawn.shape == rgb.shape
    changed = (drawn != 90).any(axis=2)
    rows, columns = changed.nonzero()
    left, top, width, height = told["bbox"]
    assert 500 < changed.sum() < 0.5 * changed.size
    near = (columns > left - 60) & (columns < left + width + 60) & (rows > top - 60) & (rows < top + height + 60)
    assert near.mean() > 0.9
    unsure = replace(first, estimate=replace(first.estimate, confidence=0.1))
    outline = np.asarray(open_image(draw_scene(rgb, CAMERA.K, SceneEstimate((unsure,)))))
    assert (outline != 90).any(axis=2).sum() < 0.8 * changed.sum()
    assert not any("border" in text for text in first.estimate.warnings)
    half = int(left + 0.6 * width)  # the image ends within the laptop
    cut = Detection(0, "laptop", 0.8, mask_record(mask[:, :half])["segmentation"], tuple(told["bbox"]), (half, 240))
    (seen,) = load_scene_estimator()(None, frame.depth[:, :half], CAMERA.K, [cut]).objects
    assert seen.estimate is not None
    assert "border" in seen.estimate.warnings[-1]


def test_a_gallery_has_every_picture_in_its_place() -> None:
    shades = (40, 90, 140, 190)
    pictures = [draw_scene(np.full((60, 80, 3), shade, np.uint8), CAMERA.K, SceneEstimate(())) for shade in shades]
    sheet = np.asarray(open_image(scene_gallery(pictures, columns=3, width=40)).convert("RGB"))
    assert sheet.shape == (60, 120, 3)
    assert [int(sheet[15, x, 0]) for x in (20, 60, 100)] == list(shades[:3])
    assert sheet[45, 20, 0] == shades[3]
    assert (sheet[45, 60:] == 255).all()


def test_depth_in_another_unit_and_images_of_two_sizes_are_refused() -> None:
    depth = np.full((4, 6), 0.8)
    check_images(np.zeros((4, 6, 3), np.uint8), depth)
    with pytest.raises(ConfigError, match="--unit mm"):
        check_images(None, 1000 * depth)
    with pytest.raises(ConfigError, match="--unit m,"):
        check_images(None, depth / 1000)
    with pytest.raises(ConfigError, match="5 x 4 pixels"):
        check_images(np.zeros((4, 5, 3), np.uint8), depth)
    with pytest.raises(ConfigError, match="no depth"):
        check_images(None, 0 * depth)
