"""Do other programs read what artsim writes? ``python -m benchmarks.clients``.

Runs every client once on small output of its own: simulators, format readers, training loops, viewers. Prints a table
with versions and what each found; the last line is one JSON object, with the clients that failed. A client that is not
installed counts as failed.
"""

from __future__ import annotations

import io
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import tyro

import artsim
from artsim.common.progress import track
from artsim.export import FORMATS, export
from artsim.export.options import ExportOptions
from artsim.physics import compare_simulators


class Material:
    """What clients are given, made when first used: an object in all formats, and a dataset with images."""

    def __init__(self, folder: Path):
        self.folder = folder

    @cached_property
    def exported(self) -> Path:
        """Folder of a cabinet in URDF, MJCF and USD."""
        obj = artsim.make("storage_furniture", 3)
        export(obj, self.folder / "cabinet", list(FORMATS), options=ExportOptions(actuators="motor", materials=True))
        return self.folder / "cabinet"

    @cached_property
    def dataset(self) -> Path:
        """Folder of 8 samples with depth and masks."""
        sources = artsim.family_sources(["laptop", "drawer"], 2)
        options = artsim.SampleOptions(num_points=512, images=("depth", "part_mask"))
        artsim.generate(
            sources, self.folder / "set", 8, sample=options, splits=(1, 0, 0), workers=1, progress=False, shard_size=4
        )
        return self.folder / "set"

    def converted(self, to: Any) -> Path:
        """Folder of the dataset in another format."""
        from artsim.formats import convert

        out = self.folder / f"set_{to}"
        convert(self.dataset, to, out, workers=1, progress=False)
        return out


def _simulator(name: str, material: Material) -> str:
    (agreement,) = compare_simulators(material.exported, 10, simulators=(name,))
    assert not agreement.problem, agreement.problem
    return f"{agreement.links} links, {agreement.joints} joints, parts within {agreement.metres:.1g} m"


def _mjcf(material: Material) -> str:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(material.exported / FORMATS["mjcf"]))
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert data.qpos.min() > 0.05  # every drawer came out
    return f"{model.nu} motors pull {model.njnt} drawers out, {model.nmat} materials, {model.ntex} textures"


def _usd(material: Material) -> str:
    from pxr import Usd, UsdPhysics, UsdValidation

    stage = Usd.Stage.Open(str(material.exported / FORMATS["usd"]))
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    errors = [e for e in context.Validate(stage) if e.GetType() == UsdValidation.ValidationErrorType.Error]
    assert not errors, errors[0].GetMessage()
    joints = sum(bool(UsdPhysics.Joint(prim)) for prim in stage.Traverse())
    return f"{joints} joints, 0 errors of the validators"


def _yourdfpy(material: Material) -> str:
    import yourdfpy

    robot = yourdfpy.URDF.load(str(material.exported / FORMATS["urdf"]))
    return f"{len(robot.link_map)} links, {robot.num_actuated_joints} joints that move"


def _trimesh(material: Material) -> str:
    import trimesh

    scene = trimesh.load_scene(material.exported / "meshes" / "body.obj")
    return f"{len(scene.geometry)} surfaces with materials"


def _loads_back(name: str, material: Material) -> str:
    obj = artsim.load(material.exported / FORMATS[name])
    ours = artsim.make("storage_furniture", 3)
    assert obj.tree.types == ours.tree.types
    np.testing.assert_allclose(obj.tree.axes, ours.tree.axes, atol=1e-6)
    np.testing.assert_allclose(obj.tree.limits, ours.tree.limits, atol=1e-6)
    return f"{len(obj)} parts come back equal"


