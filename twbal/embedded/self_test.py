"""Test vectors and a program that compares them with the header, to run on the robot's board or on any computer."""

from typing import NamedTuple

import numpy as np

from twbal.core.channels import StateTracker
from twbal.core.gaussian import Array
from twbal.core.plant import Observation
from twbal.embedded.c_source import constant_array
from twbal.embedded.header import Exported
from twbal.embedded.laws import rounding_of
from twbal.embedded.working_range import sampled_states

STATES, INSTANTS = 48, 24
"""States whose commands, and instants of one rollout whose states are compared."""
_STATE_TOLERANCE = 1e-5  # of the size of what a channel is made of

_VECTORS = """\
/* What the policy in policy.h must compute. Made with it; do not edit. */
#ifndef TWBAL_POLICY_VECTORS_H
#define TWBAL_POLICY_VECTORS_H

#include "policy.h"

#define TWBAL_VECTORS_STATES {states}
#define TWBAL_VECTORS_INSTANTS {instants}

/* States, their commands [N m], and how far single precision may be off [N m]. */
{arrays}
#endif
"""

PROGRAM = """\
/* Compares policy.h with its test vectors: cc -std=c99 -o policy_selftest policy_selftest.c -lm && ./policy_selftest
 * Exit code 0: all are right. On a board call twbal_policy_selftest(), which returns how many are wrong. */
#include "policy_vectors.h"

static inline int twbal_policy_selftest(void)
{
    int wrong = 0, n, k;
    twbal_policy_memory memory;
    for (n = 0; n < TWBAL_VECTORS_STATES; ++n) {
        float state[TWBAL_POLICY_CHANNELS], off;
        for (k = 0; k < TWBAL_POLICY_CHANNELS; ++k) {
            state[k] = TWBAL_READ(twbal_vectors_states[n * TWBAL_POLICY_CHANNELS + k]);
        }
        off = twbal_policy_command(state) - TWBAL_READ(twbal_vectors_commands[n]);
        wrong += !(fabsf(off) <= TWBAL_READ(twbal_vectors_bounds[n]));
    }
    twbal_policy_reset(&memory);
    for (n = 0; n < TWBAL_VECTORS_INSTANTS; ++n) {
        float given[7], state[TWBAL_POLICY_CHANNELS];
        twbal_observation seen;
        twbal_reference asked;
        for (k = 0; k < 7; ++k) {
            given[k] = TWBAL_READ(twbal_vectors_observations[n * 7 + k]);
        }
        seen.duration = given[0];
        seen.tilt = given[1];
        seen.tilt_rate = given[2];
        seen.acceleration = given[3];
        seen.wheel_angle = given[4];
        seen.wheel_rate = given[5];
        seen.yaw_rate = given[6];
        asked.position = asked.speed = 0.0f;
        asked.gives_way = 0;
        twbal_policy_state(&memory, &seen, &asked, state);
        for (k = 0; k < TWBAL_POLICY_CHANNELS; ++k) {
            const float off = state[k] - TWBAL_READ(twbal_vectors_rollout[n * TWBAL_POLICY_CHANNELS + k]);
            wrong += !(fabsf(off) <= TWBAL_READ(twbal_vectors_tolerances[k]));
        }
        twbal_policy_remember(&memory, TWBAL_READ(twbal_vectors_past_commands[n]));
    }
    return wrong;
}

#ifndef TWBAL_POLICY_NO_MAIN
#include <stdio.h>
int main(void)
{
    const int wrong = twbal_policy_selftest();
    printf("%d commands and %d instants of a rollout: ", TWBAL_VECTORS_STATES, TWBAL_VECTORS_INSTANTS);
    printf("%d wrong\\n", wrong);
    return wrong != 0;
}
#endif
"""


class _Rollout(NamedTuple):
    """A drawn rollout: observations (T, 7), of which the first column is a duration, commands (T,), states (T, D)."""

    observations: Array
    commands: Array
    states: Array


def vectors(exported: Exported, widths: Array, rng: np.random.Generator) -> str:
    """The text of policy_vectors.h.

    Args:
        exported: what policy.h is made of.
        widths: of the working range, (D,).
        rng: that states and observations are drawn from.
    """
    states = sampled_states(widths, STATES, rng)
    expected = rounding_of(exported.policy, states)
    drawn = _rollout(exported, rng)
    tolerances = _STATE_TOLERANCE * (np.abs(drawn.states).max(axis=0) + 1.0)
    arrays = {
        "states": (states, "TWBAL_VECTORS_STATES * TWBAL_POLICY_CHANNELS"),
        "commands": (expected.command, "TWBAL_VECTORS_STATES"),
        "bounds": (1.5 * expected.bound, "TWBAL_VECTORS_STATES"),  # the expected command is rounded, too
        "observations": (drawn.observations, "TWBAL_VECTORS_INSTANTS * 7"),
        "past_commands": (drawn.commands, "TWBAL_VECTORS_INSTANTS"),
        "rollout": (drawn.states, "TWBAL_VECTORS_INSTANTS * TWBAL_POLICY_CHANNELS"),
        "tolerances": (tolerances, "TWBAL_POLICY_CHANNELS"),
    }
    text = "".join(constant_array(f"twbal_vectors_{name}", *what) for name, what in arrays.items())
    return _VECTORS.format(states=STATES, instants=INSTANTS, arrays=text)


def _rollout(exported: Exported, rng: np.random.Generator) -> _Rollout:
    """Observations and commands that are smooth at random, and the states that twbal makes of them."""
    period, most = exported.control_period, exported.policy.max_command
    sizes = np.array([0.2, 1.0, 2.0, 5.0, 5.0, 1.0])
    values = sizes * np.cumsum(rng.normal(size=(INSTANTS, 6)), axis=0) / np.sqrt(INSTANTS)
    values = values.astype(np.float32).astype(np.float64)
    commands = (most * rng.uniform(-1, 1, INSTANTS)).astype(np.float32).astype(np.float64)
    tracker = StateTracker(exported.channels)
    states = [
        tracker.state(Observation(n * period, *map(float, row)), list(commands[:n])) for n, row in enumerate(values)
    ]
    durations = np.full((INSTANTS, 1), period)
    durations[0] = 0.0
    return _Rollout(np.hstack([durations, values]), commands, np.array(states))
