#ifndef WDT_STUB_H
#define WDT_STUB_H

const int WDTO_120MS = 3;
void wdt_enable(int time);
void wdt_reset();

#endif
