// Runs a translation from some addresses, read from stdin as hexadecimal numbers, each from many
// random states, and prints a line for each: registers, flags, cycles that are left, and where it
// has stopped and why. Arguments: number of states, seed.
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "draws.h"
#include "robots/translated/code.h"

extern const translation_t translation;

enum { DATA = 0x900, FLAGS = 8, REGISTERS = 32, SOON = 600 };

// Small numbers, too, and bytes that are alike.
static void draw_registers(uint8_t *data) {
    const uint8_t mask = (uint8_t)(draw() >> 20), rare = draw() >> 30 & 1 ? mask : 0xFF;
    for (unsigned at = 0; at < REGISTERS; at++) data[at] = (uint8_t)(draw() >> 40) & rare;
    for (unsigned at = 2; at < 14; at++)
        if ((draw() >> 33 & 7) == 0) data[at] = 0;
}

static void run(uint32_t address) {
    static uint8_t data[DATA], flags[FLAGS], effects[0x100];
    draw_registers(data);
    for (unsigned at = 0; at < FLAGS; at++) flags[at] = draw() >> 50 & 1;
    flags[7] = 0;
    translated_chip_t chip = {.data = data, .flags = flags, .flash = translation.flash};
    chip.effects = effects;
    chip.pc = address;
    chip.left = draw() >> 45 & 1 ? 1 << 20 : (int64_t)(draw() % SOON);
    translated_end_t end = GO_ON;
    while (end == GO_ON && translation.region_of[chip.pc / 2] != 0)
        end = translation.code[translation.region_of[chip.pc / 2] - 1](&chip);
    for (unsigned at = 0; at < REGISTERS; at++) printf("%02x", data[at]);
    printf(" ");
    for (unsigned at = 0; at < FLAGS; at++) printf("%d", flags[at]);
    printf(" %lld %x %d\n", (long long)chip.left, (unsigned)chip.pc, (int)end);
}

int main(int arguments, char **argument) {
    if (arguments != 3) return 2;
    const unsigned states = (unsigned)atoi(argument[1]);
    seed = 0x9E3779B97F4A7C15 + (uint64_t)atoi(argument[2]);
    unsigned address;
    while (scanf("%x", &address) == 1)
        for (unsigned state = 0; state < states; state++) run(address);
    return 0;
}
