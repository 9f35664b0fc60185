"""From observations to the state, as C: what `core.channels.StateTracker` does.

The tracker knows from the beginning whether it has a reference. The C knows once that has moved: a policy on board has
one always, and it rests where the robot is just to stand.
"""

from twbal.core.channels import DRIVING_INTEGRAL, Channels
from twbal.core.feed_forward import FeedForward
from twbal.core.motion_profile import STILL
from twbal.embedded.c_source import real

_MEASURED = {
    "tilt": "seen->tilt - tilt",
    "tilt_rate": "seen->tilt_rate - tilt_rate",
    "acceleration": "seen->acceleration - acceleration",
    "speed": "speed - asked->speed + TWBAL_POLICY_HEIGHT * tilt_rate",
    "yaw_rate": "seen->yaw_rate",
    "position": "memory->position",
    "position_integral": "memory->integral",
}

TYPES = """\
/* What the sensors say at one control instant; signs as in twbal: forward is positive, a lean forward too. */
typedef struct {
    float duration;     /* since the observation before [s]; 0 in the first */
    float tilt;         /* of the body from the vertical [rad] */
    float tilt_rate;    /* [rad/s] */
    float acceleration; /* of the axle, mean over the last control period [m/s^2]; 0 where no channel needs it */
    float wheel_angle;  /* mean of both encoders, wheel relative to body [rad] */
    float wheel_rate;   /* [rad/s] */
    float yaw_rate;     /* to the left [rad/s]; 0 where no channel needs it */
} twbal_observation;

/* The moving place that the robot follows; all zero: it stays where it was put. */
typedef struct {
    float position; /* [m] */
    float speed;    /* [m/s] */
    int gives_way;  /* not 0: it waits for a robot that cannot follow, and the position's integral does not grow */
} twbal_reference;

/* What a rollout remembers. */
typedef struct {
    int started;
    int follows;    /* not 0: the reference has moved since the rollout began */
    int gave_way;
    float origin;   /* path at the first observation [m] */
    float position; /* less that of the reference, at the last observation [m] */
    float integral; /* of the position [m s] */
    float asked;    /* speed of the reference at the last observation [m/s] */
    float gained;   /* its acceleration then [m/s^2] */
    float torque;   /* that this acceleration needs, which is added to the command [N m] */
    float commands[TWBAL_POLICY_LAGS > 0 ? TWBAL_POLICY_LAGS : 1]; /* less such torques, newest first [N m] */
} twbal_policy_memory;
"""

_CONSTANTS = """\
/* What the reference's acceleration needs: lean [rad] and torque [N m] for each m/s^2, how far the axle is behind for
 * each rad of lean [m], and largest acceleration [m/s^2] and jerk [m/s^3] that count. All 0: nothing is fed forward. */
#define TWBAL_POLICY_LEAN {lean}
#define TWBAL_POLICY_TORQUE {torque}
#define TWBAL_POLICY_HEIGHT {height}
#define TWBAL_POLICY_MAX_ACCELERATION {acceleration}
#define TWBAL_POLICY_MAX_JERK {jerk}
"""

_RESET = """\
/* Begin a rollout. */
static inline void twbal_policy_reset(twbal_policy_memory* memory)
{
    int k;
    memory->started = memory->follows = memory->gave_way = 0;
    memory->origin = memory->position = memory->integral = 0.0f;
    memory->asked = memory->gained = memory->torque = 0.0f;
    for (k = 0; k < TWBAL_POLICY_LAGS; ++k) {
        memory->commands[k] = 0.0f;
    }
}
"""

_STATE = """\
static inline float twbal_policy_within(float value, float most)
{{
    return value > most ? most : (value < -most ? -most : value);
}}

/* What is beyond is a jump, which is not fed forward. */
static inline float twbal_policy_no_jump(float value, float most)
{{
    return fabsf(value) <= most ? value : 0.0f;
}}

/* The state at one instant; observations come in order. */
static inline void twbal_policy_state(
    twbal_policy_memory* memory, const twbal_observation* seen, const twbal_reference* asked,
    float state[TWBAL_POLICY_CHANNELS])
{{
    const float path = {radius} * (seen->wheel_angle + seen->tilt);
    const float speed = {radius} * (seen->wheel_rate + seen->tilt_rate);
    const float gained = seen->duration > 0.0f ? (asked->speed - memory->asked) / seen->duration : 0.0f;
    const float jerk = seen->duration > 0.0f ? (gained - memory->gained) / seen->duration : 0.0f;
    const float acceleration = twbal_policy_no_jump(gained, TWBAL_POLICY_MAX_ACCELERATION);
    const float tilt = TWBAL_POLICY_LEAN * acceleration;
    const float tilt_rate = TWBAL_POLICY_LEAN * twbal_policy_no_jump(jerk, TWBAL_POLICY_MAX_JERK);
    if (!memory->started) {{
        memory->started = 1;
        memory->origin = path;
    }}
    if (!memory->gave_way || memory->position * memory->integral < 0.0f) {{
        const int faster = fabsf(memory->asked) > {still} || (memory->follows && fabsf(memory->position) > {radius});
        memory->integral = twbal_policy_within(
            memory->integral + seen->duration * (faster ? {driving} : 1.0f) * memory->position, {bound});
    }}
    memory->follows = memory->follows || asked->position != 0.0f || asked->speed != 0.0f;
    memory->position = path - memory->origin - (asked->position - TWBAL_POLICY_HEIGHT * tilt);
    memory->gave_way = asked->gives_way;
    memory->asked = asked->speed;
    memory->gained = gained;
    memory->torque = TWBAL_POLICY_TORQUE * acceleration;
    (void)speed;
    (void)tilt_rate;
{channels}
}}
"""

_REMEMBER = """\
/* Tell the command that the motors were given, which the state has as past command. */
static inline void twbal_policy_remember(twbal_policy_memory* memory, float command)
{
    int k;
    for (k = TWBAL_POLICY_LAGS - 1; k > 0; --k) {
        memory->commands[k] = memory->commands[k - 1];
    }
    memory->commands[0] = command - memory->torque;
}
"""


def state_assembly(channels: Channels, feed_forward: FeedForward) -> str:
    """Functions that begin a rollout, make its states and remember its commands."""
    lags = channels.lags
    sources = {**_MEASURED, **{name: f"memory->commands[{lag - 1}]" for name, lag in lags.items()}}
    lines = [f"    state[{number}] = {sources[name]}; /* {name} */" for number, name in enumerate(channels.names)]
    texts = {"radius": channels.wheel_radius, "bound": channels.max_position_integral}
    texts |= {"driving": DRIVING_INTEGRAL, "still": STILL}
    constants = _CONSTANTS.format(**{name: real(value) for name, value in feed_forward._asdict().items()})
    state = _STATE.format(**{name: real(value) for name, value in texts.items()}, channels="\n".join(lines))
    return "\n".join([constants, _RESET, state, _REMEMBER])
