"""Depth sensors: what a real camera makes of a noise-free scene.

A sensor is a tuple of small steps, applied in order (see :mod:`artsim.observing.noise`). Readings lie on their pixel's
ray: noise changes the depth that is reported there, and may take the return away.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.names import name_fix
from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.observing.noise import (
    AxialNoise,
    DisparityQuantisation,
    EdgeDropout,
    FlyingPixels,
    LateralJitter,
    PixelView,
    Step,
)


@dataclass(frozen=True)
class Sensor:
    """A depth sensor.

    Attributes
    ----------
    name : str
    steps : tuple of Step
        What it does to a noise-free depth image, in order.
    focal : float
        Focal length of the device in pixels. Pixels of a step are the device's: a camera of another resolution sees
        the same noise in metres.
    """

    name: str
    steps: tuple[Step, ...] = ()
    focal: float = 600.0

    def read(self, view: PixelView) -> NDArray[np.float32]:
        """Depth reported at the pixels of a view.

        Parameters
        ----------
        view : PixelView

        Returns
        -------
        (N,) float32
            z-depth in metres, 0 = no return.
        """
        depth = view.depth
        for number, step in enumerate(self.steps):
            depth = step.read(view, depth, self.focal, 10 * number)
        return depth.astype(np.float32)

    def read_image(self, depth: NDArray[np.float32], camera: Camera, key: int) -> NDArray[np.float32]:
        """Depth image reported of a noise-free one.

        Parameters
        ----------
        depth : (H, W) float32
            z-depth in metres, 0 where nothing stands.
        camera : Camera
        key : int
            Of all chance.

        Returns
        -------
        (H, W) float32
            z-depth in metres, 0 = no return.
        """
        nothing = np.zeros(depth.size, dtype=np.uint8)

        def look(row: NDArray[np.int64], column: NDArray[np.int64]) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
            return depth[row, column], nothing[: len(row)]

        row, column = np.divmod(np.arange(depth.size), camera.width)
        return self.read(PixelView(look, camera, row, column, depth.ravel(), key)).reshape(depth.shape)

    def sigma(self, depth: ArrayLike, incidence: ArrayLike = 0.0) -> Array:
        """Standard deviation of a reading on a flat surface, by the closed forms of the steps.

        Parameters
        ----------
        depth : (...) float
            z-depth in metres.
        incidence : (...) float
            Angle between ray and normal, radians.

        Returns
        -------
        (...) float
            Metres.
        """
        z, angle = np.broadcast_arrays(np.asarray(depth, np.float64), np.asarray(incidence, np.float64))
        squares = (np.square(step.sigma(z, angle, self.focal)) for step in self.steps)
        total: Array = np.sqrt(sum(squares, np.zeros_like(z)))
        return total


_KINECT_STEPS = DisparityQuantisation(step_px=1 / 8, baseline=0.075)
_D435_STEPS = DisparityQuantisation(step_px=1 / 32, baseline=0.05)
_D435_FOCAL = 425.0  # 848x480
_D435_SUBPIXEL = 0.08

SENSORS = {
    sensor.name: sensor
    for sensor in (
        Sensor("none"),
        # Nguyen, Izadi and Lovell 2012; quantisation after Handa et al. 2014 and Barron and Malik 2013.
        Sensor(
            "kinect_v1",
            (
                LateralJitter(sigma_px=0.8, grazing_px=0.035),
                _KINECT_STEPS,
                AxialNoise(0.0012, quadratic=0.0019, start=0.4, grazing=0.0001, measured_with=_KINECT_STEPS),
                EdgeDropout(jump=0.05, chance=0.5),
            ),
            focal=585.0,
        ),
        # Intel's RMS of stereo: z^2 subpixel / (focal baseline).
        Sensor(
            "d435",
            (
                LateralJitter(sigma_px=0.5),
                _D435_STEPS,
                AxialNoise(quadratic=_D435_SUBPIXEL / (_D435_FOCAL * _D435_STEPS.baseline), measured_with=_D435_STEPS),
                EdgeDropout(jump=0.05, chance=0.3),
                FlyingPixels(jump=0.02, chance=0.2, reach=0.05),
            ),
            focal=_D435_FOCAL,
        ),
        # Azure Kinect: time of flight, holes where the 3x3 pixels around span more than 0.8 m.
        Sensor(
            "azure",
            (
                LateralJitter(sigma_px=0.25),
                AxialNoise(0.0005, linear=0.001, start=0.5),
                EdgeDropout(jump=0.8, chance=1.0),
                FlyingPixels(jump=0.02, chance=0.3, reach=0.1),
            ),
            focal=505.0,
        ),
        Sensor("gaussian3mm", (AxialNoise(0.003),)),
    )
}
"""Presets by name."""


def find_sensor(noise: str | Sensor) -> Sensor:
    """A preset by name, or the sensor itself.

    Raises
    ------
    ConfigError
        When there is no such preset.
    """
    if isinstance(noise, Sensor):
        return noise
    if noise not in SENSORS:
        raise ConfigError(f"there is no sensor {noise!r}", "noise", name_fix(noise, SENSORS))
    return SENSORS[noise]
