"""Finished scenes in formats of other programs: COCO's instance masks, and BOP's models, poses and masks of parts.

Each scene is a piece of work; see :mod:`artsim.runs.tasks`.
"""

from functools import lru_cache
from itertools import accumulate
from pathlib import Path
from typing import Any, Literal

import numpy as np

from artsim.common.files import file_sha256
from artsim.errors import DatasetError
from artsim.formats.bop import BopScene, json_bytes, model_file, model_info
from artsim.formats.coco import coco_document, mask_record
from artsim.formats.images import grey_depth, png_bytes
from artsim.runs.tasks import Output, Run, Task, run_tasks
from artsim.runs.worker import report, stop_if_asked
from artsim.scenes.dataset import DESCRIPTION, SceneDataset, SceneRecord
from artsim.scenes.generate import SceneRun
from artsim.scenes.random_scene import make_scene

SceneFormat = Literal["coco", "bop"]
_DONE = "conversion.json"
_VERSION = 1


def convert_scenes(
    run: SceneRun, folder: Path, to: SceneFormat, workers: int = 2, out: Path | None = None, progress: bool = True
) -> Path:
    """Write finished scenes in another format, or resume a conversion that was stopped.

    Parameters
    ----------
    run : SceneRun
        That the scenes were made with: BOP's models are made again from it.
    folder : Path
    to : str
    workers : int
    out : Path, optional
        By default ``<folder>_<to>``.
    progress : bool

    Returns
    -------
    Path
        Where it is.
    """
    source, out = SceneDataset(folder), out or Path(f"{folder}_{to}")
    parts = {entry.scene: sum(obj.parts for obj in entry.objects) for entry in source.entries}
    first = dict(zip(parts, accumulate(parts.values(), initial=1), strict=False))  # number of a scene's first model
    work = {"coco": write_coco, "bop": write_bop}[to]
    tasks = {f"{scene:06d}": Task(work, (folder.absolute(), run, scene, start)) for scene, start in first.items()}

    def finish(values: dict[str, Any], output: Output) -> None:
        (_finish_coco if to == "coco" else _finish_bop)(source, values, output)

    recipe = {"format": to, "version": _VERSION, "scenes": file_sha256(folder / DESCRIPTION)}
    run_tasks(Run(out, recipe, _DONE, "conversion", "scene", progress=progress), tasks, workers, finish)
    return out


_opened = lru_cache(maxsize=1)(SceneDataset)
"""What a worker reads, opened once."""


def _views(source: SceneDataset, scene: int) -> list[tuple[int, SceneRecord]]:
    """Views of a scene, each with its number in the dataset."""
    return [(n, source[n]) for n, entry in enumerate(source.entries) if entry.scene == scene]


def write_coco(output: Output, folder: Path, run: SceneRun, scene: int, start: int) -> list[dict[str, Any]]:
    """The task of a scene: write its images; an entry for each."""
    source = _opened(folder)
    entries = []
    for number, record in _views(source, scene):
        stop_if_asked()
        key, camera = record.entry.key, record.camera
        # Whole millimetres, which every reader takes 16 bits for.
        depth = png_bytes(np.rint(1000.0 * record.depth).clip(0, 65535).astype(np.uint16))
        picture = grey_depth(record.depth) if record.rgb is None else record.rgb
        K = {"K": camera.K.tolist(), "width": camera.width, "height": camera.height}
        output.write(f"images/{key}.png", png_bytes(picture))
        output.write(f"depth/{key}.png", depth)
        output.write(f"intrinsics/{key}.json", json_bytes(K))
        image = {"id": number, "file_name": f"{key}.png", "width": camera.width, "height": camera.height}
        masks = [(i, obj, record.instance_ids == i) for i, obj in enumerate(record.entry.objects)]
        objects = [
            {**mask_record(mask), "iscrowd": 0, "instance": i, "visible_fraction": obj.visible_fraction,
             "name": (obj.category,)}
            for i, obj, mask in masks if mask.any()
        ]  # fmt: skip
        entries.append({"image": image, "objects": objects})
    report(1)
    return entries


def _finish_coco(source: SceneDataset, values: dict[str, Any], output: Output) -> None:
    """Write the list of all images."""
    info = {"description": "scenes of artsim", "version": source.description["artsim_version"]}
    categories: dict[tuple[str, ...], Any] = {
        (name,): {"name": name, "supercategory": "object"} for name in source.categories
    }
    document = coco_document(info, categories, [entry for entries in values.values() for entry in entries])
    output.write("annotations/instances.json", json_bytes(document))


def write_bop(output: Output, folder: Path, run: SceneRun, scene: int, start: int) -> dict[str, Any]:
    """The task of a scene: write it and the models of its objects."""
    source = _opened(folder)
    things = make_scene(run.scene, scene).instances
    first = np.cumsum([start, *(len(thing.obj) for thing in things)]).tolist()
    written, models = BopScene(output, "test", scene), dict[str, Any]()
    for i, thing in enumerate(things):
        for k in np.flatnonzero(thing.obj.has_surface).tolist():
            output.write(*model_file(thing.obj, k, first[i] + k))
            models[str(first[i] + k)] = model_info(thing.obj, k)
    for _, record in _views(source, scene):
        stop_if_asked()
        seen = []
        for i, (thing, sample) in enumerate(zip(things, record.samples, strict=True)):
            if sample is not None and sample.object_sha256 != thing.obj.sha256:
                raise DatasetError(
                    f"object {i} of scene {scene} is not what its options make", folder,
                    "use the options and the version of artsim that the scenes were made with",
                )  # fmt: skip
            if sample is not None:
                seen.append((thing.obj, sample, first[i], thing.T_world_object))
        image = record.entry.view
        written.articulations[str(image)] = written.write_image(image, record.depth, record.rgb, seen)
    report(1)
    return {**written.finish(), "models": models}


def _finish_bop(source: SceneDataset, values: dict[str, Any], output: Output) -> None:
    """Write what all scenes share."""
    models = {number: info for answer in values.values() for number, info in answer["models"].items()}
    targets = [target for answer in values.values() for target in answer["targets"]]
    output.write("models/models_info.json", json_bytes(models))
    output.write("camera.json", json_bytes(next((a["camera"] for a in values.values() if a["camera"]), {})))
    output.write("test_targets_bop19.json", json_bytes(targets))
