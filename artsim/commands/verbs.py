"""Articulated objects, labelled clouds and scenes of them, and everything that checks, shows and converts them.

First steps: artsim generate --categories laptop --num-samples 20 --out out/first; artsim view out/first
"""

from artsim.commands.convert import Convert
from artsim.commands.dataset import Dataset
from artsim.commands.doctor import Doctor
from artsim.commands.export import Export
from artsim.commands.generate import Generate
from artsim.commands.generate_objects import GenerateObjects
from artsim.commands.grasps import Grasps
from artsim.commands.inspect import Families, Inspect
from artsim.commands.record import Record
from artsim.commands.repair import Merge, Repair, Verify
from artsim.commands.scene import Scene
from artsim.commands.vary import Vary
from artsim.commands.view import Gallery, View
from artsim.common.program import run_program

VERBS = {
    "Datasets": (Generate, Dataset, Verify, Repair, Merge, Convert),
    "Objects": (GenerateObjects, Families, Inspect, Export, Vary, Grasps),
    "Scenes and motions": (Scene, Record),
    "Pictures": (View, Gallery),
    "This machine": (Doctor,),
}


def main() -> None:
    """Entry point of the program ``artsim``."""
    run_program(VERBS, "artsim", __doc__)


def generate_main() -> None:
    """Entry point of ``generate.py``."""
    run_program({"": (Generate,)}, "generate.py")
