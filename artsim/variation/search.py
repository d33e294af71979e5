"""The search for a variation that passes the gates that its original passes: drawn again, ever more gently."""

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from artsim.errors import ArtsimError, AssetError, ConfigError
from artsim.families import make, varied
from artsim.model.objects import ArticulatedObject, content_sha256
from artsim.model.params import Params
from artsim.runs.recipe import check_seed
from artsim.variation.geometry import centered
from artsim.variation.operations import OPERATIONS
from artsim.variation.standard import Standard

DRAWS = 12
"""Draws at most for one variation."""
_GENTLER = 0.7
"""Strength of a draw over that of the one before."""
_ASIDE = 0.02
"""Standard deviation of the share of the second draw of an object in between."""


@dataclass(frozen=True, eq=False)
class Variation:
    """A variation and how it came about."""

    obj: ArticulatedObject
    operations: tuple[dict[str, Any], ...]
    """What was done, in order: the operation's name, and its numbers in the units of the original."""
    rejected: tuple[str, ...]
    """Gates that earlier draws failed, one entry for each draw."""
    gates: tuple[str, ...]
    """Those that the original passes, and the variation with it."""


def draw_variation(
    obj: ArticulatedObject,
    seed: int = 0,
    others: Sequence[ArticulatedObject] = (),
    standard: Standard | None = None,
    strength: float | None = None,
    towards: tuple[ArticulatedObject, float] | None = None,
) -> Variation:
    """A variation with its record; see :func:`artsim.vary`.

    Parameters
    ----------
    standard : Standard, optional
        That of the object, where it is known.
    strength : float, optional
        Of a procedural object: make it of parameters that are so far from its own, as a share of their ranges.
    towards : (ArticulatedObject, float), optional
        Of a procedural object: make it of parameters between its own and those of another one, at this share.
    """
    check_variable(obj, seed, others)
    if not 0.0 <= (strength or 0.0) <= 1.0:
        raise ConfigError(f"strength {strength} is none", fix="use a number between 0 and 1")
    standard = standard or Standard.of(obj)
    rejected: list[str] = []
    for draw in range(DRAWS):
        rng = np.random.default_rng([int(obj.sha256[:16], 16), seed, draw])
        gentle = _GENTLER**draw
        if strength is None and towards is None:
            made, operations = _draw(obj, rng, gentle, others)
        else:
            try:
                made, operations = _by_parameters(obj, rng, (strength or 0.0) * gentle, towards, draw)
            except AssetError:
                rejected.append("parameters that fit each other")
                continue
        if not operations:
            continue
        made = _named(made, obj, seed, operations)
        failed = standard.failed(made)
        if not failed:
            return Variation(made, tuple(operations), tuple(rejected), standard.gates)
        rejected.append(failed[0])
    counts = ", ".join(f"{gate} {number} times" for gate, number in Counter(rejected).items())
    raise AssetError(
        f"none of {DRAWS} draws of variation {seed} passes the gates that the object passes: {counts} failed",
        f"{obj.category} {obj.object_id}",
        "use another seed",
    )


def check_variable(obj: ArticulatedObject, seed: int, others: Sequence[ArticulatedObject] = ()) -> None:
    """Refuse what has no variation: a rigid object, or parts of other categories."""
    check_seed(seed)
    if obj.is_rigid:
        what, where = "no joint can move: there is no articulated object to vary", f"{obj.category} {obj.object_id}"
        raise AssetError(what, where, "give it a moving joint")
    strange = sorted({other.category for other in others} - {obj.category})
    if strange:
        raise ConfigError(
            f"parts of {', '.join(strange)} do not fit a {obj.category}", "others", "name objects of the same category"
        )


def _draw(
    obj: ArticulatedObject, rng: np.random.Generator, strength: float, others: Sequence[ArticulatedObject]
) -> tuple[ArticulatedObject, list[dict[str, Any]]]:
    """Some operations, one after the other; those that cannot be done are left out."""
    done = []
    chosen = [name for name, (_, share) in OPERATIONS.items() if rng.random() < share]
    for name in chosen or ["stretch"]:
        change = OPERATIONS[name][0](obj, rng, strength, others)
        if change is not None:
            obj, record = change
            done.append({"operation": name, **record})
    return obj, done


def _by_parameters(
    obj: ArticulatedObject,
    rng: np.random.Generator,
    strength: float,
    towards: tuple[ArticulatedObject, float] | None,
    draw: int,
) -> tuple[ArticulatedObject, list[dict[str, Any]]]:
    """The object of other parameters; a share that fails is drawn again, ever farther from where it was."""
    params = of_parameters(obj)
    if towards is not None:
        share = float(np.clip(towards[1] + _ASIDE * draw * rng.standard_normal(), 0.0, 1.0))
        params = params.between(of_parameters(towards[0]), share)
    made = make(varied(params, rng, strength) if strength > 0 else params)
    assert made.params is not None
    old = of_parameters(obj).values
    changed = {name: [old.get(name), value] for name, value in made.params.values.items() if old.get(name) != value}
    return made, [{"operation": "parameters" if towards is None else "between", "values": changed}]


def of_parameters(obj: ArticulatedObject) -> Params:
    """Those of a procedural object; raises ConfigError of any other."""
    if obj.params is None:
        what = "only procedural objects have parameters"
        raise ConfigError(what, f"{obj.category} {obj.object_id}", "name one, such as laptop:3 or its params.json")
    return obj.params


def _named(
    made: ArticulatedObject, original: ArticulatedObject, seed: int, operations: list[dict[str, Any]]
) -> ArticulatedObject:
    """The variation in a rest frame of its own, with a digest of what it came from."""
    source = f"variation {seed} of {original.source}"
    if made.params is not original.params:  # made by its family: its parameters say all of it
        return replace(made, object_id=f"{original.object_id}_{seed}", source=source)
    made = centered(made)
    try:
        content = json.dumps(operations, sort_keys=True).encode()
    except ValueError as error:  # a number that is not finite
        raise ArtsimError(f"an operation has no numbers ({error})", original.object_id) from error
    return replace(
        made,
        object_id=f"{original.object_id}_{seed}",
        sha256=content_sha256([original.sha256.encode(), content]),
        T_base_rest=np.eye(4),
        repairs=(),
        source=source,
        params=None,
        source_joints={joint.name: (k, 1.0) for k, joint in enumerate(made.native_tree.joints) if k > 0},
    )
