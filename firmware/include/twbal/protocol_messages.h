/* Messages of twbal's robot link, version 2; docs/protocol.md says what they mean.
 *
 * Written by scripts/protocol.py.
 * C99 and C++11. Structures are packed and little-endian, as the machines are that this is for; floats are IEEE 754
 * binary32. A `name` or `text` of 200 bytes at most follows the last field, and ends with the payload.
 */
#ifndef TWBAL_PROTOCOL_MESSAGES_H
#define TWBAL_PROTOCOL_MESSAGES_H

#include <stdint.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "twbal's messages are little-endian"
#endif

#define TWBAL_PROTOCOL_VERSION 2u
#define TWBAL_MAX_FRAME 256u /* bytes between two zeros */
#define TWBAL_MAX_TEXT 200u /* bytes */
#define TWBAL_WATCHDOG_US 100000u
#define TWBAL_ON_BOARD_WATCHDOG_US 10000000u

#define TWBAL_TYPE_HELLO 0x01u
#define TWBAL_TYPE_STOP 0x04u
#define TWBAL_TYPE_ARM 0x05u
#define TWBAL_TYPE_COMMAND 0x06u
#define TWBAL_TYPE_FOLLOW 0x07u
#define TWBAL_TYPE_WELCOME 0x81u
#define TWBAL_TYPE_FAULT 0x83u
#define TWBAL_TYPE_POSE_REPORT 0x84u
#define TWBAL_TYPE_TELEMETRY 0x85u

/* What makes a robot's time advance. */
#define TWBAL_CLOCK_LOCKSTEP 0u
#define TWBAL_CLOCK_REAL_TIME 1u

/* What drives the motors of an armed robot. */
#define TWBAL_DRIVE_TORQUE 0u
#define TWBAL_DRIVE_VOLTAGE 1u
#define TWBAL_DRIVE_ON_BOARD 2u

/* State of the motors; without ARMED they are off. */
#define TWBAL_STATUS_ARMED 1u
#define TWBAL_STATUS_TILT_STOPPED 2u
#define TWBAL_STATUS_WATCHDOG_STOPPED 4u
#define TWBAL_STATUS_SENSOR_STOPPED 8u
#define TWBAL_STATUS_ON_BOARD 16u
#define TWBAL_STATUS_HOST_SILENT 32u
#define TWBAL_STATUS_LIMITED 64u

/* What a robot measures; a value without its bit is absent, and NaN in the telemetry. */
#define TWBAL_SENSORS_TILT 1u
#define TWBAL_SENSORS_TILT_RATE 2u
#define TWBAL_SENSORS_ACCELERATION 4u
#define TWBAL_SENSORS_WHEEL_ANGLE 8u
#define TWBAL_SENSORS_WHEEL_RATE 16u
#define TWBAL_SENSORS_WHEEL_DIFFERENCE 32u
#define TWBAL_SENSORS_DIFFERENCE_RATE 64u
#define TWBAL_SENSORS_YAW_RATE 128u
#define TWBAL_SENSORS_HEADING 256u
#define TWBAL_SENSORS_BATTERY 512u

#pragma pack(push, 1)

/* Host: are you there, and do we speak the same version? Switches the motors off. */
typedef struct {
    uint8_t type;                    /* 0x01 */
    uint16_t seq;                    /* number of the message */
    uint16_t version;                /* of the protocol that the host speaks */
} twbal_hello;

/* Host: switch the motors off. */
typedef struct {
    uint8_t type;                    /* 0x04 */
    uint16_t seq;                    /* number of the message */
} twbal_stop;

/* Host: the robot stands at its start; switch the motors on, at zero torque. */
typedef struct {
    uint8_t type;                    /* 0x05 */
    uint16_t seq;                    /* number of the message */
    uint32_t trial;                  /* number of the rollout; a simulated robot draws its start pose and noise from it */
    uint8_t drive;                   /* what drives: 0 torques, 1 voltages, 2 the policy on board */
} twbal_arm;

/* Host: what the wheels get from now on. */
typedef struct {
    uint8_t type;                    /* 0x06 */
    uint16_t seq;                    /* number of the message */
    float total;                     /* N·m or V; right plus left, positive drives forward */
    float difference;                /* N·m or V; right minus left, positive turns to the left */
} twbal_command;

