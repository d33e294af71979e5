"""Speed of data generation: ``python -m benchmarks.generation``.

Times, on the same objects, states and cameras, in one run and on one core: clouds from the embedded ray caster (with
all ground truth) against PyBullet's TinyRenderer (full frame, then the same sampling), and full frames of both; then
the end-to-end rate of two workers onto disk, and the memory of a worker with every real object in rotation. The last
line is one JSON object.
"""

import importlib.util
import json
import multiprocessing
import os
import platform
import resource
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artsim import Camera, StateOptions, ViewOptions, generate, load, make_renderer, observe, sample_state, sample_view
from artsim.common.progress import track
from artsim.datasets.object_cache import ObjectCache
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.loading.sources import find_sources
from artsim.model.kinematics import Array
from artsim.model.object_file import save_object
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import draw_visible
from artsim.renderers.raycast import cast, pose

ASSETS = Path(__file__).resolve().parents[1] / "urdf_assets"
Scene = tuple[ArticulatedObject, Array, Camera]


@dataclass(frozen=True)
class Options:
    """Measure the speed of data generation."""

    views: int = 20
    """Views of each object in the comparison with TinyRenderer."""
    samples: int = 50_000
    """Samples of the end-to-end run."""
    memory_samples: int = 50_000
    """Samples over which a worker's memory is watched."""
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Real objects for the memory measurement; without them the demo objects are used."""


def main(options: Options) -> None:
    """Run all measurements."""
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}")
    objects = [load(path) for path in demo_paths()]
    print("objects: " + ", ".join(f"{o.category} {o.object_id} ({o.num_faces} triangles)" for o in objects))
    scenes = draw_scenes(objects, options.views)
    result = compare_renderers(scenes) | rays_per_second(scenes) | end_to_end(options.samples)
    result |= worker_memory(options)
    print(json.dumps({name: round(value, 3) for name, value in result.items()}))


def demo_paths() -> list[Path]:
    """URDF files of the demo objects: our own, and the Franka Panda that comes with PyBullet."""
    paths = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]
    data = importlib.util.find_spec("pybullet_data")
    if data is not None and data.submodule_search_locations:
        paths.append(Path(data.submodule_search_locations[0]) / "franka_panda" / "panda.urdf")
    return paths


def draw_scenes(objects: list[ArticulatedObject], views: int) -> list[Scene]:
    """The same states and 640x480 cameras for every renderer."""
    rng = np.random.default_rng(0)
    scenes = []
    for obj in objects:
        for _ in range(views):
            q = sample_state(obj, StateOptions(), rng)
            scenes.append((obj, q, sample_view(obj, q, ViewOptions(), rng)))
    return scenes


def seconds_each(name: str, work: Callable[[Scene], object], scenes: list[Scene]) -> float:
    """Mean processor time of a call, after one warm-up of each object. One thread works, so this is one core's time."""
    for obj in dict.fromkeys(scene[0] for scene in scenes):
        work(next(scene for scene in scenes if scene[0] is obj))
    start = time.process_time()
    for scene in track(name, scenes, leave=False):
        work(scene)
    return (time.process_time() - start) / len(scenes)


def compare_renderers(scenes: list[Scene]) -> dict[str, float]:
    """Clouds and frames a second of one core, ray casting against TinyRenderer."""
    raycast, tiny = make_renderer("raycast"), make_renderer("pybullet")

    def tiny_cloud(scene: Scene) -> None:
        obj, q, camera = scene
        frame = tiny.render(obj, q, camera)
        posed = pose(obj, q, camera)
        draw_visible(posed, lambda r, c: (frame.depth[r, c], frame.part_ids[r, c]), 2048, np.random.default_rng(0))

    def tiny_frame(scene: Scene) -> None:
        tiny.render(*scene)

    def ray_cloud(scene: Scene) -> None:
        observe(*scene, rng=np.random.default_rng(0))

    def ray_frame(scene: Scene) -> None:
        raycast.render(*scene)

    seconds = {
        name: seconds_each(name, work, scenes)
        for name, work in {
            "TinyRenderer cloud": tiny_cloud,
            "TinyRenderer frame": tiny_frame,
            "raycast cloud with ground truth": ray_cloud,
            "raycast frame": ray_frame,
        }.items()
    }
    tiny.close()
    print("\nfor each core, 640x480, 2,048 points:")
    for name, value in seconds.items():
        print(f"  {name:34s}{1e3 * value:8.2f} ms {1 / value:9.1f} /s")
    return {
        "clouds_ratio": seconds["TinyRenderer cloud"] / seconds["raycast cloud with ground truth"],
        "frames_ratio": seconds["TinyRenderer frame"] / seconds["raycast frame"],
        "clouds_per_s": 1 / seconds["raycast cloud with ground truth"],
        "frames_per_s": 1 / seconds["raycast frame"],
    }


