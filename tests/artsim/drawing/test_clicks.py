"""What a person does with a page, in a real browser, and as on a phone: ten clicks, drags, keys and touches."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from artsim.common.names import numbered
from artsim.drawing.page import (
    PageContent,
    frames_page,
    object_page,
    sample_frame,
    sample_page,
    sample_parts,
)
from artsim.loading.urdf import load
from artsim.observing.annotation import box_corners
from artsim.observing.sample import Sample
from tests.artsim.drawing.conftest import small
from tests.conftest import ASSETS

pytestmark = pytest.mark.slow
Opened = Callable[..., Any]
PHONE = {"viewport": {"width": 390, "height": 780}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
STRAY = 40.0
"""Metres from the camera to points that are of nothing."""
CAMERA = """() => {
  paint();
  return [camera.projectionMatrix.elements, camera.matrixWorldInverse.elements];
}"""


def stray(sample: Sample) -> Sample:
    """The sample with a twentieth of its points far away."""
    points = sample.points.copy()
    points[::20] = [STRAY, STRAY, STRAY]
    return replace(sample, points=points)


def matrices(page: Any) -> tuple[np.ndarray, np.ndarray]:
    """Projection and T_eye_page (4, 4) of what is seen."""
    projection, view = (np.reshape(values, (4, 4)).T for values in page.evaluate(CAMERA))
    return projection, view


def on_screen(page: Any, points: np.ndarray) -> np.ndarray:
    """(N, 2) where points are in the picture: -1 to 1 from left to right, and from below to above."""
    projection, view = matrices(page)
    clip = np.c_[points, np.ones(len(points))] @ (projection @ view).T
    assert (clip[:, 3] > 0).all(), "behind the eye"
    return clip[:, :2] / clip[:, 3:]


def corners_of(sample: Sample) -> np.ndarray:
    return np.concatenate([box_corners(sample, k) for k in range(len(sample.joint_type))])


def center_of(sample: Sample) -> np.ndarray:
    corners = corners_of(sample)
    return 0.5 * (corners.min(axis=0) + corners.max(axis=0))


def drag(page: Any, *way: tuple[int, int], button: str = "left") -> None:
    page.mouse.move(250, 300)
    page.mouse.down(button=button)
    for x, y in way:
        page.mouse.move(250 + x, 300 + y)
    page.mouse.up(button=button)


def picture(page: Any) -> np.ndarray:
    page.evaluate("paint()")  # at once, rather than with the next picture of the screen
    return np.asarray(Image.open(io.BytesIO(page.locator("canvas").screenshot())).convert("RGB")).astype(int)


def cloud_colours(page: Any) -> np.ndarray:
    """(N, 6) position and colour of every point."""
    rows = page.evaluate("""() => things.filter(thing => thing.layer === "cloud").flatMap(({object}) => {
      const {position, color} = object.geometry.attributes;
      return [...Array(position.count).keys()].map(i =>
        [...position.array.slice(3 * i, 3 * i + 3), ...color.array.slice(3 * i, 3 * i + 3)]);
    })""")
    return np.array(rows)


def test_a_drag_turns_the_object_about_its_own_centre_and_up_stays_up(opened: Opened) -> None:
    samples = [small(0), stray(small(1, distance=3.0))]
    page = opened(sample_page(samples))
    page.get_by_role("button", name="next").click()
    center, up = center_of(samples[1]), samples[1].T_world_camera[2, :3]
    before = matrices(page)[1]
    for way in ([(150, 0)], [(0, 120), (0, 400)], [(-90, -260), (60, 40)]):
        drag(page, *way)
        np.testing.assert_allclose(on_screen(page, center[None]), 0.0, atol=1e-3)
        foot, head = on_screen(page, np.stack([center, center + 0.1 * up]))
        assert abs(head[0] - foot[0]) < 1e-4
        assert head[1] > foot[1]
        assert np.abs(on_screen(page, corners_of(samples[1]))).max() < 1.0  # nothing leaves the picture
    assert np.abs(matrices(page)[1] - before).max() > 0.1
    page.locator("canvas").dblclick(position={"x": 250, "y": 300})
    np.testing.assert_allclose(matrices(page)[1], before, atol=1e-6)


def test_each_sample_is_fitted_into_view(opened: Opened) -> None:
    samples = [small(0), stray(small(4, distance=6.0)), small(3, category="storage_furniture")]
    page = opened(sample_page(samples))
    assert samples[2].diagonal > 2 * samples[0].diagonal
    for sample in samples:
        seen = on_screen(page, corners_of(sample))
        assert 0.5 < np.abs(seen).max() < 1.0
        page.mouse.move(250, 300)
        page.mouse.wheel(0, -300)
        assert np.abs(on_screen(page, corners_of(sample))).max() > 1.1 * np.abs(seen).max()
        page.keyboard.press(".")


def test_the_right_button_moves_the_picture_and_the_object_still_turns_about_itself(opened: Opened) -> None:
    sample = small()
    page = opened(sample_page([sample]))
    drag(page, (80, 50), button="right")
    moved = on_screen(page, center_of(sample)[None])[0]
    width, height = (page.evaluate(f"byId('view').client{side}") for side in ("Width", "Height"))
    np.testing.assert_allclose(moved, [160 / width, -100 / height], atol=0.01)
    drag(page, (120, -60))
    np.testing.assert_allclose(on_screen(page, center_of(sample)[None])[0], moved, atol=1e-3)
    page.get_by_role("button", name="Fit into view").click()
    np.testing.assert_allclose(on_screen(page, center_of(sample)[None]), 0.0, atol=1e-3)


def test_parts_have_their_names_and_equal_names_numbers(opened: Opened) -> None:
    assert numbered(["body", "drawer", "door", "drawer"]) == ["body", "drawer 1", "door", "drawer 2"]
    page = opened(object_page(load(ASSETS / "cabinet")))
    names = [text.partition(" (")[0] for text in page.locator("label.part").all_inner_texts()]
    assert names == ["cabinet_frame", "drawer 1", "drawer 2", "drawer 3"]
    assert page.locator("#joints span").all_inner_texts() == names[1:]
    samples = [small(0), small(3, category="storage_furniture")]
    page = opened(sample_page(samples))
    page.get_by_role("button", name="next").click()
    assert page.locator("label.part").count() == len(samples[1].part_names)
    assert page.locator("label.part").first.inner_text() == samples[1].part_names[0]


def test_the_ground_truth_stands_beside_the_estimate(opened: Opened) -> None:
    sample, other = small(), small()
    other = replace(other, T_camera_part=other.T_camera_part + 0.05 * np.eye(4)[:, 3:] * [0, 0, 0, 1])
    frame = replace(sample_frame(sample), shown=sample_parts(other), truth=sample_parts(sample))
    page = opened(frames_page(PageContent("two"), [frame]))
    assert page.locator(".pane").all_inner_texts() == ["estimate", "ground truth"]
    for name in ("cloud", "axes"):
        page.locator(f"#layer-{name}").uncheck()
    half = picture(page).shape[1] // 2
    left, right = picture(page)[60:, :half], picture(page)[60:, half : 2 * half]
    background = right[-1, -1]
    drawn = [(np.abs(side - background).sum(axis=-1) > 30) for side in (left, right)]
    assert all(side.sum() > 100 for side in drawn)
    assert (drawn[0] != drawn[1]).any()
    page.keyboard.press("t")  # over it
    both = (np.abs(picture(page) - background).sum(axis=-1) > 30).sum()
    assert page.locator(".pane").count() == 0
    page.keyboard.press("t")  # hidden
    assert (np.abs(picture(page) - background).sum(axis=-1) > 30).sum() < both


def test_points_are_coloured_by_error(opened: Opened) -> None:
    sample = small()
    way = np.zeros((len(sample.points), 3), np.float32)
    way[::2, 2] = 0.01  # every other point is a centimetre off
    page = opened(sample_page([replace(sample, points=sample.points + way)]))
    assert page.locator("#scale-top").is_hidden()
    page.get_by_role("radio", name="by error of the sensor").check()
    assert page.locator("#scale-top").inner_text() == "10 mm"
    off = {tuple(point) for point in (sample.points + way)[::2].tolist()}
    rows = cloud_colours(page)
    assert len(rows) == len(sample.points)
    for *point, red, _, blue in rows:
        assert (red > blue) == (tuple(point) in off)


def test_dark_follows_the_system_and_the_button(opened: Opened) -> None:
    page = opened(sample_page([small()]), color_scheme="dark")
    assert picture(page)[5, 5].max() < 60
    assert page.evaluate("getComputedStyle(document.querySelector('aside')).backgroundColor") != "rgb(255, 255, 255)"
    page.get_by_role("button", name="Dark or light").click()
    assert picture(page)[5, 5].min() > 200
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        page.wait_for_function(f"matchMedia('(prefers-color-scheme: {scheme})').matches")
        picture(page)  # a frame, with which the browser tells of the change
        page.wait_for_function(f"document.documentElement.dataset.theme === '{scheme}'")
    assert picture(page)[5, 5].max() < 60


def test_keys_turn_zoom_and_step(opened: Opened) -> None:
    samples = [small(0), small(1)]
    page = opened(sample_page(samples))
    start = matrices(page)[1]
    for there, back in (("ArrowLeft", "ArrowRight"), ("ArrowUp", "ArrowDown"), ("Shift+ArrowUp", "Shift+ArrowDown")):
        page.keyboard.press(there)
        assert np.abs(matrices(page)[1] - start).max() > 0.01
        page.keyboard.press(back)
        np.testing.assert_allclose(matrices(page)[1], start, atol=1e-6)
    page.keyboard.press("+")
    far, near = (
        np.linalg.norm(view[:3, 3] + view[:3, :3] @ center_of(samples[0])) for view in (start, matrices(page)[1])
    )
    assert near < 0.9 * far
    page.keyboard.press("Home")
    np.testing.assert_allclose(matrices(page)[1], start, atol=1e-6)
    page.keyboard.press(".")
    assert "2 of 2" in page.locator("#frame-count").inner_text()
    page.locator("#frame").focus()
    page.keyboard.press("ArrowLeft")  # moves the slider that has the focus, not the camera
    assert "1 of 2" in page.locator("#frame-count").inner_text()
    np.testing.assert_allclose(matrices(page)[1], start, atol=1e-6)


def test_fingers_turn_and_pinch_on_a_phone_and_nothing_is_cut(opened: Opened) -> None:
    sample = small(3, category="storage_furniture")
    page = opened(sample_page([sample, small()]), **PHONE)
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[int, int]) -> None:
        at = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        fingers.send("Input.dispatchTouchEvent", {"type": f"touch{kind}", "touchPoints": at})

    start = matrices(page)[1]
    touch("Start", (150, 200))
    touch("Move", (220, 200))
    touch("End")
    turned = matrices(page)[1]
    assert np.abs(turned - start).max() > 0.1
    np.testing.assert_allclose(on_screen(page, center_of(sample)[None]), 0.0, atol=1e-3)
    touch("Start", (150, 200), (250, 200))
    touch("Move", (100, 200), (300, 200))
    touch("End")
    np.testing.assert_allclose(matrices(page)[1][:3, :3], turned[:3, :3], atol=1e-6)  # a pinch does not turn
    assert np.linalg.norm(matrices(page)[1][:3, 3]) < np.linalg.norm(turned[:3, 3])
    assert page.evaluate("document.scrollingElement.scrollWidth") <= 390
    assert page.evaluate("[...document.querySelectorAll('td, th')].every(cell => cell.scrollWidth <= cell.clientWidth)")
    assert page.evaluate("document.querySelector('aside').scrollWidth <= document.querySelector('aside').clientWidth")
    tall = page.evaluate("[...document.querySelectorAll('button')].map(button => button.clientHeight)")
    assert min(tall) >= 40
    page.get_by_role("button", name="next").tap()
    assert "2 of 2" in page.locator("#frame-count").inner_text()


def test_the_table_says_what_the_sample_says_and_a_picture_is_saved(opened: Opened) -> None:
    sample = small()
    page = opened(sample_page([sample]))
    assert page.locator("caption").all_inner_texts() == list(sample.part_names)
    cells = page.locator("#table").inner_text()
    for word in (f"{np.rad2deg(sample.joint_state[1]):.1f} deg", f"{np.sum(sample.part == 0)}"):
        assert word in cells
        assert word in str(sample)
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save a picture").click()
    assert waiting.value.suggested_filename == "laptop_0_laptop_0.png"
    saved = np.asarray(Image.open(waiting.value.path()).convert("RGB")).astype(int)
    assert saved.shape == picture(page).shape
    assert np.abs(saved - picture(page)).mean() < 2.0
