"""What tests share: objects, real ones where they are to be had, and what to do where something is missing."""

from __future__ import annotations

import gc
import importlib
import multiprocessing
import operator
import os
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn, TypeVar

import numpy as np
import pytest
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from hypothesis import settings

from artsim.commands.doctor import processor
from artsim.common.program import cores
from artsim.errors import RenderError
from artsim.families import make
from artsim.making.assembly import Assembly, continuous, prismatic, revolute, screw
from artsim.making.solids import box, cylinder, ring
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject, Part
from artsim.renderers import Renderer, make_renderer
from tests.processors import PROCESSORS, can_run, left_out

T = TypeVar("T")
MOST_S = 1.0
"""Processor seconds of a test without the mark `slow`. More is reported, not refused: what comes first compiles."""
ROOT = Path(__file__).resolve().parent.parent
ASSETS, CASES = ROOT / "urdf_assets", ROOT / "tests" / "cases"
DEMO = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]


def absent(message: str) -> NoReturn:
    """Something that a test needs is missing: a skip that says so on a developer's machine, a failure in CI."""
    if os.environ.get("CI"):
        pytest.fail(message)
    pytest.skip(message, allow_module_level=True)


def installed(module: str) -> ModuleType:
    """A module of an optional dependency."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        absent(f"{module} cannot be imported ({error}): what needs it is not tested")


def pytest_sessionstart() -> None:
    """Let Embree have no threads in this process: it counts processors once, as its first scene is built.

    Fixtures fork this process (`quick_workers`). A copy has no threads, and would wait for Embree's for ever.
    """
    if not hasattr(os, "sched_setaffinity"):  # not on macOS
        return
    processors = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(processors)})
    try:
        triangles = trimesh.creation.box().triangles.astype(np.float32)
        scene = EmbreeScene()
        TriangleMesh(scene, triangles)
        scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32), query="DISTANCE")
    finally:
        os.sched_setaffinity(0, processors)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files of few slow tests come early: what comes last is short, and no process waits long for another one.

    ManiSkill comes first: it wants SAPIEN's device "cpu", which SAPIEN refuses while a renderer has the default one.
    """
    items.sort(key=lambda item: ("maniskill" not in item.path.name, item.path.parent != ROOT / "tests"))


def pytest_collection_finish() -> None:
    """Thousands of collected tests stay: no collection of garbage need look at them, and ManiSkill collects often."""
    gc.collect()
    gc.freeze()


def processor_seconds() -> float:
    """Those of this process and of all that it has waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Note what a test costs, whatever else the machine does meanwhile."""
    before = processor_seconds()
    yield
    item.user_properties.append(("processor_seconds", processor_seconds() - before))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Which processor this was, which code the tests of equal bytes leave out, and which tests lack the mark `slow`."""
    for report in terminalreporter.stats.get("passed", ()):
        taken = dict(report.user_properties).get("processor_seconds", 0.0)
        if taken > MOST_S and "slow" not in report.keywords:
            terminalreporter.write_line(f"{report.nodeid}: {taken:.1f} s of processor time, but not marked slow")
    run = ", ".join(filter(can_run, PROCESSORS)) or "of no other kind"
    terminalreporter.write_line(f"{processor()}, {cores()} of its cores; bytes are compared as on processors {run}")
    for name in PROCESSORS:
        if not can_run(name):
            terminalreporter.write_line(left_out(name))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test of an engine that is not installed, such as PyBullet beyond Python 3.11, says so."""
    call = getattr(item, "callspec", None)
    for value in () if call is None else call.params.values():
        if isinstance(value, str) and value in ("pybullet", "sapien"):
            installed(value)


@pytest.fixture(scope="session")
def partnet_dir() -> Path:
    """Folder of real PartNet-Mobility objects."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if not folder:
        absent("ARTSIM_PARTNET_DIR is not set: real PartNet-Mobility objects are not tested")
    return Path(folder)


@pytest.fixture(scope="session")
def one_drawer() -> ArticulatedObject:
    """Furniture whose only joint is that of a drawer."""
    return next(obj for obj in (make("drawer", seed) for seed in range(100)) if len(obj) == 2)


def backend(name: str) -> Renderer:
    """A renderer that a machine may lack."""
    try:
        return make_renderer(name)
    except RenderError as error:
        absent(str(error))


def in_another_process(source: Sequence[T], i: int) -> T:
    """What a new process, which was sent the source as a DataLoader would send it, reads as its i-th item."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(operator.getitem, source, i).result(timeout=120)


def solid(name: str, mesh: trimesh.Trimesh) -> Part:
    """A part from a trimesh."""
    return Part(name, name, np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


def rigid(mesh: trimesh.Trimesh) -> ArticulatedObject:
    """An object of one part."""
    tree = KinematicTree([Joint("root", "free", -1)])
    return ArticulatedObject("solid", "solid", (solid("solid", mesh),), tree, sha256="0" * 64)


def valve() -> ArticulatedObject:
    """Every type of joint, a mimic relation, and parts in another order than a walk through the tree gives."""
    assembly = Assembly()
    assembly.add("pipe", box((-0.1, -0.1, 0), (0.1, 0.1, 0.2)), density=1000.0)
    arm = revolute("pipe", (0, 0, 1), (0.15, 0, 0), -1, 2)
    assembly.add("arm", box((0.15, -0.02, 0), (0.35, 0.02, 0.05)), arm)
    cap = screw("pipe", (0, 0, 1), (0, 0, 0.2), 0, 20, 0.002)
    assembly.add("cap", cylinder((0, 0, 0.21), (0, 0, 0.25), 0.05), cap)
    knob = continuous("arm", (1, 2, 0), (0.4, 0, 0))
    assembly.add("knob_2", ring((0.41, 0, 0.01), (1, 0, 0), 0.01, 0.02, 0.02), knob)
    slide = prismatic("arm", (1, 0, 1), 0, 0.1, mimic=("cap", 0.005))
    assembly.add("knob_1", box((0.4, 0.1, 0), (0.42, 0.12, 0.02)), slide)
    return assembly.build("valve", "3")


settings.register_profile("plain", max_examples=50, deadline=None)
settings.load_profile("plain")

BOX_LAPTOP = """<robot name="box_laptop">
  <link name="base"><visual><geometry><box size="0.3 0.4 0.02"/></geometry></visual></link>
  <link name="lid"><visual><origin xyz="-0.15 0 0.006"/><geometry><box size="0.3 0.4 0.01"/></geometry></visual></link>
  <joint name="hinge" type="revolute">
    <parent link="base"/><child link="lid"/><origin xyz="0.15 0 0.01"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="2.2"/>
  </joint>
</robot>
"""


@pytest.fixture
def box_laptop(tmp_path: Path) -> Path:
    """URDF file of two plates on a hinge."""
    path = tmp_path / "box_laptop.urdf"
    path.write_text(BOX_LAPTOP)
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, which draws with its own software."""
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        absent("no Chromium: pages are not opened (scripts/install-browser.sh installs it)")
    with installed("playwright.sync_api").sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-background-networking", "--use-angle=swiftshader"]
        arguments += ["--enable-unsafe-swiftshader"]
        chromium = playwright.chromium.launch(executable_path=path, args=arguments)
        yield chromium
        chromium.close()
