"""RobotArm: one arm of seven parts, bolted to a table or a floor among other things, in RGB-D images of a D435.

Its cloud comes from the image as a user's does: depth with noise and missing returns, within a mask whose border is
off, which may lack a piece or take in what is beside it. No ground truth is used but for the mask, which is made worse.
"""

from dataclasses import replace

import numpy as np

from artperl.evaluation.realistic_detections import LEAST_VISIBLE, Flaws, imperfect
from artperl.evaluation.samples import NUM_POINTS, TEST_SEEDS
from artperl.scene.denoise import denoise
from artsim.errors import ConfigError
from artsim.families import make
from artsim.model.draws import StateOptions
from artsim.model.objects import ArticulatedObject
from artsim.observing.interference import FOREIGN
from artsim.observing.sample import Sample
from artsim.scenes import SceneCameraOptions, SceneOptions, SceneRun
from artsim.scenes.ground_truth import SceneView

ARM = "robot_arm"
"""The category of the benchmark."""
_SEED = TEST_SEEDS + 25
"""The first arm of the test seeds that has seven parts in a chain."""
_DISTRACTORS = 5
"""Things around the arm; some stand before it."""
_SCENES = 10
"""Images that are made for each one wanted, at most: of an arm that can be seen, nearly all show enough of it."""
_FEWEST = 64
"""Points of a cloud: with fewer of them nobody would ask for an estimate."""


def seven_part_arm() -> ArticulatedObject:
    """The procedural arm of the benchmark: seven parts in a chain, as the paper's has."""
    return make(ARM, _SEED)


def arm_scenes(arm: ArticulatedObject) -> SceneRun:
    """Scenes of an arm: its states are anywhere above its base.

    It is seen from up to 109 degrees beside its front: the camera from up to 75, as in training, and the arm stands
    turned by up to 34.
    """
    scene = SceneOptions(
        (), obj=(arm,), distractors=_DISTRACTORS, crowded=True, bolted=True, states=StateOptions()
    )  # fmt: skip
    camera = SceneCameraOptions(fov=(43.0, 43.0), azimuth=(-75.0, 75.0), elevation=(10.0, 60.0), fill=(0.6, 0.9))
    return SceneRun(scene, camera, renderer="raycast", noise="d435", misses=True, num_points=64)


def arm_samples(
    arm: ArticulatedObject, views: int, num_points: int = NUM_POINTS, seed: int = TEST_SEEDS
) -> list[Sample]:
    """Clouds of images of an arm, each of a scene of its own; the same ones for the same arguments.

    Images that show less than a tenth of the arm, or of which the mask keeps next to no point, are left out: no
    detector finds the arm there.

    Parameters
    ----------
    arm : ArticulatedObject
    views : int
    num_points : int
        Of a cloud, at most.
    seed : int
        Of the first scene.

    Raises
    ------
    ConfigError
        When next to no image shows the arm.
    """
    run, samples = arm_scenes(arm), list[Sample]()
    for own in range(seed, seed + _SCENES * views):
        (view,) = run.observe(own)
        sample = image_sample(view, num_points, np.random.default_rng([own, 1]))
        samples += [] if sample is None else [sample]
        if len(samples) == views:
            return samples
    raise ConfigError(
        f"{len(samples)} of {_SCENES * views} images show enough of {arm.object_id}",
        "arm",
        "use an arm that is thicker",
    )


def image_sample(view: SceneView, num_points: int, rng: np.random.Generator) -> Sample | None:
    """The cloud of a view's first object within an imperfect mask; None where too little of it shows.

    Points of other things have part :data:`artsim.observing.interference.FOREIGN` and ``npcs`` NaN.
    """
    sample, own = view.samples[0], view.frame.instance_ids == 0
    if sample is None or view.visible_fraction[0] < LEAST_VISIBLE:
        return None
    depth = denoise(view.depth.astype(np.float64), imperfect(own, Flaws(), rng))
    pixels = np.flatnonzero(depth)
    if len(pixels) < _FEWEST:
        return None
    pixels = np.sort(rng.permutation(pixels)[:num_points])
    points = view.camera.unproject(pixels, depth.ravel()[pixels])
    part = np.where(own, view.frame.part_ids, FOREIGN).ravel()[pixels]
    npcs = np.full(points.shape, np.nan)
    for k, T in enumerate(sample.T_camera_part):
        shown = part == k
        own_frame = (points[shown] - T[:3, 3]) @ T[:3, :3]
        npcs[shown] = 0.5 + (own_frame - sample.box_center[k]) / np.linalg.norm(sample.box_size[k])
    return replace(
        sample, points=points.astype(np.float32), part=part.astype(np.uint8), npcs=npcs.astype(np.float32),
        part_mask=None,
    )  # fmt: skip
