"""The search for a plan, compiled once: manoeuvres as guesses, descent from the best of them, and the choice.

Every target lane has a start: the cheapest of the last plan to that lane and of simple manoeuvres (steer to the lane at
a constant acceleration, from full braking to full throttle). One more start is the cheapest manoeuvre of all, so that a
last plan that got stuck is left behind. All starts descend together. Whatever comes out is driven
within the limits of the car and judged by the cost of `coverdrive.planning.cost` against every box; so are the simple
manoeuvres and the last plans themselves, which are what is left when the descent finds nothing clear.

L = 3 target lanes, B = L + 1 starts, m motions, P = K + 1 states.
"""

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jaxtyping import Bool, Float, Int
from pydantic import Field

from coverdrive.planning.cost import plan_cost
from coverdrive.planning.descent import descend
from coverdrive.planning.merit import Surroundings
from coverdrive.planning.motion import lane_seeking_inputs
from coverdrive.planning.obstacles import clearance_power, own_half_sizes
from coverdrive.planning.problem import ProblemSettings
from coverdrive.planning.vehicle import feasible_inputs, step
from coverdrive.settings import Settings

LANES = 3
"""target lanes of a search: the own one and those beside it"""
STARTS = LANES + 1
"""motions that descend"""


class SearchSettings(Settings):
    """How long the search goes on."""

    tolerance: float = Field(default=3e-3, gt=0)
    """a step of the descent that lowers the merit by a smaller share is the last"""
    braking_guesses: int = Field(default=4, ge=2)
    """number of constant accelerations from full braking to none that are tried as manoeuvres"""


class Wanted(NamedTuple):
    """What is searched for."""

    targets: Float[Array | np.ndarray, " L"]
    """[m] lat of the centres of the target lanes"""
    extra: Float[Array | np.ndarray, " L"]
    """cost of choosing each target lane, on top of its plan's"""
    lane: Int[Array | np.ndarray, " B"]
    """index of the target of each start"""
    starts: Float[Array | np.ndarray, "B U"]
    """inputs of the last plan to each target lane; the last ones count only if ``resumed``"""
    resumed: Bool[Array | np.ndarray, ""]
    """whether the starts are those of an unfinished search, with which no manoeuvre competes"""


class Judged(NamedTuple):
    """Motions within the limits of the car."""

    states: Float[Array, "m P 4"]
    inputs: Float[Array, "m K 2"]
    slack: Float[Array, "m K"]
    off_road: Float[Array, "m K"]
    cost: Float[Array, " m"]
    lasting_cost: Float[Array, " m"]
    """with every slack held until the end; see `coverdrive.planning.motion.Motion`"""


class Found(NamedTuple):
    """The chosen motion, and what the next search starts from."""

    states: Float[Array, "P 4"]
    inputs: Float[Array, "K 2"]
    slack: Float[Array, " K"]
    off_road: Float[Array, " K"]
    cost: Float[Array, ""]
    lane: Int[Array, ""]
    """index of its target"""
    clear: Bool[Array, ""]
    """whether it touches nothing and stays on the road"""
    optimised: Bool[Array, ""]
    """whether it comes out of the descent"""
    descended: Float[Array, "B U"]
    """inputs of all motions that descended"""
    descended_lane: Int[Array, " B"]
    """index of the target of each"""
    best: Float[Array, "L U"]
    """inputs of the cheapest of each target lane"""
    done: Bool[Array, ""]
    """whether the cheapest motion has arrived"""
    iterations: Int[Array, ""]


@partial(jax.jit, static_argnames=("problem", "settings"))
def search(
    around: Surroundings,
    wanted: Wanted,
    iterations: Int[Array | np.ndarray, ""],
    problem: ProblemSettings,
    settings: SearchSettings,
) -> Found:
    """Search for the cheapest plan.

    Args:
        around: what the plan is made for.
        wanted: target lanes and starts.
        iterations: of the descent, at the most.
        problem: horizon, car, weights and shape of the obstacles.
        settings: of the search.
    """
    guesses, of_guess = _manoeuvres(around, wanted.targets, problem, settings)
    simple_inputs = jnp.concatenate([guesses, wanted.starts[:LANES]])
    simple_lane = np.concatenate([of_guess, np.arange(LANES)])
    simple = judge(simple_inputs, wanted.targets[simple_lane], around, problem)
    price = simple.lasting_cost + wanted.extra[simple_lane]
    cheapest = jnp.argmin(jnp.where(np.arange(LANES)[:, None] == simple_lane, price, jnp.inf), 1)
    fresh = jnp.append(cheapest, jnp.argmin(price[: len(guesses)]))
    starts = jnp.where(wanted.resumed, wanted.starts, simple_inputs[fresh])
    lane = jnp.where(wanted.resumed, wanted.lane, jnp.asarray(simple_lane)[fresh])
    target, extra = wanted.targets[lane], wanted.extra[lane]
    descent = descend(starts, target, extra, around, problem, iterations, settings.tolerance)
    optimised = judge(descent.inputs, target, around, problem)
    together = Judged(*(jnp.concatenate(pair) for pair in zip(optimised, simple, strict=True)))
    lanes = jnp.concatenate([lane, jnp.asarray(simple_lane)])
    score = jnp.where(jnp.isfinite(together.lasting_cost), together.lasting_cost, jnp.inf)
    margins = problem.obstacles
    clear = (together.slack.max(-1) <= margins.margin) & (together.off_road.max(-1) <= margins.edge_margin)
    rank = jnp.where(clear, 0.0, _UNCLEAR) + score
    chosen = jnp.argmin(rank + wanted.extra[lanes])
    best = jnp.argmin(jnp.where(jnp.arange(LANES)[:, None] == lanes, rank, jnp.inf), 1)
    flat = jnp.swapaxes(together.inputs, 1, 2).reshape(len(lanes), -1)
    return Found(
        together.states[chosen],
        together.inputs[chosen],
        together.slack[chosen],
        together.off_road[chosen],
        together.cost[chosen],
        lanes[chosen],
        clear[chosen],
        chosen < STARTS,
        descent.inputs,
        lane,
        flat[best],
        descent.done[jnp.argmin(descent.model.value + extra)],
        descent.iterations,
    )


