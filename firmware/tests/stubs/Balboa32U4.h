#ifndef BALBOA_STUB_H
#define BALBOA_STUB_H

#include <stdint.h>

struct Balboa32U4Motors {
    static void allowTurbo(bool turbo); // false, as it begins: the library cuts speeds to 300 of 400
    static void flipLeftMotor(bool flip);
    static void flipRightMotor(bool flip);
    void setSpeeds(int16_t left, int16_t right);
};
struct Balboa32U4Encoders {
    int16_t getCountsAndResetLeft();
    int16_t getCountsAndResetRight();
};
uint16_t readBatteryMillivolts();

#endif
