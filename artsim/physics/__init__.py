"""Objects that move under forces: simulation, episodes and recorded motions.

Stable names; the modules of this package are private. PyBullet is imported when a simulation first needs it.
"""

from typing import TYPE_CHECKING

from artsim.common.lazy import lazy_names

if TYPE_CHECKING:
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

_HOMES = {
    "Episode": "episode",
    "EpisodeOptions": "episode",
    "openness": "episode",
    "Motion": "episode_file",
    "follow_points": "episode_file",
    "open_motions": "episode_file",
    "record": "episode_file",
    "PhysicsOptions": "options",
    "Agreement": "simulators",
    "compare_simulators": "simulators",
    "Simulation": "world",
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
