"""What ``artperl estimate`` writes of an estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate as Result
    from artperl.inputs import Cloud


def record_of(result: Result, cloud: Cloud) -> dict[str, Any]:
    """An estimate in JSON's terms, but for the part of every point; null for what is infinite."""
    return {**plain_record(result), "notes": list(cloud.notes), "warnings": [*cloud.warnings, *result.warnings]}


def plain_record(result: Result) -> dict[str, Any]:
    """As :func:`record_of`, of what the estimate itself says."""
    record = {name: _plain(value) for name, value in vars(result).items() if name not in ("part", "part_symptoms")}
    record["state_unit"] = list(result.state_unit)
    return record


def arrays_of(result: Result, cloud: Cloud) -> dict[str, Any]:
    """An estimate as arrays, the part of every point among them."""
    values = {name: value for name, value in vars(result).items() if name not in ("milliseconds", "part_symptoms")}
    values |= {"state_unit": result.state_unit, "warnings": (*cloud.warnings, *result.warnings), "notes": cloud.notes}
    texts = ("joint_type", "part_names", "state_unit", "warnings", "notes", "reference")
    return {name: np.asarray(value, dtype=str if name in texts else None) for name, value in values.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
