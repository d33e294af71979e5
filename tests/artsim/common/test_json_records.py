"""A value of another type than its field is named."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from artsim.common.json_records import from_json_values

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Limits:
    """A record with a number."""

    upper: float = 1.0


def test_a_value_of_another_type_is_named() -> None:
    from artperl.fitting.options import EstimatorOptions

    assert from_json_values(EstimatorOptions, {"seen_from": [-75, 75.0]}).seen_from == (-75.0, 75.0)
    assert from_json_values(Limits, {"upper": float("inf")}).upper == np.inf
    for name, value in (("beam", True), ("beam", 2.0), ("label_smoothing", 1), ("seen_from", 3), ("seen_from", [1.0]),
                        ("refine", []), ("refine", {"tolerance": "a"}), ("beam", float("nan"))):  # fmt: skip
        with pytest.raises(ValueError, match=r"is |not a set"):
            from_json_values(EstimatorOptions, {name: value})
    with pytest.raises(ValueError, match="no field 'x'"):
        from_json_values(EstimatorOptions, {"x": 1})
