"""``artperl estimate``: the poses of objects in users' files, one by one or a folder of them."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tyro

from artsim.common.files import atomic_file, write_atomic
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate as Result
    from artperl.inputs import Cloud, InputOptions
    from artperl.methods.protocol import Method

_STDOUT = Path("-")
_NAMED = 8
"""Files that are named where some are left out."""


@dataclass(frozen=True)
class Estimate:
    """Estimate the poses of the parts of an object, and list them: by name, with states, limits and boxes.

    From a cloud: artperl estimate cloud.ply --category laptop --view out.html

    From a depth image: artperl estimate depth.png --mask mask.png --intrinsics camera.json --category laptop

    From a folder, or several files, one line of JSON each: artperl estimate FOLDER --category laptop --out poses.jsonl

    Clouds: .npy and .npz (N, 3), (N, 4 or more) of which the first three columns count, (H, W, 3), or records with
    x, y, z; .ply; .pcd; .xyz .txt .csv .pts .asc with any separator; vertices of .obj .stl .off. Camera frame (x right,
    y down, z forward), metres: see --unit and --camera. Points at exactly 0 0 0, or not finite, are left out.

    Depth images, with --intrinsics: 16-bit .png, .tif, .pgm, .pfm; .npy and .npz (H, W). Whole numbers are millimetres,
    floats metres: see --unit and --depth-scale. 0, NaN and 65535 are no measurement. Depth is taken along the camera's
    axis: see --depth-kind.

    Masks: .png .bmp .gif .tif .pgm .jpg .webp in any mode, .npy, .npz. The object is what is not black, whatever alpha
    says; of a JPEG what is lighter than 127; of artsim's own part_mask.png what is not 255.

    Intrinsics: .json of artsim (fx, fy, cx, cy, or K), BOP (camera.json, scene_camera.json), Open3D, RealSense, ROS
    CameraInfo, NeRF (transforms.json); .yaml of ROS and OpenCV; a 3 x 3 matrix as .txt, .npy or .npz. The centre of the
    first pixel is at 0.5 in artsim's and NeRF's files, and at 0 in all others: see --pixel-center.

    Results are in metres and radians: part_names, joint_type, state and joint_limits (K, 2; those of the reference;
    null where there is none) with state_unit, rotation, translation and size of each box, T_camera_part, confidence,
    warnings.
    """

    clouds: tyro.conf.Positional[tuple[Path, ...]]
    """Files, or folders of them; all is read in one process."""
    category: str = "laptop"
    """An estimator that comes with the package, by its name; or its folder; or the folder of a training run."""
    out: Path | None = None
    """Write all of it here, as .json or as .npz with the part of every point too; - prints JSON instead of the list. Of
    several files: .jsonl, a line each; the same command goes on where it stopped."""
    view: Path | None = None
    """Write a page for a browser here: the cloud by part, boxes, joint axes, and the way to them."""
    unit: Literal["m", "mm", "cm"] | None = None
    """Unit of the numbers in the file. By default m, and mm for depth images of whole numbers."""
    camera: Literal["opencv", "opengl"] = "opencv"
    """Axes of the camera frame of a cloud: x right, y down, z forward; or, in OpenGL and Blender, y up and z back."""
    intrinsics: Path | None = None
    """Camera of a depth image, which the file is then taken for."""
    mask: Path | None = None
    """Image that is not black where the object is in the depth image; or a folder of them, named as the images."""
    mask_id: str | None = None
    """Which object of the mask: its number, its index in a palette, its colour as R,G,B, or the number of a mask in a
    stack."""
    mask_kind: Literal["auto", "binary", "parts"] = "auto"
    """parts: the object is what is not 255, as in artsim's masks; binary: what is not 0; auto: as the mask looks."""
    depth_scale: float | None = None
    """Number of units (metres, or what --unit says) in one step of the depth image. By default what the intrinsics
    state, for whole numbers; else 0.001 for whole numbers, and 1 for floats."""
    depth_kind: Literal["z", "distance"] = "z"
    """Depth along the camera's axis, or distance along each ray, as some simulators write it. An image does not tell
    which."""
    pixel_center: Literal["0", "0.5"] | None = None
    """Where the intrinsics have the centre of the first pixel. By default as their format has it."""
    image_id: str | None = None
    """Which image of a scene_camera.json; by default that in the depth image's name."""
    seen_from: tuple[float, float] | None = None
    """Azimuths that the camera is known to be within, degrees about the object's vertical, 0 for its front: -75 75 for
    a robot that stands before a cabinet. It is not below the object then. By default it may be anywhere."""
    method: Literal["full", "artperl"] = "full"
    """Method of the estimator: full, which comes with the package; artperl, section 4 of the paper as printed."""

    def run(self) -> None:
        from artperl.estimator import load_estimator

        several = len(self.clouds) != 1 or self.clouds[0].is_dir()
        self._check(several)
        files = self._files() if several else list(self.clouds)
        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        estimator = load_estimator(estimator_folder(self.category), method=self.method, **told)
        if several:
            self._estimate_all(files, estimator)
        else:
            self._estimate_one(files[0], estimator)

    def _check(self, several: bool) -> None:
        kinds = (".jsonl",) if several else (".json", ".npz")
        if self.out is not None and self.out != _STDOUT and self.out.suffix not in kinds:
            raise ConfigError(
                f"{self.out} is no {' or '.join(kinds)} file", "out",
                f"name one for {'several files' if several else 'one file'}, or - for JSON",
            )  # fmt: skip
        if several and self.view is not None:
            raise ConfigError("a page shows one object", "view", "give one file, or leave it out")

    def _options(self) -> InputOptions:
        from artperl.inputs import InputOptions

        return InputOptions(
            unit=self.unit, camera=self.camera, intrinsics=self.intrinsics, mask=self.mask, mask_id=self.mask_id,
            mask_kind=self.mask_kind, depth_scale=self.depth_scale, depth_kind=self.depth_kind,
            pixel_center=self.pixel_center, image_id=self.image_id,
        )  # fmt: skip

    def _estimate_one(self, file: Path, estimator: Method) -> None:
        from artperl.core.listing import full_text
        from artperl.inputs import read_cloud
        from artperl.viewer import page

        cloud = read_cloud(file, self._options())
        for text in cloud.notes:
            print(f"note: {text}", file=sys.stderr)
        result = estimator(cloud.points)
        record = record_of(result, cloud)
        if self.view is not None:
            write_atomic(self.view, page(result, cloud.points, f"{file.name}: {self.category}").encode())
        if self.out == _STDOUT:
            _warn(record["warnings"])
            print(json.dumps(record, indent=1))
            return
        _warn(cloud.warnings)
        print(full_text(result))
        if self.out is not None and self.out.suffix == ".npz":
            with atomic_file(self.out) as out:
                np.savez(out, allow_pickle=False, **arrays_of(result, cloud))
        elif self.out is not None:
            write_atomic(self.out, (json.dumps(record, indent=1) + "\n").encode())

    def _files(self) -> list[Path]:
        """The files to read, those of folders by name; what else is in the folders is said."""
        from artperl.inputs.reading import is_readable

        options, files, skipped = self._options(), list[Path](), list[Path]()
        apart = {path.resolve() for path in (self.intrinsics, self.mask, self.out) if path is not None}
        for path in self.clouds:
            if not path.is_dir():
                files.append(path)
                continue
            for file in sorted(path.iterdir()):
                if file.resolve() in apart or file.name.startswith("."):
                    continue
                (files if file.is_file() and is_readable(file, options) else skipped).append(file)
        if skipped:
            names = ", ".join(path.name for path in skipped[:_NAMED]) + (", ..." if len(skipped) > _NAMED else "")
            kind = "clouds" if self.intrinsics is None else "depth images"
            print(f"note: left out, since they are no {kind}: {names}", file=sys.stderr)
        if not files:
            hint = "" if self.intrinsics else "; depth images need --intrinsics camera.json"
            raise ConfigError(
                "there is no file to estimate",
                self.clouds[0] if self.clouds else None,
                f"name clouds, or a folder of them{hint}",
            )
        return files

    def _estimate_all(self, files: list[Path], estimator: Method) -> None:
        """A line of JSON for each file, written as soon as it is known, so that Ctrl-C loses nothing."""
        from artperl.commands.resumed_lines import Lines

        setup = {"estimator": self.category, "seen_from": self.seen_from, **vars(self._options())}
        with Lines(None if self.out in (None, _STDOUT) else self.out, setup) as lines:
            failed = 0
            done = lines.done()
            if done:
                print(f"note: {len(done)} lines are in {self.out} already", file=sys.stderr)
            for file in track("estimate", files, unit="file"):
                if str(file) in done:
                    continue
                record = self._line(file, estimator)
                failed += "error" in record
                lines.write(file, record)
        if failed:
            print(f"error: {failed} of {len(files)} files failed; each line with an 'error' says why", file=sys.stderr)
            sys.exit(1)

    def _line(self, file: Path, estimator: Method) -> dict[str, Any]:
        from artperl.inputs import read_cloud

        try:
            cloud = read_cloud(file, self._options())
            record = record_of(estimator(cloud.points), cloud)
        except (ArtsimError, OSError) as error:
            return {"error": str(error)}
        except (ArithmeticError, IndexError, RuntimeError, ValueError) as error:
            # One strange file of a thousand must not lose the others; its line names what no check has caught.
            return {"error": f"{file}: no estimate ({type(error).__name__}: {error})"}
        return record


