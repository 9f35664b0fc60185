// An IMU behind Arduino's Wire, of 256 registers. It may lose writes to one of them, and what it measures changes its
// last digit.
#ifndef TWBAL_FAKE_IMU_H
#define TWBAL_FAKE_IMU_H

#include <Wire.h>

struct FakeImu {
    uint8_t registers[256] = {};
    uint8_t loses = 0; // the register whose first writes are lost
    long lost = 0;     // how many of them
    int place = -1;    // that was said last; -1: none yet
    int reading = 0;
    bool is_register = false; // what is read is a register, and not a measurement
    int read = 0;             // bytes of the measurement that is read
    uint16_t measured[6] = {}; // in the order of the IMU's registers, the low byte first; but for the last digit
};
static FakeImu fake_imu;

void WireStub::begin() {}
void WireStub::begin(int, int) {}
void WireStub::setClock(uint32_t) {}
void WireStub::setTimeOut(uint16_t) {}
void WireStub::setWireTimeout(uint32_t, bool) {}
void WireStub::beginTransmission(uint8_t) { fake_imu.place = -1; }
void WireStub::write(uint8_t byte)
{
    if (fake_imu.place < 0) {
        fake_imu.place = byte;
    } else if (fake_imu.place == fake_imu.loses && fake_imu.lost > 0) {
        --fake_imu.lost;
    } else {
        fake_imu.registers[fake_imu.place] = byte;
    }
}
uint8_t WireStub::endTransmission(bool) { return 0; }
uint8_t WireStub::requestFrom(uint8_t, uint8_t count)
{
    fake_imu.is_register = count == 1;
    ++fake_imu.reading;
    fake_imu.read = 0;
    return count;
}
int WireStub::read()
{
    if (fake_imu.is_register) {
        return fake_imu.registers[fake_imu.place];
    }
    const int at = fake_imu.read++ % 12, value = fake_imu.measured[at / 2];
    return at % 2 == 0 ? (value & 0xFF) ^ (fake_imu.reading & 1) : value >> 8;
}
WireStub Wire;

#endif
