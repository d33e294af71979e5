"""Scenes on disk: drawn, seen and written by worker processes, resumably; see :mod:`artsim.runs.tasks`."""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import tyro

from artsim.datasets.sample_options import SensorName
from artsim.datasets.shards import write_tar
from artsim.loading.sources import find_sources
from artsim.renderers import RendererName
from artsim.runs.recipe import check_counts
from artsim.runs.tasks import Output, Run, RunResult, Task, run_tasks
from artsim.runs.worker import report, stop_if_asked
from artsim.scenes.dataset import DESCRIPTION, FORMAT
from artsim.scenes.ground_truth import SceneView, observe_scene, view_files
from artsim.scenes.random_scene import SceneCameraOptions, SceneOptions, make_scene, scene_camera

Extra = Callable[[SceneView], Mapping[str, bytes]]
"""More files of a view, by name."""


@dataclass(frozen=True)
class SceneRun:
    """How scenes are drawn and seen."""

    scene: Annotated[SceneOptions, tyro.conf.arg(name="")] = field(default_factory=SceneOptions)
    camera: SceneCameraOptions = field(default_factory=SceneCameraOptions)
    views: int = 1
    """Cameras that look at each scene."""
    renderer: RendererName = "sapien"
    """Only sapien, pybullet and pybullet-egl make colour images."""
    rgb_samples: int = 8
    """Pictures that each colour image is the mean of: more give softer shadows and smoother edges."""
    num_points: int = 2048
    """Points of each object's cloud."""
    noise: SensorName = "none"
    """Depth sensor whose noise depth and clouds carry; the ground truth never does."""
    misses: bool = False
    """The sensor gets nothing back from patches of shiny and transparent surfaces."""

    def observe(self, seed: int) -> list[SceneView]:
        """All views of the scene of a seed."""
        scene = make_scene(self.scene, seed)
        cameras = [scene_camera(scene, self.camera, seed, view) for view in range(self.views)]
        return observe_scene(
            scene, cameras, self.num_points, self.renderer, self.noise, seed, self.rgb_samples, self.misses
        )

    def recipe(self) -> dict[str, Any]:
        """All that the files follow from, in JSON's terms: files of objects by name and digest."""
        own = {name: value for name, value in vars(self).items() if name not in ("scene", "camera")}
        scene = {
            name: value for name, value in vars(self.scene).items() if name not in ("objects", "package_root", "obj")
        }
        sources = find_sources(self.scene.objects, self.scene.package_root) if self.scene.objects else []
        objects = [*((s.name, s.sha256) for s in sources), *((obj.object_id, obj.sha256) for obj in self.scene.obj)]
        scene |= {"states": asdict(self.scene.states), "objects": objects}
        return {**own, "scene": scene, "camera": asdict(self.camera)}


def generate_scenes(
    run: SceneRun,
    out: str | Path,
    scenes: int = 1,
    seed: int = 0,
    shard_size: int = 0,
    workers: int = 2,
    extra: Extra | None = None,
    extra_scenes: int = 0,
    progress: bool = True,
) -> RunResult:
    """Write scenes, or resume a run that was stopped, or add to one that is complete.

    The same bytes come out whatever the number of workers and however often the run was stopped. A complete dataset is
    checked and left alone; damaged files are made again.

    Parameters
    ----------
    run : SceneRun
    out : path
        Folder; made if missing.
    scenes : int
        Scenes in all. A larger number adds to what is there.
    seed : int
        Of the first scene; the others count up from it.
    shard_size : int
        Scenes of each tar file; 0 writes a folder for each view.
    workers : int
        Processes.
    extra : callable, optional
        Gives more files for each view of the first ``extra_scenes`` scenes: a function of a module.
    extra_scenes : int
    progress : bool

    Raises
    ------
    ConfigError
        When an option makes no sense, or a scene cannot be made.
    DatasetError
        When the folder holds something else, or is in use.
    KeyboardInterrupt
        On Ctrl-C, after the workers have stopped; the same call resumes.
    """
    start = time.perf_counter()
    check_counts(scenes=scenes, views=run.views, workers=workers)
    check_counts(0, seed=seed, shard_size=shard_size, overviews=extra_scenes)
    folder = Path(out)
    recipe = {
        "format": FORMAT, "artsim_version": version("artsim"), "scenes": scenes, "seed": seed,
        "shard_size": shard_size, "overviews": extra_scenes if extra else 0, **run.recipe(),
    }  # fmt: skip
    tasks, step = dict[str, Task](), shard_size or 1
    for number, first in enumerate(range(seed, seed + scenes, step)):
        end = min(first + step, seed + scenes)
        arguments = run, first, end, number, shard_size > 0, extra, seed + extra_scenes
        tasks[f"{first:06d}-{end:06d}"] = Task(write_scenes, arguments, end - first)
    _, made = run_tasks(Run(folder, recipe, DESCRIPTION, "set of scenes", "scene", "scenes", progress), tasks, workers)
    return RunResult(folder, scenes, made, time.perf_counter() - start)


def write_scenes(
    output: Output, run: SceneRun, first: int, end: int, number: int, as_shard: bool, extra: Extra | None, until: int
) -> list[dict[str, Any]]:
    """The task of some scenes: write them; what the description says of their views."""
    entries = list[dict[str, Any]]()
    where = f"scenes-{number:06d}.tar"

    def views() -> Iterator[tuple[str, dict[str, bytes]]]:
        for seed in range(first, end):
            stop_if_asked()
            for n, view in enumerate(run.observe(seed)):
                key = f"{seed:06d}_{n}"
                entries.append({"key": key, "scene": seed, "view": n, "file": where if as_shard else key,
                                "objects": _objects(view)})  # fmt: skip
                yield key, view_files(view) | dict(extra(view) if extra is not None and seed < until else {})
            report(1)

    if as_shard:
        output.files[where] = write_tar(output.folder / where, views())
    else:
        for key, files in views():
            for name, content in files.items():
                output.write(f"{key}/{name}", content)
    return entries


def _objects(view: SceneView) -> list[dict[str, Any]]:
    """What the description says of each articulated object in a view."""
    return [
        {
            "category": thing.obj.category, "object_id": thing.obj.object_id, "parts": len(thing.obj),
            "visible_fraction": round(float(fraction), 4), "box": [int(v) for v in box],
        }
        for thing, fraction, box in zip(view.scene.instances, view.visible_fraction, view.boxes, strict=True)
    ]  # fmt: skip