def _joint_file(material: Material) -> str:
    """A GLB by trimesh, with the joints that PartNet-Mobility would write beside it."""
    import trimesh

    obj = artsim.make("storage_furniture", 3)
    T_mesh_rest = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])  # Y up, front to +Z
    scene = trimesh.Scene()
    rows: list[dict[str, Any]] = []
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        mesh = trimesh.Trimesh(part.vertices @ T_mesh_rest.T, part.faces, process=False)
        scene.add_geometry(mesh, node_name=f"{k}_0", geom_name=f"{k}_0")
        row: dict[str, Any] = {
            "id": k,
            "parent": joint.parent,
            "joint": "slider" if k else "static",
            "name": part.label,
        }
        axis = {"origin": (T_mesh_rest @ joint.origin).tolist(), "direction": (T_mesh_rest @ joint.axis).tolist()}
        limit = {"a": joint.lower, "b": joint.upper, "noLimit": False}
        row |= {"parts": [{"id": k, "name": part.label}], "jointData": {"axis": axis, "limit": limit} if k else {}}
        rows.append(row)
    folder = material.folder / "glb"
    folder.mkdir()
    (folder / "model.glb").write_bytes(scene.export(file_type="glb"))
    (folder / "mobility_v3.json").write_text(json.dumps({"partnet": [], "mobility": rows}))
    loaded = artsim.load(folder / "model.glb")
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=1e-6)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, atol=1e-6)
    np.testing.assert_allclose(loaded.box_size, obj.box_size, atol=1e-6)
    return f"{len(loaded)} parts of a GLB and its mobility_v3.json come back equal"


def _pieces(material: Material) -> str:
    """A loaded laptop as MJCF, cut into convex pieces."""
    import mujoco

    from artsim.export import prepare

    export(artsim.make("laptop", 0), material.folder / "laptop")
    obj = prepare(artsim.load(material.folder / "laptop"), progress=False)
    export(obj, material.folder / "pieces", ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(material.folder / "pieces" / FORMATS["mjcf"]))
    count = int((model.geom_contype > 0).sum())
    assert count >= len(obj)
    return f"{count} convex pieces of {len(obj)} parts"


def _gymnasium(material: Material) -> str:
    import gymnasium
    from gymnasium.utils.env_checker import check_env

    import artsim.envs  # noqa: F401

    for engine in ("pybullet", "mujoco"):
        env = gymnasium.make("artsim/Articulated-v0", categories=("drawer",), physics=engine, num_points=64)
        check_env(env.unwrapped, skip_render_check=True)
    envs = gymnasium.make_vec("artsim/Articulated-v0", 2, vectorization_mode="sync", num_points=64)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    return "its checker finds nothing, with PyBullet and MuJoCo; two environments at once"


def _maniskill(material: Material) -> str:
    import gymnasium

    import artsim.envs  # noqa: F401

    env = gymnasium.make("ArtSimArticulated-v1", categories=("drawer",), render_backend="cpu")
    env.reset(seed=0)
    _, reward, *_ = env.step(env.action_space.sample())
    env.close()
    return f"a step, reward {float(reward):.3f}"


def _torch(material: Material) -> str:
    import torch

    stream = artsim.open_dataset(material.dataset).stream().padded(float32=True)
    loader: Any = torch.utils.data.DataLoader(stream, batch_size=4, num_workers=2)  # type: ignore[arg-type]
    indices: list[int] = []
    for number, batch in enumerate(loader):
        indices += batch["index"].tolist()
        if number == 3:
            break
    assert len(set(indices)) == len(indices) == 16
    return "16 samples by two workers, none of them twice"


def _webdataset(material: Material) -> str:
    import webdataset

    from artsim.formats import decode_values

    files = sorted(map(str, material.converted("webdataset").glob("*.tar")))
    samples = list(webdataset.WebDataset(files, shardshuffle=False).decode(decode_values))
    assert len(samples) == 8
    return f"8 samples of {samples[0]['points.npy'].shape[0]} points"


def _coco(material: Material) -> str:
    from pycocotools.coco import COCO

    (file,) = (material.converted("coco") / "annotations").glob("*.json")
    coco = COCO(str(file))
    areas = [coco.annToMask(annotation).sum() == annotation["area"] for annotation in coco.dataset["annotations"]]
    assert all(areas)
    return f"{len(coco.imgs)} images, {len(coco.anns)} parts, areas equal"


def _hdf5(material: Material) -> str:
    import h5py

    files = sorted(material.converted("hdf5").rglob("*.hdf5"))
    with h5py.File(files[0]) as file:
        keys = ", ".join(sorted(file))
    return f"{len(files)} files with {keys}"


