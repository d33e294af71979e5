"""The program ``artsim``: datasets, objects, variations, motions and scenes; checks, pictures, other formats."""

from __future__ import annotations

from typing import Annotated

import tyro

from artsim.commands.convert import Convert
from artsim.commands.doctor import Doctor
from artsim.commands.export import Export
from artsim.commands.generate import Generate
from artsim.commands.generate_objects import GenerateObjects
from artsim.commands.inspect import Families, Inspect
from artsim.commands.record import Record
from artsim.commands.repair import Merge, Repair, Verify
from artsim.commands.scene import Scene
from artsim.commands.vary import Vary
from artsim.commands.view import Gallery, View
from artsim.common.program import run_program

Verb = (
    Annotated[Generate, tyro.conf.subcommand("generate")]
    | Annotated[Gallery, tyro.conf.subcommand("gallery")]
    | Annotated[Families, tyro.conf.subcommand("families")]
    | Annotated[GenerateObjects, tyro.conf.subcommand("generate-objects")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Vary, tyro.conf.subcommand("vary")]
    | Annotated[Record, tyro.conf.subcommand("record")]
    | Annotated[Scene, tyro.conf.subcommand("scene")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Inspect, tyro.conf.subcommand("inspect")]
    | Annotated[Verify, tyro.conf.subcommand("verify")]
    | Annotated[Repair, tyro.conf.subcommand("repair")]
    | Annotated[Merge, tyro.conf.subcommand("merge")]
    | Annotated[Convert, tyro.conf.subcommand("convert")]
    | Annotated[Doctor, tyro.conf.subcommand("doctor")]
)


def main() -> None:
    """Entry point of the program ``artsim``."""
    run_program(Verb, "artsim", __doc__)


def generate_main() -> None:
    """Entry point of ``generate.py``."""
    run_program(Generate, "generate.py")
