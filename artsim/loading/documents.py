"""An object's file of any format as the links and joints of a URDF document."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

from artsim.common.files import parse_json
from artsim.errors import AssetError, ConfigError
from artsim.loading.akb48 import with_meshes_of_unity
from artsim.loading.meshes import MeshReader, check_shapes
from artsim.loading.mjcf_xml import is_mjcf
from artsim.loading.mobility_json import is_mobility, read_mobility
from artsim.loading.object_files import UNITY
from artsim.loading.shape2motion import is_shape2motion, read_shape2motion
from artsim.loading.urdf_document import UrdfRobot
from artsim.loading.urdf_xml import parse_robot
from artsim.loading.usd_layers import SUFFIXES
from artsim.model.objects import Repair

Document: TypeAlias = tuple[UrdfRobot, list[Repair], list[bytes]]


def read_document(
    data: bytes, file: Path, reader: MeshReader, helpers: Sequence[str], body: str | None = None
) -> Document:
    """Links and joints of a file of any format.

    Parameters
    ----------
    data : bytes
        Content of the file.
    file : Path
    reader : MeshReader
        Reads its meshes.
    helpers : sequence of str
        Links that are known to be without a shape.
    body : str, optional
        Which object of an MJCF or USD scene: see :func:`artsim.loading.scene_objects.chosen`.

    Returns
    -------
    robot : UrdfRobot
        With collision geometry and inertia, of MJCF and USD.
    repairs : list of Repair
    contents : list of bytes
        Of other files that it is made of, but for meshes.

    Raises
    ------
    AssetError
        When the file cannot be read.
    ConfigError
        When MuJoCo (MJCF) or usd-core (USD) is not installed.
    """
    return READERS.get(file.suffix.lower(), _read_xml)(data, file, reader, helpers, body)


def _read_usd(data: bytes, file: Path, reader: MeshReader, helpers: Sequence[str], body: str | None) -> Document:
    from artsim.loading.usd import read_usd

    return read_usd(file, reader.limits, body)


def _read_xml(data: bytes, file: Path, reader: MeshReader, helpers: Sequence[str], body: str | None) -> Document:
    """Links and joints of MJCF or URDF, told by the top element."""
    if is_mjcf(data, file):
        from artsim.loading.mjcf import read_mjcf

        return read_mjcf(data, file, reader, body)
    _refuse_choice(body, file)
    check_shapes(data, file, reader.limits)
    robot, repairs = parse_robot(data, file, reader.limits.max_links, helpers)
    if file.name == UNITY:
        robot = with_meshes_of_unity(robot, repairs)
    return robot, repairs, []


def _read_json(data: bytes, file: Path, reader: MeshReader, helpers: Sequence[str], body: str | None) -> Document:
    """Links and joints of an annotation, told by what it holds."""
    _refuse_choice(body, file)
    try:
        document = parse_json(data)
    except ValueError as error:
        raise AssetError(f"it is not JSON ({error})", file, "restore the file, or make it again") from error
    if is_mobility(document):
        return read_mobility(document, file, reader)
    if is_shape2motion(document):
        return read_shape2motion(document, file, reader)
    raise AssetError(
        "it is JSON without joints in a known format",
        file,
        "pass PartNet-Mobility's mobility_v2.json or mobility_v3.json, or Shape2Motion's motion_attributes.json",
    )


def _refuse_choice(body: str | None, file: Path) -> None:
    if body is not None:
        raise ConfigError(f"body {body!r} is chosen of {file.name}, which holds one object", "body", "leave it out")


READERS = {**dict.fromkeys(SUFFIXES, _read_usd), ".json": _read_json}
"""Readers by the ending of a file's name; files of all other names hold XML."""
