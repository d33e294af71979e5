"""The program ``artsim``: datasets, objects, grasps, variations, motions, scenes; checks, pictures, formats."""

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

Verb = (
    Generate | Dataset | Gallery | Families | GenerateObjects | Export | Grasps | Vary | Record | Scene | View | Inspect
    | Verify | Repair | Merge | Convert | Doctor
)  # fmt: skip


def main() -> None:
    """Entry point of the program ``artsim``."""
    run_program(Verb, "artsim", __doc__)


def generate_main() -> None:
    """Entry point of ``generate.py``."""
    run_program(Generate, "generate.py")