_UNCLEAR = 1e12
"""more than any motion costs; added to the cost of those that are not clear"""


def _manoeuvres(
    around: Surroundings, targets: Float[Array | np.ndarray, " L"], problem: ProblemSettings, settings: SearchSettings
) -> tuple[Float[Array, "m U"], Int[np.ndarray, " m"]]:
    """Inputs of the simple manoeuvres, lane by lane, and the index of each one's target."""
    vehicle = problem.vehicle
    braking = np.linspace(-vehicle.max_deceleration, 0.0, settings.braking_guesses)
    each = np.concatenate([braking, [vehicle.max_acceleration / 2, vehicle.max_acceleration]])
    lane = np.repeat(np.arange(LANES), len(each))
    acceleration = jnp.asarray(np.tile(each, LANES))

    def forward(state: Array, _: None) -> tuple[Array, Array]:
        wish = lane_seeking_inputs(state, targets[lane], acceleration, jnp)
        inputs = feasible_inputs(state, wish, problem.dt, vehicle, jnp)
        return step(state, inputs, problem.dt, jnp), inputs

    start = jnp.tile(around.state, (len(lane), 1))
    _, inputs = jax.lax.scan(forward, start, None, problem.steps)
    return jnp.moveaxis(inputs, 0, 2).reshape(len(lane), -1), lane


def judge(
    inputs: Float[Array, "m U"], target: Float[Array | np.ndarray, " m"], around: Surroundings, problem: ProblemSettings
) -> Judged:
    """Drive inputs as far as the limits of the car allow, and judge the motions.

    Args:
        inputs: of the motions.
        target: [m] lat of the centre of each motion's target lane.
        around: what the motions are made for.
        problem: horizon, car, weights and shape of the obstacles.
    """
    vehicle = problem.vehicle
    wishes = jnp.swapaxes(inputs.reshape(len(inputs), 2, problem.steps), 0, 2).swapaxes(1, 2)

    def forward(state: Array, wish: Array) -> tuple[Array, tuple[Array, Array]]:
        applied = feasible_inputs(state, wish, problem.dt, vehicle, jnp)
        after = step(state, applied, problem.dt, jnp)
        return after, (after, applied)

    start = jnp.tile(around.state, (len(inputs), 1))
    _, (after, applied) = jax.lax.scan(forward, start, wishes)
    states = jnp.swapaxes(jnp.concatenate([start[None], after]), 0, 1)
    driven = jnp.swapaxes(applied, 0, 1)
    least = _least_power(states, around, problem) ** (1 / problem.obstacles.order)
    slack = jnp.maximum(0.0, 1 + problem.obstacles.margin - least)
    half_width = own_half_sizes(states[:, 1:, 3], vehicle, jnp)[1] + problem.obstacles.edge_margin
    beyond = jnp.abs(states[:, 1:, 1] - around.edges.mean()) + half_width - (around.edges[1] - around.edges[0]) / 2
    off_road = jnp.maximum(0.0, beyond)
    cost, lasting_cost = (
        plan_cost(states, driven, each, off_road, around.previous_input, target, problem.cost, jnp)
        for each in (slack, jax.lax.cummax(slack, 1))
    )
    return Judged(states, driven, slack, off_road, cost, lasting_cost)


def _least_power(states: Float[Array, "m P 4"], around: Surroundings, problem: ProblemSettings) -> Float[Array, "m K"]:
    """Least clearance of every step, to the power of the superellipses' order."""
    lon, lat, speed, heading = (states[:, 1:, i, None] for i in range(4))
    own = own_half_sizes(heading, problem.vehicle, jnp)

    boxes = around.boxes
    excess = jnp.maximum(0.0, speed - boxes[4])
    offset, half_sizes = (lon - boxes[0], lat - boxes[1]), (boxes[2], boxes[3])
    return clearance_power(offset, half_sizes, own, excess, problem.vehicle, problem.obstacles).min(-1)
