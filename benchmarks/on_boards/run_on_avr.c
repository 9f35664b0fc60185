/* Runs a program in simavr and prints the cycles between each two writes to GPIOR0, of 1 and of 2, until it sleeps. */
#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <stdio.h>

enum { GPIOR0 = 0x3E };
static avr_cycle_count_t began;

static void written(struct avr_t* avr, avr_io_addr_t address, uint8_t value, void* unused)
{
    (void)unused;
    avr->data[address] = value;
    if (value == 1) {
        began = avr->cycle;
    } else if (value == 2) {
        printf("%lu\n", (unsigned long)(avr->cycle - began));
    }
}

int main(int count, char** words)
{
    elf_firmware_t program = {{0}};
    avr_t* avr;
    int state = cpu_Running;
    if (count != 2 || elf_read_firmware(words[1], &program) != 0 || !(avr = avr_make_mcu_by_name("atmega32u4"))) {
        return 1;
    }
    avr_init(avr);
    program.frequency = 16000000;
    avr_load_firmware(avr, &program);
    avr_register_io_write(avr, GPIOR0, written, NULL);
    while (state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
    }
    return state != cpu_Done;
}
