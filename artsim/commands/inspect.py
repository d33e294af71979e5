"""The verbs ``artsim inspect`` and ``artsim families``: an object, or a category, in words."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from artsim.commands.having import categories_named
from artsim.common.program import Figures
from artsim.common.progress import track
from artsim.loading.roots import Opened


@dataclass(frozen=True)
class Inspect(Figures, Opened):
    """Print an object's tree, joints, limits, boxes, and repairs of the loader."""

    path: tyro.conf.Positional[Path]
    """URDF, MJCF or USD file, GLB or joint file (mobility_v2.json, motion_attributes.json), or its folder."""
    gates: bool = False
    """Also pass the object through the sim-readiness gates, and list what each finds."""

    def run(self) -> None:
        from artsim.drawing.inspect import describe, described
        from artsim.loading.urdf import load

        obj = load(self.path, package_roots=self.package_root, body=self.body)
        figures = described(obj)
        self.say(describe(obj))
        if self.gates:
            from artsim.checks.validity import check_file

            gates = check_file(obj, self.path, self.package_root)
            self.say("\n".join(["\ngates", *(f"  {gate}" for gate in gates)]))
            figures["gates"] = gates
        self.finish(figures)


@dataclass(frozen=True)
class Families(Figures):
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

        names = categories_named(self.names or ("all",))
        for name in track("families", names, unit="family", leave=False):
            self.say(describe_family(name, self.objects))
        self.finish({name: _figures(name, self.objects) for name in names} if self.json else None)


def _figures(category: str, count: int) -> dict[str, Any]:
    """Ranges of numbers of parts and of metres, objects with each joint type and feature, and what a draw may give."""
    from artsim.families.catalogue import seen_of
    from artsim.families.constraints import FEATURES, LENGTHS, described, measured, measured_length

    traces, made = seen_of(category, count)
    numbers = {"parts": [len(own) for own in made]} | {
        name: [measured_length(own, name) for own in made] for name in LENGTHS
    }
    return {
        "objects": count,
        **{name: (min(values), max(values)) for name, values in numbers.items()},
        "joint_types": Counter(kind for own in made for kind in set(own.joint_types[1:])),
        **{name: sum(bool(measured(own, name)) for own in made) for name in FEATURES},
        "parameters": {name: described(draw) for trace in traces for name, draw in trace.drawn.items()},
    }
