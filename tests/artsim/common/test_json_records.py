"""A value of another type than its field is named."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
import pytest

from artsim.common.json_records import SHA256, Pixels, from_json_values

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


@dataclass(frozen=True)
class Bounded:
    """A record whose fields have bounds."""

    width: Pixels
    names: Annotated[tuple[str, ...], range(3)] = ()
    digest: Annotated[str, SHA256] = "0" * 64
    scale: Literal["native"] | tuple[float, float] = "native"
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def test_bounds_of_a_field_hold() -> None:
    full = {"width": 8192, "names": ["a", "b"], "scale": [1, 2.0], "ranges": {"lid": [0, 1]}}
    assert from_json_values(Bounded, full) == Bounded(8192, ("a", "b"), "0" * 64, (1.0, 2.0), {"lid": (0.0, 1.0)})
    wrong = {"width": 0, "names": ["a", "b", "c"], "digest": "0" * 63, "scale": "unit", "ranges": {"lid": [0]}}
    for name, value in [
        *wrong.items(),
        ("width", 8193),
        ("width", True),
        ("digest", "G" * 64),
        ("names", ["a" * 5000]),
    ]:
        with pytest.raises(ValueError, match=f"{name if name != 'ranges' else 'lid'} is "):
            from_json_values(Bounded, full | {name: value})
    with pytest.raises(ValueError, match="width"):
        from_json_values(Bounded, {})
    assert from_json_values(Bounded, full | {"more": 1}, others=True) == from_json_values(Bounded, full)
