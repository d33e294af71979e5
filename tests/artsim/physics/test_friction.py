"""Speeds under friction and motors minimise what they are said to minimise, and obey Coulomb's law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from artsim.physics.friction import held_speeds


@given(st.integers(0, 10_000), st.integers(1, 6), st.floats(0.01, 10.0))
def test_each_impulse_is_full_or_holds_its_speed(seed: int, joints: int, strength: float) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(joints, joints))
    mass, momentum = root @ root.T + 0.1 * np.eye(joints), 3.0 * rng.normal(size=joints)
    target, bound = rng.normal(size=joints), strength * rng.uniform(size=joints)
    speeds = held_speeds(mass, momentum, np.eye(joints), target, bound)
    impulse = mass @ speeds - momentum
    off = speeds - target
    assert np.all(np.abs(impulse) <= bound + 1e-8)
    for pushed, limit, gap in zip(impulse, bound, off, strict=True):
        if abs(gap) > 1e-6:  # what slips is slowed with full strength
            assert pushed == pytest.approx(-np.sign(gap) * limit, abs=1e-6)


def test_speeds_are_the_minimum_of_the_energy() -> None:
    rng = np.random.default_rng(1)
    root, rows = rng.normal(size=(3, 3)), rng.normal(size=(4, 3))  # more combinations than joints
    mass, momentum = root @ root.T + np.eye(3), 2.0 * rng.normal(size=3)
    target, bound = rng.normal(size=4), rng.uniform(0.1, 1.0, size=4)
    free = np.linalg.solve(mass, momentum)

    def energy(v: np.ndarray) -> float:
        return float(0.5 * (v - free) @ mass @ (v - free) + bound @ np.abs(rows @ v - target))

    found = held_speeds(mass, momentum, rows, target, bound)
    best = minimize(energy, free, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14, "maxiter": 20_000})
    assert energy(found) <= best.fun + 1e-9


def test_a_block_slides_on_as_coulomb_says() -> None:
    mass, friction, step = np.array([[2.0]]), 1.5, 0.01
    speed = np.array([1.0])
    for count in range(1, 200):
        speed = held_speeds(mass, mass @ speed, np.eye(1), np.zeros(1), np.array([friction * step]))
        assert speed[0] == pytest.approx(max(0.0, 1.0 - friction / 2.0 * step * count), abs=1e-12)
