// Your robot: edit this file. docs/firmware.md says how to find each value.
#ifndef ROBOT_CONFIG_H
#define ROBOT_CONFIG_H

#include "twbal/two_wheels.h"

// As in your sheet (conf/robot/...): twbal refuses a robot whose period or torque limit is not that of the sheet.
static const char ROBOT_NAME[] = "esp32";
static const uint32_t CONTROL_PERIOD_US = 10000;
static const float TORQUE_LIMIT = 0.98f;    // sum of both wheels [N m]
static const float DIFFERENCE_LIMIT = 0.5f; // [N m]; 0: it does not turn
static const float TILT_LIMIT = 1.0f;       // at which it stops by itself [rad]; beyond the 30 degrees of a rollout
static const float WHEEL_RADIUS = 0.034f, TRACK = 0.25f, YAW_INERTIA = 0.0055f; // [m], [m], [kg m^2]

// The motors, JGB37-520 at 12 V here: stall torque T [N m] and current I [A] at U [V] by the data sheet give
// resistance U / I (with that of the bridge) and, for the whole gear motor, torque_constant * gear = T / I.
static const twbal::Motor MOTOR = {7.0f, 0.0098f, 30.0f};
static const float MOTOR_VOLTAGE_LIMIT = 12.0f; // [V]
static const float DEAD_DUTY = 0.0f; // smallest duty that turns a wheel in the air, if you know it; for torques only
static const float NOMINAL_BATTERY = 11.1f; // [V]; used where BATTERY_PIN is -1
static const int BATTERY_PIN = -1;
static const float BATTERY_DIVIDER = 4.0f; // battery voltage for a volt at the pin

// Counts of a turn of the wheel: lines of the encoder * gear * 2, as both edges of channel A are counted. Negative where
// the count falls as the wheel rolls forward.
static const float LEFT_COUNTS = 660.0f, RIGHT_COUNTS = -660.0f;

// Pins.
static const int SDA_PIN = 21, SCL_PIN = 22;
// 34 to 39 have no pull-up of their own: encoders with open collectors need a resistor of 10 kilohm to 3.3 V.
static const int LEFT_A = 34, LEFT_B = 35, RIGHT_A = 36, RIGHT_B = 39;
static const int LEFT_PWM = 25, LEFT_IN1 = 26, LEFT_IN2 = 27; // of TB6612 PWMA, AIN1, AIN2; of L298N ENA, IN1, IN2
static const int RIGHT_PWM = 23, RIGHT_IN1 = 18, RIGHT_IN2 = 19;
// None of a motor is 0, 2, 5, 12 or 15, which decide how the board boots, or 14, which has a pull-up after a reset.
static const int STANDBY = 33; // STBY of TB6612; -1: none
static const bool LEFT_REVERSED = false, RIGHT_REVERSED = true;

// How the MPU6050 sits: which of its axes (0 x, 1 y, 2 z) points forward, left and up, and whether it points the other way.
static const int FORWARD_AXIS = 0, LEFT_AXIS = 1, UP_AXIS = 2;
static const float FORWARD_SIGN = 1.0f, LEFT_SIGN = 1.0f, UP_SIGN = 1.0f;

#endif
