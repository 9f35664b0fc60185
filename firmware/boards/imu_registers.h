// Registers of an IMU on the I2C bus: written, and read back until they hold what they should. An IMU that has lost a
// write still answers, and its rates are then off by the factor between two ranges.
#ifndef TWBAL_IMU_REGISTERS_H
#define TWBAL_IMU_REGISTERS_H

#include <Wire.h>
#include <stddef.h>
#include <stdint.h>

namespace twbal {

struct ImuRegister {
    uint8_t place, value;
};

// What a register holds; -1 where the IMU does not answer.
inline int held_by(uint8_t imu, uint8_t place)
{
    Wire.beginTransmission(imu);
    Wire.write(place);
    const bool answers = Wire.endTransmission(false) == 0 && Wire.requestFrom(imu, static_cast<uint8_t>(1)) == 1;
    return answers ? Wire.read() : -1;
}

// Whether all registers hold their values. One that does not is written once; call it again, until it is true. It ends
// at the first that has no answer, as each may take as long as a bus that hangs.
template <size_t COUNT>
bool set_up(uint8_t imu, const ImuRegister (&registers)[COUNT])
{
    for (const ImuRegister& each : registers) {
        const int found = held_by(imu, each.place);
        if (found == each.value) {
            continue;
        }
        if (found < 0) {
            return false;
        }
        Wire.beginTransmission(imu);
        Wire.write(each.place);
        Wire.write(each.value);
        if (Wire.endTransmission() != 0 || held_by(imu, each.place) != each.value) {
            return false;
        }
    }
    return true;
}

} // namespace twbal

#endif
