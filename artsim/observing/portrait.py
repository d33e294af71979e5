"""A small picture of an object, each part in a colour of its own, from the front left and above."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from artsim.model.draws import ViewOptions, sample_view
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.annotation import shade_parts
from artsim.renderers import render


def portrait(obj: ArticulatedObject, q: Array, size: int) -> NDArray[np.uint8]:
    """A picture of an object in one state.

    Parameters
    ----------
    obj : ArticulatedObject
    q : (K,) float
    size : int
        Pixels of a side.

    Returns
    -------
    (size, size, 3) uint8
    """
    options = ViewOptions(
        azimuth=(35.0, 35.0), elevation=(25.0, 25.0), fill=(0.95, 0.95), width=2 * size, height=2 * size
    )
    camera = sample_view(obj, q, options, np.random.default_rng(0))
    image = Image.fromarray(shade_parts(render(obj, q, camera), camera))
    return np.asarray(image.resize((size, size), Image.Resampling.LANCZOS))
