"""Scenes that the detector which comes with the package learns from."""

from pathlib import Path

from artsim.model.draws import StateOptions
from artsim.scenes import SceneCameraOptions, SceneOptions, SceneRun, generate_scenes

CATEGORIES = ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer", "box", "stapler", "cutter")
"""Those of ArtImage and of ReArtMix."""
_SCENES = SceneOptions(
    CATEGORIES, count=(3, 7), diagonal=(0.18, 0.38), crowded=True, distractors=4, states=StateOptions(),
)  # fmt: skip
_CAMERA = SceneCameraOptions(640, 360, azimuth=(-45.0, 45.0), elevation=(20.0, 48.0))
_VIEWS = 5
"""Of each scene: a scene takes longer to make than to look at."""
_SETS = {
    "depth": (SceneRun(_SCENES, _CAMERA, _VIEWS, "raycast", noise="d435", misses=True, num_points=64), 0, 240),
    "colour": (
        SceneRun(_SCENES, _CAMERA, _VIEWS, "pybullet", 1, noise="d435", misses=True, num_points=64), 100_000, 100
    ),
}  # fmt: skip
"""How scenes are made, the first seed, and how many: a picture in colour takes three times as long as depth alone."""
_SHARD = 10


def make_detector_scenes(folder: Path, share: float = 1.0, workers: int = 2) -> list[Path]:
    """Make the scenes, or go on with them; what is there already is checked and kept.

    Parameters
    ----------
    folder : Path
    share : float
        Of all scenes, for a trial.
    workers : int

    Returns
    -------
    list of Path
        Their folders.
    """
    for name, (run, seed, scenes) in _SETS.items():
        generate_scenes(run, folder / name, max(round(share * scenes), 1), seed, _SHARD, workers)
    return [folder / name for name in _SETS]