def estimator_folder(name: str) -> Path:
    """Folder of an estimator: one of the package's by its name, a folder of one, or that of a training run.

    Raises
    ------
    ConfigError
        When there is none.
    """
    from artperl.estimator import WEIGHTS, folder_of

    settings = "estimator.json"
    for folder in (folder_of(name), Path(name) / "best"):
        if (folder / settings).is_file():
            return folder
    shipped = ", ".join(sorted(path.parent.name for path in WEIGHTS.glob(f"*/{settings}")))
    what = "holds no estimator" if Path(name).is_dir() else "is no estimator"
    raise ConfigError(
        f"{name!r} {what}",
        "category",
        f"use one that comes with the package ({shipped}), or a folder that train.py wrote",
    )


def record_of(result: Result, cloud: Cloud) -> dict[str, Any]:
    """An estimate in JSON's terms, but for the part of every point; null for what is infinite."""
    record = {name: _plain(value) for name, value in vars(result).items() if name not in ("part", "part_symptoms")}
    record["state_unit"] = list(result.state_unit)
    record["notes"], record["warnings"] = list(cloud.notes), [*cloud.warnings, *result.warnings]
    return record


def arrays_of(result: Result, cloud: Cloud) -> dict[str, Any]:
    """An estimate as arrays, the part of every point among them."""
    values = {name: value for name, value in vars(result).items() if name not in ("milliseconds", "part_symptoms")}
    values |= {"state_unit": result.state_unit, "warnings": (*cloud.warnings, *result.warnings), "notes": cloud.notes}
    texts = ("joint_type", "part_names", "state_unit", "warnings", "notes", "reference")
    return {name: np.asarray(value, dtype=str if name in texts else None) for name, value in values.items()}


def _warn(texts: Iterable[str]) -> None:
    for text in texts:
        print(f"warning: {text}", file=sys.stderr)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
