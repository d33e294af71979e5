"""Steps a second of the environments, at 64 points, one core, in one run: ``python -m benchmarks.env_steps``.

*one object at a time* is ``artsim/Articulated-v0``, whose clouds are rendered in each step. *side by side* is
``artsim/Opening-v0``: episodes share objects, and points come from cached rays. Actions are random. The last line is
one JSON object.
"""

import json
import time
from dataclasses import dataclass
from typing import Any

import gymnasium
import tyro

import artsim.envs  # noqa: F401  registers the environments


@dataclass(frozen=True)
class Options:
    """How long each is measured."""

    seconds: float = 10.0


def rate(envs: Any, seconds: float) -> float:
    """Steps of all episodes a second, resets included, once what is compiled is compiled."""
    count, single = getattr(envs, "num_envs", 1), not hasattr(envs, "num_envs")
    envs.action_space.seed(0)
    done, steps, begun = True, 0, 0.0
    while not begun or time.perf_counter() - begun < seconds:
        if done:
            envs.reset(seed=0)
        ended = envs.step(envs.action_space.sample())[2:4]
        done = any(ended) if single else bool(ended[0].all() or ended[1].all())
        steps += count
        if not begun:
            steps, begun = 0, time.perf_counter()
    return steps / (time.perf_counter() - begun)


def main(options: Options) -> None:
    """Measure and print."""
    found = {
        "one object at a time": gymnasium.make("artsim/Articulated-v0", categories=("drawer",), num_points=64),
        "side by side, 1": gymnasium.make_vec("artsim/Opening-v0", 1, pool=8),
        "side by side, 64": gymnasium.make_vec("artsim/Opening-v0", 64),
        "side by side, 64, states": gymnasium.make_vec("artsim/Opening-v0", 64, observe=("state",)),
    }
    rates = {name: round(rate(envs, options.seconds)) for name, envs in found.items()}
    print("| environment | steps/s |\n|---|---|")
    for name, value in rates.items():
        print(f"| {name} | {value:,} |")
    print(json.dumps(rates))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
