"""A real browser, offline, for the tests of pages."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.families import make
from artsim.model.camera import Camera
from artsim.observing.sample import Sample


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Callable[..., Any]]:
    """Opens a page's text. Every fault of a script and every request for another file or host fails the test."""
    contexts, faults = [], []

    def open_page(text: str, **more: Any) -> Any:
        file = tmp_path / "page.html"
        file.write_text(text, encoding="utf-8")
        contexts.append(browser.new_context(**{"viewport": {"width": 900, "height": 600}, "offline": True, **more}))
        page = contexts[-1].new_page()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on(
            "request", lambda request: request.url.startswith((file.as_uri(), "blob:")) or faults.append(request.url)
        )
        page.goto(file.as_uri())
        page.wait_for_selector("body[data-ready=yes]", timeout=60_000)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert faults == []


def small(seed: int = 0, distance: float = 0.8, category: str = "laptop", num_points: int = 256) -> Sample:
    """A sample of a procedural object, of some points."""
    obj = make(category, seed)
    camera = Camera.look_at(distance * obj.diagonal * np.array([-1.2, 0.6, 1.0]), [0, 0, 0])
    return artsim.observe(obj, obj.tree.complete_state(np.full(len(obj), 1.2)), camera, num_points=num_points)
