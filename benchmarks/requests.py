"""What a request costs: ``python -m benchmarks.requests``.

Ten requests of each category, such as a user would type, are made out of what its first objects are like: numbers of
parts and joints, joint types, lengths a tenth below and above the median, handles, legs, parameters, and two of two at
once. Each is timed against the object of the same seed without a request, the fastest of ``repeats`` times.
"""

import json
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import tyro

import artsim.families as families
from artsim.common.progress import track
from artsim.common.tables import table
from artsim.errors import ConfigError
from artsim.families.catalogue import seen_of
from artsim.families.constraints import AXES, FEATURES, Given, count_parts, measured, measured_length
from artsim.making.assembly import Assembly

Request = dict[str, Given]


@dataclass(frozen=True)
class Options:
    """Time requests."""

    categories: tuple[str, ...] = families.CATEGORIES
    objects: int = 20
    """Of each category, from which requests are made."""
    repeats: int = 3
    list: bool = False
    """Print each request."""


def requests_of(category: str, count: int) -> list[Request]:
    """Ten, the same for the same family; two at once are such that some object has nearly both."""
    traces, made = seen_of(category, count)
    drawn = [trace.drawn for trace in traces]

    def length(name: str, of: Iterable[int] = range(count)) -> float:
        return float(np.median([measured_length(made[k], name) for k in of]))

    kinds = sorted({label for one in made for label in one.labels[1:] if label not in FEATURES})
    numbers = {kind: [count_parts(one, kind) for one in made] for kind in kinds}
    kind = max(kinds, key=lambda kind: (len(set(numbers[kind])), float(np.mean(numbers[kind])), kind))
    parts = sorted(numbers[kind])[count // 2] or max(numbers[kind])
    joints = sorted(len(one) - 1 for one in made)
    types = Counter("+".join(sorted(set(one.joint_types[1:]))) for one in made).most_common(1)[0][0]
    usual = [name for name in drawn[0] if all(name in own for own in drawn) and name not in AXES]
    options = [name for name in usual if drawn[0][name].kind in ("choice", "yes or no")]
    option = next((name for name in options if len({own[name].value for own in drawn}) > 1), None)
    number = next((name for name in usual if drawn[0][name].kind == "number"), None)
    either = [name for name in FEATURES if len({measured(one, name) for one in made}) == 2]
    ranged, chosen, alike = (
        (1.0, None),
        {"joints": joints[0]},
        [k for k in range(count) if len(made[k]) == joints[0] + 1],
    )
    if number:
        ranged = tuple(np.quantile([float(own[number].value) for own in drawn], (0.25, 0.5)).tolist())
    if option:
        chosen = {option: drawn[0][option].value}
        alike = [k for k in range(count) if drawn[k][option].value == drawn[0][option].value]
    return [
        {kind: parts},
        {"joints": joints[count // 2]},
        {"joint_types": set(types.split("+"))},
        {"width": 0.9 * length("width")},
        {"height": 1.1 * length("height")},
        {"depth": (0.9 * length("depth"), 1.1 * length("depth"))},
        {either[-1]: True} if either else {"size": 0.9 * length("size")},
        {number or kind: ranged},
        {**chosen, "size": 1.1 * length("size", alike)},
        {kind: parts, "width": (None, 1.1 * length("width", np.flatnonzero(np.array(numbers[kind]) == parts)))},
    ]


def fastest(repeats: int, make: Callable[..., object], *given: Any, **asked: Any) -> float:
    """Seconds of the processor."""
    taken = []
    for _ in range(repeats):
        start = time.process_time()
        make(*given, **asked)
        taken.append(time.process_time() - start)
    return min(taken)


def main(options: Options) -> None:
    """Print what the module's words say."""
    plans, builds = [0], [0]
    build = Assembly.build

    def built(made: Assembly, category: str, name: str) -> object:
        builds[0] += 1
        return build(made, category, name)

    def counted(family: families.Family) -> families.Family:
        def planned(draws: families.Draws) -> Assembly:
            plans[0] += 1
            return family(draws)

        return planned

    rows, medians, every, unmet, made = [], {}, [], [], []
    for category in track("categories", options.categories, unit="category"):
        own, same, plan = [], [], []
        requests = requests_of(category, options.objects)
        plain = np.median([fastest(options.repeats, families.make, category, seed) for seed in range(len(requests))])
        for seed, request in enumerate(requests):
            plans[0] = builds[0] = 0
            known, Assembly.build = families.FAMILIES, built  # type: ignore[method-assign, assignment]
            families.FAMILIES = {category: counted(known[category])}
            try:
                obj = families.make(category, seed, **request)
            except ConfigError:
                unmet.append(f"{category} {seed}: {request}")
                continue
            finally:
                families.FAMILIES, Assembly.build = known, build  # type: ignore[method-assign]
            plan.append(plans[0])
            made.append(builds[0])
            taken = fastest(options.repeats, families.make, category, seed, **request)
            own.append(taken / plain)
            same.append(taken / fastest(options.repeats, families.make, obj.params))
            if options.list:
                print(f"{category} {seed} {request}: {plans[0]} plans, {own[-1]:.2f}, {same[-1]:.2f}")
        medians[category] = float(np.median(own)), float(np.median(same))
        every += list(zip(own, same, strict=True))
        numbers = (*medians[category], max(own), np.mean(plan))
        rows.append(
            (category, *(f"{number:.2f}" for number in numbers), f"{max(plan)}", f"{len(own)} of {len(requests)}")
        )
    heading = ("category", "of a plain one", "of the same", "largest", "plans", "most", "met")
    print("\n".join(table([heading, *rows], most=len(rows))))
    middle = np.median(every, axis=0).tolist()
    slow = [name for name, (own, _) in medians.items() if own > 1.5]
    print(json.dumps({"median": middle[0], "of_the_same": middle[1], "slower": slow, "met": len(every),
                      "unmet": unmet, "builds": [min(made), max(made)], "medians": medians}))  # fmt: skip


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
