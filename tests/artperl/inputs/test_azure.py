"""The calibration that an Azure Kinect keeps in its recordings: numbers as its SDK makes them for each mode."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from artperl.inputs.intrinsics import read_camera
from artperl.inputs.intrinsics_formats import Hints

DEPTH = [0.50127, 0.5032, 0.49252, 0.49259, 6.08, 4.37, 0.236, 6.4, 6.41, 1.22, 0, 0, 6.5e-5, -5.5e-5]
COLOUR = [0.49866, 0.50207, 0.47819, 0.63736, 0.584, -2.49, 1.36, 0.465, -2.33, 1.3, 0, 0, -1.7e-4, 6.5e-4]


def test_each_mode_has_its_own_part_of_the_sensor(tmp_path: Path) -> None:
    file = tmp_path / "calibration.json"
    cameras = [
        {"Intrinsics": {"ModelParameterCount": 14, "ModelParameters": values}, "Location": f"CALIBRATION_{at}"}
        for at, values in (("CameraLocationD0", DEPTH), ("CameraLocationPV0", COLOUR))
    ]  # fmt: skip
    file.write_text(json.dumps({"CalibrationInformation": {"Cameras": cameras}}))
    for size, expected in {
        # The SDK's cx * side - crop - 0.5 counts from the middle of the first pixel, 0.5 from its corner.
        (640, 576): (504.34, 504.41, 321.30, 335.28),
        (320, 288): (252.17, 252.21, 160.65, 167.64),
        (1024, 1024): (504.34, 504.41, 513.30, 515.28),
        (1280, 720): (612.08, 611.87, 638.28, 361.99),
        (2048, 1536): (979.33, 978.98, 1021.26, 771.18),
    }.items():
        camera = read_camera(file, Hints(size=size))
        assert camera.K[[0, 1, 0, 1], [0, 1, 2, 2]] == pytest.approx(expected, abs=0.02)
        assert np.array_equal(camera.K[2], [0, 0, 1])
        assert "lens distortion" in camera.warnings[0]
