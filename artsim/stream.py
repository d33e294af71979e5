"""On-line training data: fresh procedural objects for ever, nothing on disk. A public name of this module is stable."""

from artsim.datasets.family_stream import FamilyStream

__all__ = ["FamilyStream"]
