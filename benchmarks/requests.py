"""What a request costs: ``python -m benchmarks.requests``.

Ten requests of each category, such as a user would type, are made out of what its first objects are like: numbers of
parts and joints, joint types, lengths a tenth below and above the median, handles, legs, parameters, and two of two at
once. Each is timed over the median plain object of its category, and over the same object made of its parameters, the
fastest of ``repeats`` times; plans and built objects are counted.
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
    ranged: Given = (1.0, None)
    chosen: Request = {"joints": joints[0]}
    alike = [k for k in range(count) if len(made[k]) == joints[0] + 1]
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


def counting(work: Callable[..., Any], count: list[int]) -> Callable[..., Any]:
    """The same function, which counts its calls."""

    def counted(*given: Any) -> Any:
        count[0] += 1
        return work(*given)

    return counted


def main(options: Options) -> None:
    """Print what the module's words say."""
    rows, medians, every, unmet, built = [], {}, [], [], []
    known, build = families.FAMILIES, Assembly.build
    for category in track("categories", options.categories, unit="category"):
        own, plans = [], []
        requests = requests_of(category, options.objects)
        plain = np.median([fastest(options.repeats, families.make, category, seed) for seed in range(len(requests))])
        for seed, request in enumerate(requests):
            planned, made = [0], [0]
            families.FAMILIES = {category: counting(known[category], planned)}
            Assembly.build = counting(build, made)  # type: ignore[method-assign]
            try:
                obj = families.make(category, seed, **request)
            except ConfigError:
                unmet.append(f"{category} {seed}: {request}")
                continue
            finally:
                families.FAMILIES, Assembly.build = known, build  # type: ignore[method-assign]
            plans.append(planned[0])
            built.append(made[0])
            taken = fastest(options.repeats, families.make, category, seed, **request)
            own.append((taken / plain, taken / fastest(options.repeats, families.make, obj.params)))
        medians[category] = np.median(own, axis=0).tolist()
        every += own
        numbers = (*medians[category], max(ratio for ratio, _ in own), np.mean(plans))
        cells = (*(f"{number:.2f}" for number in numbers), f"{max(plans)}", f"{len(own)} of {len(requests)}")
        rows.append((category, *cells))
    heading = ("category", "of a plain one", "of the same", "largest", "plans", "most", "met")
    print("\n".join(table([heading, *rows], most=len(rows))))
    plain_ratio, same_ratio = np.median(every, axis=0).tolist()
    print(json.dumps({"median": plain_ratio, "of_the_same": same_ratio, "met": len(every), "unmet": unmet,
                      "slower": [name for name, ratios in medians.items() if ratios[0] > 1.5],
                      "builds": [min(built), max(built)], "medians": medians}))  # fmt: skip


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