def _bop(material: Material) -> str:
    out = material.converted("bop")
    (scene,) = out.rglob("scene_gt.json")
    truth = json.loads(scene.read_text())
    parts = sum(map(len, truth.values()))
    models = json.loads((out / "models" / "models_info.json").read_text())
    assert {str(entry["obj_id"]) for entries in truth.values() for entry in entries} <= set(models)
    return f"{len(truth)} images, {parts} poses of {len(models)} models; bop_toolkit is no package"


def _ply(material: Material) -> str:
    import trimesh

    file = next(material.converted("ply").rglob("*.ply"))
    cloud = trimesh.load(file)
    return f"{len(cloud.vertices)} points in {len(np.unique(cloud.colors, axis=0))} colours"


def _rerun(material: Material) -> str:
    from artsim.drawing import write_contact_sheet

    recording = material.folder / "set.rrd"
    write_contact_sheet(material.dataset, material.folder / "sheet.png", 2, rerun=recording)
    return f"a recording of {recording.stat().st_size // 1024} KiB"


def _browser(material: Material) -> str:
    from playwright.sync_api import sync_playwright

    page_file = artsim.make("storage_furniture", 3).show(material.folder / "cabinet.html")
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=program, args=arguments)
        page = browser.new_page()
        page.goto(page_file.resolve().as_uri())
        page.wait_for_selector("body[data-ready=yes]", timeout=60_000)
        sliders = page.locator("input[data-joint]").count()
        name = f"Chromium {browser.version}"
        browser.close()
    return f"a page with {sliders} sliders, in {name}"


Client = tuple[str, str, Callable[[Material], str]]
CLIENTS: tuple[Client, ...] = (
    ("URDF", "pybullet", lambda m: _simulator("pybullet", m)),
    ("URDF", "mujoco", lambda m: _simulator("mujoco", m)),
    ("URDF", "sapien", lambda m: _simulator("sapien", m)),
    ("URDF", "yourdfpy", _yourdfpy),
    ("MJCF", "mujoco", _mjcf),
    ("USD", "usd-core", _usd),
    ("OBJ and MTL", "trimesh", _trimesh),
    ("MJCF, read back", "mujoco", lambda m: _loads_back("mjcf", m)),
    ("USD, read back", "usd-core", lambda m: _loads_back("usd", m)),
    ("GLB with joints, read", "trimesh", _joint_file),
    ("MJCF of a loaded object", "coacd", _pieces),
    ("artsim/Articulated-v0", "gymnasium", _gymnasium),
    ("ArtSimArticulated-v1", "mani_skill", _maniskill),
    ("streams", "torch", _torch),
    ("WebDataset", "webdataset", _webdataset),
    ("COCO", "pycocotools", _coco),
    ("HDF5", "h5py", _hdf5),
    ("BOP", "numpy", _bop),
    ("PLY", "trimesh", _ply),
    ("recordings", "rerun-sdk", _rerun),
    ("pages", "playwright", _browser),
)
"""What is read, the package that reads it, and how."""


@dataclass(frozen=True)
class Options:
    """Other programs on artsim's output."""

    only: tuple[str, ...] = ()
    """Packages to try; by default all."""


def main(options: Options) -> None:
    """Print a table and the JSON line; exit with 1 if a client failed."""
    rows, failed = [], []
    chosen = [client for client in CLIENTS if not options.only or client[1] in options.only]
    with tempfile.TemporaryDirectory() as place:
        material = Material(Path(place))
        for what, package, run in track("clients", chosen, unit="client", leave=False):
            start, said = time.perf_counter(), io.StringIO()
            try:
                own = version(package)
            except PackageNotFoundError:
                own = "-"
            try:
                with redirect_stdout(said), redirect_stderr(said):
                    found = run(material)
            except Exception as error:  # whatever a client raises, the next one is tried
                found = f"FAILED: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
                failed.append(f"{what} by {package}")
            rows.append((what, f"{package} {own}", f"{time.perf_counter() - start:5.1f} s", found))
    widths = [max(len(row[column]) for row in rows) for column in range(3)]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, (*widths, 0), strict=True)).rstrip())
    print(json.dumps({"clients": len(rows), "failed": failed}))
    if failed:
        sys.exit(1)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
