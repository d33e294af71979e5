"""Objects as files: PartNet-style URDF folders, MJCF, USD and SimReady packages.

All lengths are metres, Z is up and the front towards -X: meshes are written in the object's rest frame, and each link's
frame stands at its joint's origin with the axes of the rest frame. The root link is the robot's base; MJCF and USD fix
it to the world or do not (:class:`ExportOptions`), and for URDF the simulator is asked to.

MuJoCo fuses a link that no joint moves into the world, unless its compiler has ``fusestatic="false"``. The URDF files
say so themselves, in a ``<mujoco>`` element that other programs ignore, and the MJCF files do too.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artsim.common.showing import export_of
from artsim.errors import ConfigError
from artsim.export.loaded import prepare
from artsim.export.looks import MATERIALS_FILE, NO_FINISH, Finish, draw_finish, looks_text, materials_text
from artsim.export.options import ExportOptions
from artsim.export.text import obj_text
from artsim.model.objects import ArticulatedObject
from artsim.model.robot import Robot, as_robot

DEFAULTS = ExportOptions()
FORMATS = {"urdf": "mobility.urdf", "mjcf": "mobility.xml", "usd": "mobility.usda", "usdz": "mobility.usdz",
           "simready": "simready"}  # fmt: skip
"""File written in each format; of SimReady, the folder that holds its package."""
PARAMS_FILE = "params.json"
"""Parameters of a procedural object: ``artsim.load`` makes it again."""


def export(
    obj: ArticulatedObject,
    folder: str | Path,
    formats: Sequence[str] = ("urdf",),
    notes: Mapping[str, Any] | None = None,
    options: ExportOptions = DEFAULTS,
) -> dict[str, Any]:
    """Write an object into a folder.

    ``meta.json``, the ``params.json`` of procedural objects and, for URDF and MJCF, ``meshes/*.obj`` are shared by all
    formats; URDF comes with ``semantics.txt``. The bytes depend on the object and the formats alone.

    Parameters
    ----------
    obj : ArticulatedObject
        With bodies and at rest at q = 0, as :func:`artsim.make` and :func:`prepare` make them.
    folder : path
        Made if missing.
    formats : sequence of str
        Keys of ``FORMATS``.
    notes : mapping, optional
        Further entries of ``meta.json``: how the object came about.
    options : ExportOptions
        How it stands and is driven.

    Returns
    -------
    dict
        Content of ``meta.json``.

    Raises
    ------
    AssetError
        When the object lacks what physics needs.
    ConfigError
        When a format is unknown.
    """
    check_formats(formats)
    folder = Path(folder)
    robot = as_robot(obj)
    folder.mkdir(parents=True, exist_ok=True)
    finish = draw_finish(robot) if options.materials else NO_FINISH
    if "urdf" in formats or "mjcf" in formats:
        _write_meshes(robot, folder / "meshes", finish, apart="mjcf" in formats)
    elif finish.pictures and "usd" in formats:
        _write_pictures(folder / "meshes", finish)
    if "urdf" in formats:
        from artsim.export.urdf import semantics_text, urdf_text

        (folder / FORMATS["urdf"]).write_text(urdf_text(robot))
        (folder / "semantics.txt").write_text(semantics_text(robot))
    if "mjcf" in formats:
        from artsim.export.mjcf import mjcf_text

        (folder / FORMATS["mjcf"]).write_text(mjcf_text(robot, options, finish))
    if "usd" in formats:
        from artsim.export.usd import usd_stage

        stage = usd_stage(robot, options, finish)  # its layer lives as long as the stage
        (folder / FORMATS["usd"]).write_text(stage.GetRootLayer().ExportToString())
    if "usdz" in formats:
        from artsim.export.simready import write_usdz

        write_usdz(robot, folder / FORMATS["usdz"], options, finish)
    if "simready" in formats:
        from artsim.export.simready import write_simready

        write_simready(robot, folder, options, finish if options.materials else draw_finish(robot))
    meta = {**describe(robot, formats), **(notes or {})}
    meta["artsim"] |= asdict(options)
    if obj.params is not None:
        (folder / PARAMS_FILE).write_text(obj.params.to_json() + "\n")
    (folder / "meta.json").write_text(json.dumps(meta, indent=1) + "\n")
    return meta


def check_formats(formats: Sequence[str]) -> None:
    """Refuse formats that cannot be written; raises ConfigError."""
    unknown = sorted(set(formats) - set(FORMATS))
    if unknown or not formats:
        raise ConfigError(f"cannot write formats {unknown}", "formats", f"name some of {', '.join(FORMATS)}")


def describe(robot: Robot, formats: Sequence[str]) -> dict[str, Any]:
    """Content of ``meta.json``: PartNet-Mobility's two keys, and what artsim knows of its own object."""
    obj = robot.obj
    return {
        "model_cat": obj.category,
        "anno_id": obj.object_id,
        "artsim": {
            "version": version("artsim"),
            "formats": [name for name in FORMATS if name in formats],
            # Parts in the object's own order; helpers are links that stand between the two joints of a screw.
            "parts": [part.name for part in obj.parts],
            "helpers": [link.name for link in robot.links if link.part < 0],
            "joints": list(obj.tree.types[1:]),
            "free_joints": len(obj.tree.free_joints),
            "mass_kg": sum(link.inertia.mass for link in robot.links),
            "size_m": (obj.bounds[1] - obj.bounds[0]).tolist(),
            "sha256": obj.sha256,
            # Frames of handles, knobs and panes in the rest frame; "part" counts as "parts" does.
            "details": [detail.to_dict() for detail in obj.details],
        },
    }


def _write_meshes(robot: Robot, folder: Path, finish: Finish, apart: bool) -> None:
    """Meshes of all links; surfaces with a finish in one file for each link and, ``apart``, for each material."""
    folder.mkdir(exist_ok=True)
    for mesh in robot.meshes:
        (folder / f"{mesh.name}.obj").write_text(obj_text(mesh))
    if not finish.materials:
        return
    for name, looks in finish.looks.items():
        (folder / f"{name}.obj").write_text(looks_text(looks))
        for look in looks if apart else ():
            (folder / f"{look.name}.obj").write_text(looks_text([look]))
    (folder / MATERIALS_FILE).write_text(materials_text(finish.materials))
    _write_pictures(folder, finish)


def _write_pictures(folder: Path, finish: Finish) -> None:
    folder.mkdir(exist_ok=True)
    for name, content in finish.pictures.items():
        (folder / name).write_bytes(content)


@export_of.register
def _export_object(obj: ArticulatedObject, folder: str | Path, formats: Sequence[str]) -> dict[str, Any]:
    return export(prepare(obj), folder, formats)


__all__ = ["FORMATS", "export", "prepare"]
