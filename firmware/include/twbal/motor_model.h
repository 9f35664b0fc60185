// Direct-current motors behind gears: torque at a wheel to voltage and duty, with the back-EMF of the present rate.
#ifndef TWBAL_MOTOR_MODEL_H
#define TWBAL_MOTOR_MODEL_H

#include "twbal/quantities.h"

namespace twbal {

struct Motor {
    float resistance;      // of the armature, with that of the bridge [ohm]
    float torque_constant; // [N m/A], and of the EMF [V s/rad]
    float gear;            // turns of the rotor for one of the wheel

    // Voltage for a torque at the wheel that turns at `rate`: u R / (N K) + N K rate. No motor turns so fast by itself
    // that its back-EMF is beyond the supply's voltage: what is, by a wrong count or gear or a push, is left out.
    float voltage(float torque, float rate, float supply) const
    {
        return torque * resistance / (gear * torque_constant) + within(gear * torque_constant * rate, supply);
    }
};

// Share of the battery's voltage that the bridge puts out, -1 to 1; 0 where the battery is unknown or empty.
inline float duty(float voltage, float battery)
{
    return battery > 1.0f && isfinite(voltage) ? within(voltage / battery, 1.0f) : 0.0f;
}

} // namespace twbal

#endif
