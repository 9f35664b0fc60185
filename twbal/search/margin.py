"""Robots that change: what a policy that already balances its robot is to balance, too.

A battery runs down, a load is moved, a cable makes the sensors noisier, somebody pushes. So robots are drawn with more
doubt than what is known of them now, with commands that are later, with more noise, and with a push at the start.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twbal.core.robot_parameters import RobotParameters
from twbal.planar.linearised import sampled_with_delay, torque_response
from twbal.planar.parameters import PlanarParameters
from twbal.planar.robot_distribution import RobotDistribution, prior_of
from twbal.search.planar_rollouts import PlanarDraws


@dataclass(frozen=True)
class Margin:
    """By how much robots change.

    Attributes:
        doubt: of their parameters, beyond that of what is known: as a share of the standard deviations that the sheet
            alone leaves.
        delay: by which their commands are later, from none to so many control periods.
        noise: factor on that of their sensors.
        push: impulse at the axle at the start, on every other robot, forward and backward in turn, for each kg of the
            body [N·s/kg].
        push_duration: [s].
    """

    doubt: float
    delay: float
    noise: float
    push: float
    push_duration: float

    def models(
        self, known: RobotDistribution, count: int, rng: np.random.Generator, doubt: float
    ) -> list[PlanarParameters]:
        """`count` changed robots; `doubt` is as of `RobotDistribution.models`."""
        sheet = prior_of(known.robot)
        variances = dict(zip(sheet.fields, np.diag(sheet.covariance), strict=True))
        doubts = [variances.get(field, 0.0) for field in known.fields]  # the sheet says nothing of some
        wide = replace(known, covariance=known.covariance + self.doubt**2 * np.diag(doubts))
        late = self.delay * known.robot.control_period * rng.uniform(size=count)
        drawn = wide.models(count, rng, doubt)
        return [
            model._replace(actuation_delay_delay=model.actuation_delay_delay + later)
            for model, later in zip(drawn, late.tolist(), strict=True)
        ]

    def draws(
        self, drawn: PlanarDraws, models: Sequence[PlanarParameters], robot: RobotParameters, ages: int
    ) -> PlanarDraws:
        """The draws of rollouts with more noise, and pushes at the start.

        A robot that is pushed stands still at its balance before. Slow torques change its rates as those of `drawn`.

        Args:
            drawn: of rollouts of as many robots without.
            models: that changed.
            robot: its sheet.
            ages: how many past commands the linear models about the balance look at.
        """
        drawn = drawn._replace(sensors=self.noise * drawn.sensors)
        if not self.push:
            return drawn
        period = robot.control_period
        steps = max(round(self.push_duration / period), 1)
        torque = self.push * robot.body_mass * robot.wheel_radius / (steps * period)  # of the force about the contact
        start, jolts = drawn.start.copy(), drawn.jolts.copy()
        for number, model in enumerate(models):
            if number % 2:
                outside = torque if number % 4 == 1 else -torque  # on the wheels
                start[number] = (sampled_with_delay(model, period, ages).true_balance, 0.0, 0.0)
                jolts[number, :steps] += torque_response(model, period) @ np.array([0.0, outside])
        return drawn._replace(start=start, jolts=jolts)
