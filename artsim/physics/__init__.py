"""Objects that move under forces: simulation, episodes and recorded motions.

Stable names; the modules of this package are private. PyBullet is imported when a simulation first needs it.
"""

from artsim.physics.episode import Episode, EpisodeOptions, openness
from artsim.physics.episode_file import Motion, follow_points, open_motions, record
from artsim.physics.options import PhysicsOptions
from artsim.physics.simulators import Agreement, compare_simulators
from artsim.physics.world import Simulation

__all__ = [
    "Agreement",
    "Episode",
    "EpisodeOptions",
    "Motion",
    "PhysicsOptions",
    "Simulation",
    "compare_simulators",
    "follow_points",
    "open_motions",
    "openness",
    "record",
]
