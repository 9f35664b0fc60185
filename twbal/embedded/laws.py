"""The law of each kind of saved policy."""

from twbal.core.gaussian import Array
from twbal.embedded.law import Law, Rounding
from twbal.embedded.linear_law import linear_law, linear_rounding
from twbal.embedded.mlp_law import mlp_law, mlp_rounding
from twbal.embedded.rbf_law import rbf_law, rbf_rounding
from twbal.policies.linear import LinearPolicy
from twbal.policies.rbf import RbfPolicy
from twbal.policies.saved import SavedPolicy


def law_of(policy: SavedPolicy) -> Law:
    """As C.

    Raises:
        ConfigError: a constant is beyond single precision.
    """
    if isinstance(policy, RbfPolicy):
        return rbf_law(policy)
    return linear_law(policy) if isinstance(policy, LinearPolicy) else mlp_law(policy)


def rounding_of(policy: SavedPolicy, states: Array) -> Rounding:
    """Commands for states (n, D) that single precision holds exactly, and how far its arithmetic may be off."""
    if isinstance(policy, RbfPolicy):
        return rbf_rounding(policy, states)
    return linear_rounding(policy, states) if isinstance(policy, LinearPolicy) else mlp_rounding(policy, states)