/* Host: the reference from now on, for the policy on board. */
typedef struct {
    uint8_t type;                    /* 0x07 */
    uint16_t seq;                    /* number of the message */
    float position;                  /* m; along the robot's own way, from where it was armed */
    float speed;                     /* m/s */
    float heading;                   /* rad; from that at arming, positive to the left; NaN: do not control it */
    float yaw_rate;                  /* rad/s */
    uint8_t gives_way;               /* not 0: it waits for a robot that cannot follow, and integrals do not grow */
} twbal_follow;

/* Robot: who I am. Of an unknown version only the version is read, the rest stays empty. */
typedef struct {
    uint8_t type;                    /* 0x81 */
    uint16_t seq;                    /* number of the message */
    uint16_t version;                /* of the protocol that the robot speaks */
    uint32_t control_period_us;      /* µs */
    float torque_limit;              /* N·m; greatest sum of both wheels */
    uint8_t clock;                   /* 0 lockstep, 1 real time */
    float difference_limit;          /* N·m; greatest difference of the wheels; 0: it does not turn */
    float voltage_limit;             /* V; greatest of a motor; NaN: it takes no voltages */
    uint16_t sensors;                /* what it measures, as bits */
    uint32_t policy;                 /* first 4 bytes of the SHA-256 of the policy on board; 0: there is none */
    uint32_t firmware;               /* changes with every build of the firmware; 0: unknown */
    /* char name[]: of the robot */
} twbal_welcome;

/* Robot: your message cannot be followed, and why. */
typedef struct {
    uint8_t type;                    /* 0x83 */
    uint16_t seq;                    /* number of the message */
    /* char text[]: why */
} twbal_fault;

/* Robot: where it truly is at the instant of the telemetry that follows, as twbal.core.plant.Pose says. */
typedef struct {
    uint8_t type;                    /* 0x84 */
    uint16_t seq;                    /* number of the message */
    uint16_t period;                 /* of the telemetry that follows */
    float x;                         /* m; forward, of the middle of the axle, from where it was armed */
    float y;                         /* m; to the left */
    float heading;                   /* rad; positive to the left */
    float tilt;                      /* rad; of the body */
} twbal_pose_report;

/* Robot: what the sensors say at the beginning of a control period, and what was done in the one before. */
typedef struct {
    uint8_t type;                    /* 0x85 */
    uint16_t seq;                    /* number of the message */
    uint16_t period;                 /* control periods since arming, modulo 2¹⁶ */
    uint32_t time_us;                /* µs; robot's own clock, modulo 2³² */
    uint8_t status;                  /* state of the motors, as bits */
    float tilt;                      /* rad */
    float tilt_rate;                 /* rad/s */
    float acceleration;              /* m/s²; of the axle, forward, mean over the last control period */
    float wheel_angle;               /* rad; mean of both wheels, relative to the body */
    float wheel_rate;                /* rad/s; of that */
    float wheel_difference;          /* rad; right wheel minus left wheel */
    float difference_rate;           /* rad/s; of that */
    float yaw_rate;                  /* rad/s; about the vertical, positive to the left */
    float heading;                   /* rad; the robot's own estimate, from that at arming */
    float battery;                   /* V */
    float applied;                   /* unit of the commands; sum applied in the last period, after all limits */
    float applied_difference;        /* the same of the difference */
    uint32_t command_us;             /* µs; robot's clock when it took the last command, modulo 2³² */
    uint16_t late;                   /* control periods since arming without a new command, modulo 2¹⁶ */
    uint16_t dropped;                /* frames that the robot dropped since power-on, modulo 2¹⁶ */
} twbal_telemetry;

#pragma pack(pop)

#ifdef __cplusplus
#define TWBAL_ASSERT_SIZE(type, size) static_assert(sizeof(type) == size, "padding in " #type)
#else
#define TWBAL_ASSERT_SIZE(type, size) typedef char type##_has_its_size[sizeof(type) == size ? 1 : -1]
#endif
TWBAL_ASSERT_SIZE(twbal_hello, 5);
TWBAL_ASSERT_SIZE(twbal_stop, 3);
TWBAL_ASSERT_SIZE(twbal_arm, 8);
TWBAL_ASSERT_SIZE(twbal_command, 11);
TWBAL_ASSERT_SIZE(twbal_follow, 20);
TWBAL_ASSERT_SIZE(twbal_welcome, 32);
TWBAL_ASSERT_SIZE(twbal_fault, 3);
TWBAL_ASSERT_SIZE(twbal_pose_report, 21);
TWBAL_ASSERT_SIZE(twbal_telemetry, 66);

#endif
