// As much of Arduino as the board files use, for a compiler of this computer: it checks that they are C++.
#ifndef ARDUINO_STUB_H
#define ARDUINO_STUB_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define IRAM_ATTR
const int OUTPUT = 1, INPUT = 0, CHANGE = 1, HIGH = 1, LOW = 0;
unsigned long micros();
void pinMode(int pin, int mode);
void digitalWrite(int pin, int level);
int digitalRead(int pin);
int digitalPinToInterrupt(int pin);
void attachInterrupt(int number, void (*called)(), int when);
uint32_t analogReadMilliVolts(int pin);
uint32_t ledcSetup(uint8_t channel, uint32_t frequency, uint8_t bits);
void ledcAttachPin(uint8_t pin, uint8_t channel);
bool ledcAttach(uint8_t pin, uint32_t frequency, uint8_t bits);
void ledcWrite(uint8_t channel, uint32_t share);
void enableLoopWDT();

struct SerialStub {
    void setRxBufferSize(size_t size);
    void begin(unsigned long rate);
    int available();
    int read();
    int availableForWrite();
    size_t write(const uint8_t* bytes, size_t size);
    bool dtr();
};
extern SerialStub Serial;

#endif
