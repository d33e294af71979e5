"""Pages show, in a real browser and without a network, what artsim knows: joints move as its kinematics says."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.commands.view import View
from artsim.drawing.page import object_page, sample_page
from artsim.errors import ArtsimError
from artsim.families import make
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from tests.artsim.drawing.conftest import small
from tests.conftest import ASSETS

Opened = Callable[..., Any]
WHERE = """k => {
  const group = parts[k].group;
  group.updateWorldMatrix(true, false);
  return group.matrixWorld.elements;
}"""


def poses(page: Any, obj: ArticulatedObject) -> np.ndarray:
    return np.array([np.reshape(page.evaluate(WHERE, k), (4, 4)).T for k in range(len(obj))])


@pytest.mark.parametrize("category", ["storage_furniture", "window", "faucet", "coffee_machine", "random_tree"])
def test_joints_move_in_the_browser_as_in_artsim(category: str, opened: Opened) -> None:
    obj = make(category, 3)
    page = opened(object_page(obj))
    rng, q = np.random.default_rng(0), obj.tree.rest.copy()
    np.testing.assert_allclose(poses(page, obj), np.broadcast_to(np.eye(4), (len(obj), 4, 4)), atol=1e-6)
    for k in obj.tree.free_joints:
        slider = page.locator(f"input[data-joint='{k}']")
        low, high = float(slider.get_attribute("min")), float(slider.get_attribute("max"))
        q[k] = rng.uniform(low, high)
        slider.evaluate("(s, value) => { s.value = value; s.dispatchEvent(new Event('input')); }", str(q[k]))
    moved = np.array(page.evaluate("() => state"))
    np.testing.assert_allclose(moved, obj.tree.complete_state(q), atol=1e-6)
    np.testing.assert_allclose(poses(page, obj), obj.tree.forward_kinematics(q), atol=1e-5)


def test_buttons_sliders_and_boxes_change_the_picture(opened: Opened) -> None:
    obj = load(ASSETS / "cabinet")
    page = opened(object_page(obj))
    canvas, pictures = page.locator("canvas"), []
    for act in (
        lambda: None,
        lambda: page.get_by_role("button", name="upper ends").click(),
        lambda: page.locator("#layer-boxes").check(),
        lambda: page.locator("input[data-part='1']").uncheck(),
        lambda: page.locator("#layer-surfaces").uncheck(),
    ):
        act()
        pictures.append(canvas.screenshot())
    assert len(set(pictures)) == len(pictures)
    page.get_by_role("button", name="at rest").click()
    page.locator("#layer-boxes").uncheck()
    page.locator("#layer-surfaces").check()
    page.locator("input[data-part='1']").check()
    assert canvas.screenshot() == pictures[0]
    page.mouse.move(200, 300)
    page.mouse.down()
    page.mouse.move(330, 260, steps=4)
    page.mouse.up()
    page.wait_for_timeout(200)
    assert canvas.screenshot() != pictures[0]


def test_samples_are_shown_one_by_one(opened: Opened) -> None:
    samples = [small(0), small(1)]
    page = opened(sample_page(samples))
    for number, sample in enumerate(samples):
        slider = page.locator("#frame")
        slider.evaluate("(s, value) => { s.value = value; s.dispatchEvent(new Event('input')); }", str(number))
        seen = page.evaluate("""() => things.filter(thing => thing.layer === "cloud").map(
            ({object, part}) => [part, [...object.geometry.attributes.position.array]])""")
        for k, positions in seen:
            mine = sample.points[sample.part == k]
            theirs = np.reshape(positions, (-1, 3))
            np.testing.assert_allclose(np.sort(theirs, axis=0), np.sort(mine, axis=0), atol=1e-6)


def test_names_out_of_files_stay_names(opened: Opened) -> None:
    bad = "</script><script>document.title='broken'</script>\u2028<img src=x onerror=alert(1)>"
    obj = make("globe", 0)
    obj = replace(obj, category=bad, parts=tuple(replace(part, label=bad) for part in obj.parts))
    page = opened(object_page(obj))
    assert "script" in page.title()
    assert page.locator("img").count() == 0


def test_a_page_of_real_objects_opens(opened: Opened, partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir])[::60]:
        obj = source.load()
        page = opened(object_page(obj))
        assert page.locator("input[data-part]").count() == len(obj)


def test_objects_and_samples_show_themselves(tmp_path: Path) -> None:
    obj = make("globe", 0)
    assert obj.show(tmp_path / "globe.html").read_text() == object_page(obj)
    sample = small()
    assert small().show(tmp_path / "sample.html").read_text() == sample_page([sample])
    assert obj._repr_html_().startswith("<iframe srcdoc=")


@pytest.mark.slow
def test_the_program_writes_pages_of_objects_and_datasets(tmp_path: Path) -> None:
    View(ASSETS / "laptop", html=tmp_path / "laptop.html").run()
    artsim.generate(find_sources([ASSETS / "laptop"]), tmp_path / "set", 3, splits=(1, 0, 0), progress=False)
    View(tmp_path / "set", html=tmp_path / "set.html", samples=2).run()
    found = re.search(r"const data = (\{.*\});\n", (tmp_path / "set.html").read_text())
    assert found is not None
    assert len(json.loads(found[1])["frames"]) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["laptop.html", "set", "set.html"]


def test_what_is_no_dataset_no_object_or_no_picture_is_said(tmp_path: Path) -> None:
    for path in (tmp_path / "nothing", tmp_path):
        with pytest.raises(ArtsimError, match="the folder of a dataset"):
            View(path, html=tmp_path / "a.html").run()
    for wrong in ({"out": tmp_path / "README.md"}, {"html": tmp_path / "README.md"}, {"rerun": tmp_path / "README.md"}):
        with pytest.raises(ArtsimError, match=r"README\.md: it is no \.\w+ file\. Fix: name it README\."):
            View(ASSETS / "laptop", **wrong).run()
    with pytest.raises(ArtsimError, match="no dataset here"):
        View(ASSETS / "laptop", serve=True).run()
    assert list(tmp_path.iterdir()) == []


def test_a_page_of_nothing_is_refused() -> None:
    with pytest.raises(ArtsimError, match="no sample"):
        sample_page([])
