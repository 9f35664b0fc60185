"""The drive of each wheel, from the command to its hinge, one physics step at a time. Compiled; see `ground_truth`."""

import numpy as np

from twbal.core.compiled import kernel
from twbal.virtual_robot.robot_constants import Memory, RobotConstants

_LEAST_SUPPLY = 0.1  # of the full one: a battery does not turn its voltage round


@kernel(is_kept=False)
def latest(m: Memory, commands: np.ndarray, earlier: np.ndarray, period: int, back: int) -> float:
    """The command that is `back` before the last of a control period, or the last of the period before [N·m].

    Args:
        commands: `m.commands` or `m.differences`.
        earlier: `m.earlier_commands` or `m.earlier_differences`.
        period: its number; before the first one, commands are 0.
        back: at most the number of earlier commands in the period, plus one.
    """
    place, count = period % len(commands), m.earlier_count[period % len(commands)] if period >= 0 else 0
    if 0 < back <= count:
        return float(earlier[place, count - back])
    period -= back > count
    return float(commands[period % len(commands)]) if period >= 0 else 0.0


@kernel(is_kept=False)
def queued(c: RobotConstants, m: Memory, commands: np.ndarray, earlier: np.ndarray, number: int) -> float:
    """Mean over physics step `number` of the command that was given a delay before, each held until the next [N·m].

    Before the first command it is 0. A command that begins to act within the step counts for the part that it acts.

    Args:
        commands: `m.commands` or `m.differences`.
        earlier: `m.earlier_commands` or `m.earlier_differences`.
    """
    end = number * c.step - c.delay + c.step
    last = int(np.floor(end / c.period - 1e-9))
    into = since = end - last * c.period
    back = 0
    if last >= 0:
        place = last % len(commands)
        since -= m.begins[place]
        while since <= 0.0 and back < m.earlier_count[place]:  # it has not begun, and the one before goes on
            back += 1
            since = into - m.earlier_begins[place, m.earlier_count[place] - back]
        if since <= 0.0:  # nor has any of the period
            last, back = last - 1, 0
            since = c.step
    acting = latest(m, commands, earlier, last, back)
    before = latest(m, commands, earlier, last, back + 1)
    share = min(since / c.step, 1.0)
    return float(share * acting + (1.0 - share) * before)


@kernel(is_kept=False)
def past_dead_zone(command: float, forward: float, backward: float) -> float:
    """What is left of a command beyond a zone that is as wide as `forward` for positive ones, else as `backward`."""
    return float(max(command - forward, 0.0) + min(command + backward, 0.0))


@kernel(is_kept=False)
def supply(c: RobotConstants, m: Memory) -> float:
    """Share of the full supply that the battery gives, for the motors' torques and what it gave so far."""
    load = (abs(m.torque[0]) + abs(m.torque[1])) / (2.0 * c.limit)
    m.used[0] += load * c.step
    return float(max(1.0 - c.sag_load * load - c.sag_use * m.used[0], _LEAST_SUPPLY))


@kernel(is_kept=False)
def drive_motor(c: RobotConstants, m: Memory, wheel: int, command: float, voltage: float) -> None:
    """Move one motor's torque towards what is asked of it: dead zone, gain and supply, lag, slew limit."""
    asked = c.gain[wheel] * voltage * past_dead_zone(command, c.half_zone_forward, c.half_zone_backward)
    m.lagged[wheel] += c.lag_share * (asked - m.lagged[wheel])
    change = m.lagged[wheel] - m.torque[wheel]
    m.torque[wheel] += min(max(change, -c.slew), c.slew)


@kernel(is_kept=False)
def stribeck(c: RobotConstants, rate: float) -> float:
    """Dry friction while a bearing slides at a steady rate [N·m]: f_c + (f_s - f_c) exp(-(ω / ω_s)²)."""
    return float(c.coulomb + (c.static - c.coulomb) * np.exp(-((rate / c.stribeck_rate) ** 2)))


@kernel(is_kept=False)
def bristle_force(c: RobotConstants, m: Memory, wheel: int, rate: float) -> tuple[float, float, float]:
    """LuGre friction over the next step as a + b ω', and the bristles' relaxation d: z' = (z + h ω') / d.

    dz/dt = ω - σ₀ |ω| z / g(ω), friction σ₀ z + σ₁ dz/dt; implicit in z and ω', so that stiff bristles stay stable.
    """
    level = max(stribeck(c, rate), 1e-12)
    relaxed = 1.0 + c.step * c.bristle_stiffness * abs(rate) / level
    stiff = c.bristle_stiffness + c.bristle_damping / c.step
    constant = (stiff / relaxed - c.bristle_damping / c.step) * m.bristles[wheel]
    return constant, stiff * c.step / relaxed, relaxed


@kernel(is_kept=False)
def hinge_torque(c: RobotConstants, m: Memory, wheel: int, angle: float, rate: float) -> float:
    """Torque in a wheel's hinge over the next step [N·m]; friction, cogging and back-EMF act at the motor's shaft."""
    shaft, shaft_rate = (m.rotor[wheel], m.rotor_rate[wheel]) if c.rotor > 0.0 else (angle, rate)
    motor = m.torque[wheel] + m.random_torque[0] + c.cogging * np.sin(c.cogging_count * shaft + c.cogging_phase[wheel])
    dry, dry_slope, relaxed = 0.0, 0.0, 1.0
    if c.static > 0.0:
        dry, dry_slope, relaxed = bristle_force(c, m, wheel, shaft_rate)
    braking = c.viscous + dry_slope
    if c.rotor > 0.0:
        torque = gear_torque(c, m, wheel, motor - dry, braking, angle, rate)
        shaft_rate = m.rotor_rate[wheel]
    else:
        torque = motor - dry - braking * rate
    m.bristles[wheel] = (m.bristles[wheel] + c.step * shaft_rate) / relaxed
    return torque


@kernel(is_kept=False)
def gear_torque(
    c: RobotConstants, m: Memory, wheel: int, motor: float, braking: float, angle: float, rate: float
) -> float:
    """Torque that the teeth hand on to the wheel [N·m]; moves the rotor by one implicit step.

    Args:
        motor: torque on the rotor at rate 0 [N·m].
        braking: by how much less that is for each rad/s [N·m·s/rad].
        angle: of the wheel relative to the body [rad].
        rate: [rad/s].
    """
    ahead = m.rotor[wheel] - angle
    beyond = ahead - min(max(ahead, -c.half_play), c.half_play)
    push, push_slope = 0.0, 0.0
    if beyond != 0.0:
        push = c.gear_stiffness * (beyond - c.step * rate) - c.gear_damping * rate
        push_slope = c.gear_stiffness * c.step + c.gear_damping
    share = c.step / c.rotor
    turned = (m.rotor_rate[wheel] + share * (motor - push)) / (1.0 + share * (braking + push_slope))
    torque = push + push_slope * turned
    if torque * beyond < 0.0:  # teeth push and never pull
        torque = 0.0
        turned = (m.rotor_rate[wheel] + share * motor) / (1.0 + share * braking)
    m.rotor_rate[wheel] = turned
    m.rotor[wheel] += c.step * turned
    return float(torque)
