"""The header: a policy and the state that it reads, for a C99 or C++ compiler."""

import hashlib
import re
from typing import NamedTuple

from twbal.core.channels import Channels
from twbal.core.errors import ConfigError
from twbal.core.feed_forward import NO_FEED_FORWARD, FeedForward
from twbal.embedded.c_source import real
from twbal.embedded.laws import law_of
from twbal.embedded.state_assembly import TYPES, state_assembly
from twbal.policies.saved import SavedPolicy

_HEADER = """\
/* A policy of twbal for the robot's own processor: single precision, no allocation. C99 or C++. Do not edit.
 *
 * {origin}
 * {formula}
 * State: {channels}.
 *
 * In a rollout, once in a control period of {period} s:
 *     twbal_policy_memory memory;
 *     twbal_policy_reset(&memory);
 *     ...
 *     command = twbal_policy_step(&memory, &observation, &reference);
 * The command is the sum of both wheels' torques [N m]. It is no number where an observation is none: switch off then.
 */
#ifndef TWBAL_POLICY_H
#define TWBAL_POLICY_H

#include <math.h>

#define TWBAL_POLICY_VERSION 2
#define TWBAL_POLICY_CHANNELS {width}
#define TWBAL_POLICY_LAGS {lags}
#define TWBAL_POLICY_MAX_COMMAND {max_command}
#define TWBAL_POLICY_CONTROL_PERIOD {period}
#define TWBAL_POLICY_ROBOT {robot}
#define TWBAL_POLICY_ID {identity} /* of this very policy; the robot announces it */

#define TWBAL_ASSERT(condition, name) typedef char name[(condition) ? 1 : -1]
#ifdef __AVR__ /* constants stay in flash */
#include <avr/pgmspace.h>
#define TWBAL_FLASH PROGMEM
#define TWBAL_READ(place) pgm_read_float(&(place))
#else
#define TWBAL_FLASH
#define TWBAL_READ(place) (place)
#endif

TWBAL_ASSERT(sizeof(float) == 4, twbal_policy_needs_single_precision);

{constants}
{types}
{helpers}/* The command for a state [N m]. */
static inline float twbal_policy_command(const float state[TWBAL_POLICY_CHANNELS])
{{
    float x[TWBAL_POLICY_CHANNELS];
    int k;
    for (k = 0; k < TWBAL_POLICY_CHANNELS; ++k) {{ /* far out no product may overflow */
        x[k] = state[k] > 1e6f ? 1e6f : (state[k] < -1e6f ? -1e6f : state[k]);
    }}
    {{
{body}
    }}
}}

{assembly}
/* Observation in, command out [N m]. */
static inline float twbal_policy_step(
    twbal_policy_memory* memory, const twbal_observation* seen, const twbal_reference* asked)
{{
    float state[TWBAL_POLICY_CHANNELS];
    float command;
    twbal_policy_state(memory, seen, asked, state);
    command = twbal_policy_command(state);
    if (memory->torque != 0.0f) {{
        command = twbal_policy_within(command + memory->torque, TWBAL_POLICY_MAX_COMMAND);
    }}
    twbal_policy_remember(memory, command);
    return command;
}}

#endif
"""


class Exported(NamedTuple):
    """A policy that is written as a header.

    Attributes:
        policy: the policy.
        channels: that it reads.
        control_period: of the robot [s].
        robot: its name.
        origin: what the header says of where it comes from, in one line.
        feed_forward: of the acceleration of a reference.
    """

    policy: SavedPolicy
    channels: Channels
    control_period: float
    robot: str
    origin: str
    feed_forward: FeedForward = NO_FEED_FORWARD


def header(exported: Exported) -> str:
    """The text of the header.

    Raises:
        ConfigError: the policy reads other channels, or single precision cannot hold a constant.
    """
    policy, channels = exported.policy, exported.channels
    if not isinstance(policy, SavedPolicy):
        raise ConfigError(
            f"A {type(policy).__name__} cannot be exported; expected is a policy of a file: policy=saved "
            "policy.path=<policy.pt>."
        )
    if tuple(policy.channels) != channels.names:
        raise ConfigError(
            f"The policy reads {', '.join(policy.channels)}; the state is {', '.join(channels.names)}. Choose the "
            "state that it was made with by state=..."
        )
    law = law_of(policy)
    units = [unit.replace("²", "^2").replace("·", " ") for unit in channels.units]
    body = "\n".join(f"    {line}" if line else line for line in law.body.splitlines())
    parts = dict(
        formula=law.formula,
        channels=", ".join(f"{name} [{unit}]" for name, unit in zip(channels.names, units, strict=True)),
        period=real(exported.control_period),
        width=len(channels.names),
        lags=len(channels.lags),
        max_command=real(policy.max_command),
        robot='"' + re.sub(r"[^A-Za-z0-9 _.,:;()+-]", "_", exported.robot) + '"',
        constants=law.constants,
        types=TYPES,
        helpers=law.helpers,
        body=body,
        assembly=state_assembly(channels, exported.feed_forward),
    )
    digest = hashlib.sha256(_HEADER.format(identity="", origin="", **parts).encode()).digest()
    number = max(int.from_bytes(digest[:4], "little"), 1)
    return _HEADER.format(identity=f"0x{number:08x}u", origin=_in_a_comment(exported.origin), **parts)


def identity_in(text: str) -> int:
    """The number by which the robot announces the policy of a header: of the law and its state, whatever its origin."""
    found = re.search(r"^#define TWBAL_POLICY_ID 0x([0-9a-f]{8})u", text, flags=re.MULTILINE)
    assert found is not None
    return int(found.group(1), 16)


def _in_a_comment(text: str) -> str:
    plain = "".join(each if " " <= each <= "~" and each not in "?\\" else "_" for each in text)  # "??/" is a backslash
    return plain.replace("*/", "* /").replace("/*", "/ *")
