"""``artperl estimate``: the poses of objects in users' files, one by one or a folder of them."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from itertools import tee
from typing import TYPE_CHECKING, Any

from artperl.commands.estimate_many import with_warnings
from artperl.commands.estimate_options import EstimateOptions
from artperl.commands.estimate_scene import estimate_scene, is_image_pair
from artperl.commands.estimators import estimator_folder
from artperl.commands.resumed_lines import line_name
from artsim.common.files import read_json
from artsim.common.outputs import check_output, write_output
from artsim.common.program import STDOUT
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.export.folders import new_folder

if TYPE_CHECKING:
    from artperl.methods.protocol import Method

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Estimate(EstimateOptions):
    """Estimate the poses of the parts of an object, and list them: by name, with states, limits and boxes.

    From a cloud: artperl estimate cloud.ply --category laptop --view out.html

    From a depth image: artperl estimate depth.png --mask mask.png --intrinsics camera.json --category laptop

    All objects of an image: artperl estimate image.png depth.png --intrinsics camera.json --picture boxes.png

    From several sides of an object that stands still: artperl estimate left.ply right.ply --poses poses.json

    From a folder, or several files, one line of JSON each: artperl estimate FOLDER --category laptop --out poses.jsonl

    From a dataset or its shards, in four processes: artperl estimate DATASET --category laptop --out poses.jsonl
    --workers 4, or on a cluster, --ray auto. A line names the shard and the sample.

    Clouds: .npy and .npz (N, 3), (N, 4 or more) of which the first three columns count, (H, W, 3), or records with
    x, y, z; .ply; .pcd; .xyz .txt .csv .pts .asc with any separator; vertices of .obj .stl .off. Camera frame (x right,
    y down, z forward), metres: see --unit and --camera. Points at exactly 0 0 0, or not finite, are left out.

    Depth images, with --intrinsics: 16-bit .png, .tif, .pgm, .pfm; .npy and .npz (H, W). Whole numbers are millimetres,
    floats metres: see --unit and --depth-scale. 0, NaN and 65535 are no measurement. Depth is taken along the camera's
    axis: see --depth-kind.

    Masks: .png .bmp .gif .tif .pgm .jpg .webp in any mode, .npy, .npz, .json of Segment Anything. The object is what is
    neither black nor transparent; of a JPEG, or a soft mask, what is over half; of artsim's own part_mask.png what is
    not 255.

    Intrinsics: .json of artsim (fx, fy, cx, cy, or K), BOP (camera.json, scene_camera.json), Open3D, RealSense, Azure
    Kinect, ROS CameraInfo, NeRF (transforms.json); .yaml of ROS and OpenCV; a 3 x 3 matrix as .txt, .npy or .npz. The
    centre of the first pixel is at 0.5 in artsim's and NeRF's files, and at 0 in all others: see --pixel-center.

    Detections: COCO's results, a list of image_id, category (or category_id beside categories), score, segmentation
    (run lengths or polygons) or bbox (left, top, width, height). The file may hold those of other images, too:
    --image-id.

    Results are in metres and radians: part_names, joint_type, state and joint_limits (K, 2; those of the reference;
    null where there is none) with state_unit, rotation, translation and size of each box, T_camera_part, confidence,
    warnings.
    """

    def run(self) -> None:
        inputs = (*self.clouds, self.intrinsics, self.mask, self.detections, self.poses)
        for path in (self.out, self.view, self.picture):
            if path not in (None, STDOUT):
                check_output(path, inputs)
        for path in inputs:  # before torch is imported, which takes seconds
            if path is not None and not (path.exists() or path.is_symlink()):
                raise ConfigError("there is no such file or folder", path, "check its name")
        pair = self.poses is None and is_image_pair(self.clouds)
        if self.detections is not None or self.detector is not None or pair:
            estimate_scene(self)
            return
        if self.picture is not None or self.estimators or self.skip_bad:
            raise ConfigError(
                "these are of an image of several objects", "picture, estimators, skip_bad",
                "name the image in colour, then the depth image, and add --intrinsics camera.json",
            )  # fmt: skip
        several = len(self.clouds) != 1 or self.clouds[0].is_dir() or self.clouds[0].suffix == ".tar"
        several = several and self.poses is None
        self._check(several)
        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        folder = estimator_folder(self.category).absolute()
        from artperl.methods.estimator_files import load_estimator

        load = partial(load_estimator, folder, method=self.method, **told)
        if several:
            self._estimate_all(load)
        else:
            self._estimate_one(load())

    def _check(self, several: bool) -> None:
        kinds = (".jsonl",) if several else (".json", ".npz")
        if self.out is not None and self.out != STDOUT and self.out.suffix not in kinds:
            raise ConfigError(
                f"{self.out} is no {' or '.join(kinds)} file", "out",
                f"name one for {'several files' if several else 'one file'}, or - for JSON",
            )  # fmt: skip
        if not several and (self.workers != 1 or self.ray is not None):
            raise ConfigError("one cloud takes one process", "workers, ray", "leave them out")
        if self.workers != 1 and self.ray is not None:
            raise ConfigError("a cluster has its own processes", "workers, ray", "leave one of them out")
        if several and self.view is not None:
            raise ConfigError("a page shows one object", "view", "give one file, or leave it out")
        if several and (self.urdf or self.mjcf or self.usd):
            raise ConfigError(
                "an object is written of one cloud", "urdf, mjcf, usd", "give one file, or leave them out"
            )

    def _estimate_one(self, estimator: Method) -> None:
        from artperl.core.confidence import LIKELY
        from artperl.evaluation.estimate_page import page
        from artperl.inputs import read_cloud
        from artperl.methods.views import estimate_views, merge_clouds

        file, clouds = self.clouds[0], [read_cloud(file, self.input_options()) for file in self.clouds]
        notes = [text for cloud in clouds for text in cloud.notes]
        for text in notes:
            log.info("note: %s", text)
        points: Any = [cloud.points for cloud in clouds]
        if self.poses is None:
            points = points[0]
            result = estimator(points)
        else:
            poses = read_json(self.poses, "list of camera poses", ConfigError)
            result, points = estimate_views(estimator, points, poses), merge_clouds(points, poses)
        for cloud in reversed(clouds):
            result = with_warnings(result, cloud)
        folders = {"urdf": self.urdf, "mjcf": self.mjcf, "usd": self.usd}
        for folder in dict.fromkeys(folder for folder in folders.values() if folder is not None):
            formats = [kind for kind, given in folders.items() if given == folder]
            with new_folder(folder) as part:
                result.export(part, formats, result.reference.partition(":")[0] or self.category, file.stem)
        if self.view is not None:
            write_output(self.view, page(result, points, f"{file.name}: {self.category}").encode())
        for text in result.warnings:
            log.warning(text)
        if result.confidence < LIKELY:
            log.warning(
                "the estimate is more likely wrong than right. Fix: look at it with --view; try another mask or view, "
                "or --seen-from"
            )
        if self.out == STDOUT:
            print(json.dumps(result.to_dict() | {"notes": notes}))
            return
        print(replace(result, warnings=()))
        if self.out is not None:
            result.save(self.out, notes)

    def _estimate_all(self, load: Callable[[], Method]) -> None:
        """A line of JSON for each cloud, written as soon as it is known, so that Ctrl-C loses nothing."""
        from artperl.commands.estimate_many import Clouds, Estimating
        from artperl.commands.resumed_lines import Lines
        from artsim.runs.each import each

        options = self.input_options()
        clouds = Clouds.of(self.clouds, options, (self.intrinsics, self.mask, self.out))
        setup = {"estimator": self.category, "seen_from": self.seen_from, **vars(options)}
        with Lines(None if self.out in (None, STDOUT) else self.out, setup) as lines:
            failed, done, total = 0, lines.done(), len(clouds)
            if done:
                log.info(f"note: {len(done)} lines are in {self.out} already")
            asked, told = tee(entry for entry in clouds if line_name(entry.file, entry.sample) not in done)
            if self.ray is not None:  # processes of nodes run in folders of their own
                options, asked = options.absolute(), (replace(own, file=own.file.absolute()) for own in asked)
            records = each(Estimating(load, options), asked, self.workers, self.ray)
            with closing(records), track("estimate", total=total, initial=len(done), unit="cloud") as progress:
                for entry, record in zip(told, records, strict=True):
                    failed += "error" in record
                    lines.write(entry.file, record, entry.sample)
                    progress.update()
        if failed:
            kind = "clouds" if clouds.shards else "files"
            log.error(f"{failed} of {total} {kind} failed; each line with an 'error' says why")
            sys.exit(1)