def rays_per_second(scenes: list[Scene]) -> dict[str, float]:
    """Rays a second of one core in the calls that clouds are made of, over all demo objects."""
    rays, start = 0, time.process_time()
    for obj, q, camera in scenes:
        posed = pose(obj, q, camera)
        first, end = posed.candidates()
        row = np.repeat(np.arange(camera.height), end - first)
        column = np.concatenate([np.arange(a, b) for a, b in zip(first, end, strict=True)])
        cast(posed, row, column)
        rays += len(row)
    rate = rays / (time.process_time() - start)
    print(f"  rays: {rate / 1e6:.1f} M/s, each against all parts it can meet")
    return {"rays_per_s": rate}


def end_to_end(samples: int) -> dict[str, float]:
    """Samples a second with two workers, all ground truth, onto disk."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "dataset"
        sources = find_sources(demo_paths())
        generate(sources, Path(folder) / "warm", num_samples=256, workers=2, progress=False)
        made = generate(sources, out, num_samples=samples, workers=2)
        size = sum(path.stat().st_size for path in out.glob("*.tar"))
        write_rate = disk_rate(Path(folder))
    rate = samples / made.seconds
    print(f"\nend to end, 2 workers: {rate:.0f} samples/s, start-up and loading of the objects included")
    print(
        f"  {size / samples / 1e3:.1f} kB a sample, {size / made.seconds / 1e6:.0f} MB/s; "
        f"the disk takes {write_rate:.0f} MB/s"
    )
    return {"end_to_end_samples_per_s": rate, "bytes_per_s": size / made.seconds, "disk_mb_per_s": write_rate}


def disk_rate(folder: Path) -> float:
    """MB/s of writing 256 MB and flushing it to the disk."""
    block = os.urandom(1 << 20)
    start = time.perf_counter()
    with (folder / "block").open("wb") as file:
        for _ in range(256):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
    return 256 * 1.048576 / (time.perf_counter() - start)


def worker_memory(options: Options) -> dict[str, float]:
    """Resident memory of a process that does a worker's work, with every object in rotation.

    It runs in a child so that this process's own memory does not count.
    """
    context = multiprocessing.get_context("spawn")
    sources = find_sources([options.partnet] if options.partnet else demo_paths())
    with tempfile.TemporaryDirectory() as folder:
        # Objects are loaded by one process and read, compiled, by another: a worker does not load.
        with ProcessPoolExecutor(1, context) as loader:
            keys = loader.submit(_compile_all, [s.path for s in sources], Path(folder)).result()
        with ProcessPoolExecutor(1, context) as worker:
            peak, early, late = worker.submit(_watch_memory, Path(folder), keys, options.memory_samples).result()
    shown = "real objects" if options.partnet else "demo objects (ARTSIM_PARTNET_DIR is not set)"
    print(f"\nworker with all {shown} in rotation, {options.memory_samples} samples: peak {peak:.0f} MB")
    print(f"  resident after a fifth of the samples {early:.0f} MB, at the end {late:.0f} MB")
    return {"worker_peak_mb": peak, "worker_early_mb": early, "worker_late_mb": late}


def _watch_memory(folder: Path, keys: list[str], samples: int) -> tuple[float, float, float]:
    cache, renderer, early = ObjectCache(folder), make_renderer("raycast"), 0.0
    for i in track("memory", range(samples), leave=False):
        # As a plan does: a few objects take turns for a while, then the next few.
        group, slot = divmod(i, 256)
        obj = cache[keys[(group * 16 + slot % 16) % len(keys)]]
        draw_sample(obj, SampleOptions(), 0, i, renderer)
        if i == samples // 5:
            early = resident_mb()
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3, early, resident_mb()


def _compile_all(paths: list[Path], folder: Path) -> list[str]:
    for i, path in enumerate(paths):
        save_object(load(path), folder / f"{i}.npz")
    return [f"{i}.npz" for i in range(len(paths))]


def resident_mb() -> float:
    """Resident memory of this process now."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
