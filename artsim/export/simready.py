"""SimReady packages: USD in the folders, with the metadata, labels and picture that NVIDIA's profiles ask for.

Below the object's folder, with the object's name::

    simready/NAME/usd/NAME.usdc
    simready/NAME/usd/textures/*.png
    simready/NAME/usd/.thumbs/256x256/NAME.usdc.png

``simready-validate --profile Robotics-Prop simready/NAME/usd/NAME.usdc`` checks it. :func:`write_usdz` writes one file
with everything but the picture.
"""

import io
import os
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

from PIL import Image

from artsim.common.extras import require_extra
from artsim.export.looks import Finish
from artsim.export.options import ExportOptions
from artsim.export.semantic_labels import category_item
from artsim.export.usd import usd_stage
from artsim.model.robot import Robot
from artsim.observing.portrait import portrait

FOLDER = "simready_usd"
_TEXTURES = "textures"
_THUMBNAIL = 256
_FIXED_TIME = 946_684_800  # the year 2000


def write_simready(robot: Robot, folder: Path, options: ExportOptions, finish: Finish) -> Path:
    """Write the package of an object and return its USD file.

    All bytes but the date in its metadata depend on the object and the options alone; the environment variable
    ``SOURCE_DATE_EPOCH`` sets the date.

    Parameters
    ----------
    robot : Robot
    folder : path
        Of the object.
    options : ExportOptions
    finish : Finish
        Profiles ask for a material on every surface.
    """
    inner, name = folder / "simready" / robot.name / "usd", f"{robot.name}.usdc"
    _write_layer(robot, inner / name, options, finish)
    thumbnail = inner / ".thumbs" / f"{_THUMBNAIL}x{_THUMBNAIL}" / f"{name}.png"
    thumbnail.parent.mkdir(parents=True, exist_ok=True)
    picture = io.BytesIO()
    Image.fromarray(portrait(robot.obj, robot.obj.tree.rest, _THUMBNAIL)).save(picture, "PNG", optimize=True)
    thumbnail.write_bytes(picture.getvalue())
    return inner / name


def write_usdz(robot: Robot, path: Path, options: ExportOptions, finish: Finish) -> None:
    """Write an object with its textures as one file.

    Parameters
    ----------
    robot : Robot
    path : path
    options : ExportOptions
    finish : Finish
    """
    with require_extra("USD files"):
        from pxr import Sdf, UsdUtils
    with tempfile.TemporaryDirectory() as scratch:
        layer = Path(scratch) / f"{path.stem}.usdc"
        _write_layer(robot, layer, options, finish)
        for file in Path(scratch).rglob("*.*"):
            os.utime(file, (_FIXED_TIME, _FIXED_TIME))  # the package keeps times of its files
        UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(layer)), str(path))


def _write_layer(robot: Robot, path: Path, options: ExportOptions, finish: Finish) -> None:
    stage = usd_stage(robot, options, finish, f"./{_TEXTURES}", labelled=True)
    about = metadata(robot)
    known = ("asset_name", "asset_type", "source_file", "usd_date_generated")  # to profiles before 4.0, on top
    stage.GetRootLayer().customLayerData = {"SimReady_Metadata": about, **{name: about[name] for name in known}}
    textures = path.parent / _TEXTURES
    (textures if finish.pictures else path.parent).mkdir(parents=True, exist_ok=True)
    stage.GetRootLayer().Export(str(path))
    for name, content in finish.pictures.items():
        (textures / name).write_bytes(content)


def metadata(robot: Robot) -> dict[str, Any]:
    """What SimReady's provenance asks for, metres and kilograms."""
    from pxr import Gf

    obj = robot.obj
    procedural = obj.source == f"{obj.category}:{obj.object_id}"
    seconds = int(os.environ.get("SOURCE_DATE_EPOCH") or time.time())
    return {
        "author": f"artsim {version('artsim')}",
        "asset_name": robot.name,
        "asset_type": "Prop",
        "asset_license": "Apache-2.0" if procedural else "that of the source file",
        "category": obj.category or "object",
        "source_file": f"artsim {obj.source}" if procedural else Path(obj.source).name or obj.object_id,
        "usd_date_generated": time.strftime("%Y-%m-%d", time.gmtime(seconds)),
        "qcode": category_item(obj.category),
        "rigid_body_count": len(robot.links),
        "asset_extents": Gf.Vec3f(*(obj.bounds[1] - obj.bounds[0]).tolist()),
        "mass": float(sum(link.inertia.mass for link in robot.links)),
    }
