#ifndef WIRE_STUB_H
#define WIRE_STUB_H

#include <stdint.h>

struct WireStub {
    void begin();
    void begin(int sda, int scl);
    void setClock(uint32_t frequency);
    void setTimeOut(uint16_t milliseconds);
    void setWireTimeout(uint32_t microseconds, bool reset);
    void beginTransmission(uint8_t address);
    void write(uint8_t byte);
    uint8_t endTransmission(bool stop = true);
    uint8_t requestFrom(uint8_t address, uint8_t count);
    int read();
};
extern WireStub Wire;

#endif
