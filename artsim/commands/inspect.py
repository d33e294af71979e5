"""The verbs ``artsim inspect`` and ``artsim families``: an object, or a category, in words."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.commands.having import categories_named
from artsim.loading.roots import Opened


@dataclass(frozen=True)
class Inspect(Opened):
    """Print an object's tree, joints, limits, boxes, and repairs of the loader."""

    path: tyro.conf.Positional[Path]
    """URDF, MJCF or USD file, GLB or joint file (mobility_v2.json, motion_attributes.json), or its folder."""
    gates: bool = False
    """Also pass the object through the sim-readiness gates, and list what each finds."""

    def run(self) -> None:
        from artsim.drawing.inspect import describe
        from artsim.loading.urdf import load

        obj = load(self.path, package_roots=self.package_root, body=self.body)
        print(describe(obj))
        if self.gates:
            from artsim.checks.validity import check_file

            print("\ngates")
            for gate in check_file(obj, self.path, self.package_root):
                print(f"  {gate}")


@dataclass(frozen=True)
class Families:
    """Print what each procedural category is: parameters, joint types, numbers of parts, handles and legs.

    Numbers and kinds are those seen over the first seeds. Any of them may be asked for with --having.

    Example: artsim families storage_furniture
    """

    names: tyro.conf.Positional[tuple[str, ...]] = ()
    """Categories; by default all of them."""
    objects: int = 20
    """Objects of each that are looked at, seeds counting up from 0."""

    def run(self) -> None:
        from artsim.families.catalogue import describe_family

        for name in categories_named(self.names or ("all",)):
            print(describe_family(name, self.objects))
