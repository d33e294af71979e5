"""HDF5: one file for each sample, with the keys that BlenderProc's writer uses."""

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import orjson

from artsim.common.extras import require_extra
from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.shards import sample_key, sample_members
from artsim.formats.base import Format, Piece, require_images
from artsim.formats.images import integer_centre_K
from artsim.model.frame import BACKGROUND
from artsim.model.transforms import invert_transform
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output


class Hdf5Format(Format):
    """``<split>/<index>.hdf5``."""

    def check(self, options: SampleOptions, folder: Path) -> None:
        """There must be depth and masks, and h5py."""
        require_images(options, folder, "hdf5", ("depth", "part_mask"))
        with require_extra("hdf5"):
            import h5py  # noqa: F401

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file for each sample."""
        categories = sorted({planned.category for planned in dataset.plan.objects})
        for sample in samples:
            category = categories.index(sample.category) + 1
            output.write(f"{piece.split}/{sample_key(sample.index)}.hdf5", hdf5_bytes(sample, category))
        return None


def hdf5_bytes(sample: Sample, category_id: int) -> bytes:
    """A sample with depth and part mask as an HDF5 file.

    Parameters
    ----------
    sample : Sample
    category_id : int
        Of the object; 0 is the background.

    Notes
    -----
    ``colors`` (H, W, 3) uint8 where recorded; ``depth`` (H, W) float32, metres, 0 = no return;
    ``category_id_segmaps`` and ``instance_segmaps`` (H, W), 0 = background, part k = instance k + 1;
    ``instance_attribute_maps``, ``camera_pose`` and ``artsim`` are JSON: what each instance is, the camera, and the
    sample's whole record.
    """
    with require_extra("hdf5"):
        import h5py
    assert sample.depth is not None
    assert sample.part_mask is not None
    seen = sample.part_mask != BACKGROUND
    images: dict[str, Any] = {} if sample.rgb is None else {"colors": sample.rgb}
    images["depth"] = sample.depth
    images["category_id_segmaps"] = np.where(seen, category_id, 0).astype(np.uint16)
    images["instance_segmaps"] = np.where(seen, sample.part_mask + 1, 0).astype(np.uint8)
    instances = [{"idx": 0, "category_id": 0, "name": "background"}]
    for k, name in enumerate(sample.part_names):
        instances.append({"idx": k + 1, "category_id": category_id, "name": name})
    T_camera_world = invert_transform(sample.T_world_camera)
    camera = {
        "cam_K": integer_centre_K(sample.K).ravel().tolist(),
        "cam_R_w2c": T_camera_world[:3, :3].ravel().tolist(),
        "cam_t_w2c": T_camera_world[:3, 3].tolist(),
    }
    texts = {
        "instance_attribute_maps": orjson.dumps(instances),
        "camera_pose": orjson.dumps(camera),
        "artsim": sample_members(sample)["json"],
    }
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:  # times are not recorded: equal samples have equal bytes
        for key, image in images.items():
            file.create_dataset(key, data=image, compression="gzip", track_times=False)
        for key, text in texts.items():
            file.create_dataset(key, data=np.bytes_(text), track_times=False)
    return buffer.getvalue()
