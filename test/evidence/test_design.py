"""The rows of moves, and their solution, beside plain linear algebra."""

import numpy as np
import pytest
from service import VALVE, made_moves

from valve_friction_ros.evidence import Moves
from valve_friction_ros.evidence.blocks import blocks_of
from valve_friction_ros.evidence.design import design_of, priors, scales_of, with_onsets

WEIGHTS = np.random.default_rng(1)


@pytest.fixture(scope="module", params=[0.4, 3.0], ids=["one preload", "preloads by the hour"])
def design(request):
    moves = Moves.of(made_moves(request.param, lambda hour: 300.0 + 20.0 * hour, noise=10.0))
    scales = scales_of(moves)
    plain = design_of(moves, blocks_of(moves), scales)
    precision = priors(plain, scales, moves, VALVE.travel)
    return with_onsets(plain, moves, scales.place), precision


def test_its_parts_are_those_of_all_rows(design):
    design, precision = design
    rows, weight = design.rows(), WEIGHTS.uniform(0.5, 2.0, design.force.size)
    normal = (rows * weight[:, None]).T @ rows + np.diag(precision)
    right = rows.T @ (weight * design.force)
    values = np.linalg.solve(normal, right)
    parts = design.normal(weight, precision)
    assert design.right(weight * design.force) == pytest.approx(right)
    assert parts.solved(right) == pytest.approx(values, rel=1e-5, abs=0.05)
    assert design.forces(values) == pytest.approx(rows @ values)
    inverse = np.linalg.inv(normal)[design.shared :, design.shared :]
    assert parts.friction_covariance() == pytest.approx(inverse, rel=1e-5)


def test_blocks_hold_both_ways_and_are_bounded_in_number():
    moves = Moves.of(made_moves(40.0, lambda _: 300.0, period=60.0))
    fine, coarse = blocks_of(moves), blocks_of(moves, 30)
    assert fine[-1] > 100
    assert coarse[-1] < 30
    for blocks in (fine, coarse):
        assert set(np.diff(blocks)) == {0, 1}
        for way in (-1, 1):
            assert np.bincount(blocks[moves.direction == way]).min() >= 4
