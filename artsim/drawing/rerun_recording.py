"""Recordings for the rerun viewer: clouds, boxes, joint axes and images on a timeline."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from artsim.common.extras import require_extra
from artsim.common.files import write_error
from artsim.common.names import printable
from artsim.common.palette import PALETTE
from artsim.model.frame import BACKGROUND
from artsim.model.transforms import transform_points
from artsim.observing.annotation import Shown, axis_segment


def write_recording(shown: Sequence[Shown], path: Path) -> None:
    """Write a ``.rrd`` file with one frame of the timeline ``sample`` for each sample; no viewer is started.

    Raises
    ------
    ArtsimError
        When rerun is not installed, or the file cannot be written.
    """
    with require_extra("artsim view --rerun"):
        import rerun as rr
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        recording = rr.RecordingStream("artsim")
        recording.save(str(path))
    except OSError as error:
        raise write_error(error, path) from error
    recording.log("camera", rr.ViewCoordinates.RDF, static=True)
    for number, one in enumerate(shown):
        sample = one.sample
        recording.set_time("sample", sequence=number)
        recording.log("title", rr.TextDocument(one.title))
        recording.log("camera/cloud", rr.Points3D(sample.points, colors=PALETTE[sample.part % len(PALETTE)]))
        rotations = [rr.Quaternion(xyzw=_quaternion(T[:3, :3])) for T in sample.T_camera_part]
        centers = transform_points(sample.T_camera_part, sample.box_center[:, None])[:, 0]
        colours = PALETTE[np.arange(len(rotations)) % len(PALETTE)]
        recording.log(
            "camera/boxes",
            rr.Boxes3D(
                centers=centers,
                half_sizes=0.5 * sample.box_size,
                quaternions=rotations,
                colors=colours,
                labels=[printable(name) for name in sample.part_names],
                show_labels=False,
            ),
        )
        segments = [axis_segment(sample, k) for k in range(1, len(sample.joint_type))]
        origins = np.array([start for start, _ in segments]).reshape(-1, 3)
        vectors = np.array([end - start for start, end in segments]).reshape(-1, 3)
        recording.log("camera/axes", rr.Arrows3D(origins=origins, vectors=vectors, colors=(192, 0, 32)))
        recording.log("camera/image", rr.Pinhole(image_from_camera=sample.K, width=sample.width, height=sample.height))
        recording.log("camera/image/depth", rr.DepthImage(one.frame.depth, meter=1.0))
        # Class 0 is the background for the viewer.
        classes = np.where(one.frame.part_ids == BACKGROUND, 0, one.frame.part_ids + 1).astype(np.uint8)
        recording.log("camera/image/parts", rr.SegmentationImage(classes))
    recording.disconnect()


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(rotation).as_quat()
