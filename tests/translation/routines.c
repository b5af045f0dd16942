// Runs a translation from routines of floats and numbers, each from many random states, and prints
// a line for each that ends: registers, flags, the stack's bytes below, cycles that are left, and
// where it has stopped. Arguments: number of states, seed, 1 if the engine computes routines.
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "draws.h"
#include "robots/translated/code.h"

extern const translation_t translation;

enum { DATA = 0x900, FLAGS = 8, REGISTERS = 32, SP = 0x8A0, SHOWN_STACK = 40, BACK = 0x7000 };

// Most are of like size, so that sums cancel.
static uint32_t draw_number(uint32_t like) {
    const unsigned kind = draw() & 31;
    uint32_t number = (uint32_t)draw();
    if (kind == 0) return number & 0x80000000;
    if (kind == 1) return number & 0x807FFFFF;
    if (kind == 2) return like;
    if (kind == 3) return like ^ 0x80000000;
    if (kind == 4) return number | 0x7F800000;
    if (kind == 5) return (number & 0x807FFFFF) | (draw() & 1 ? 0x00800000 : 0x7F000000);
    if (kind < 8) return number;
    if (kind < 12) number &= (uint32_t)draw() & (uint32_t)draw();
    if (kind < 14) number |= 0x007FFFFF & ~(uint32_t)draw_64_bits() >> 60;
    const uint32_t near = kind < 24 ? (like >> 23 & 0xFF) + (draw() % 41) - 20 : 100 + draw() % 56;
    return (number & 0x807FFFFF) | (near & 0xFF) << 23;
}

static uint32_t draw_whole(void) {
    const uint32_t number = (uint32_t)draw() >> draw() % 32;
    return draw() & 1 ? number : 0 - number;
}

static uint8_t data[DATA], flags[FLAGS], effects[0x100];

static void put(unsigned at, uint32_t number) {
    for (unsigned byte = 0; byte < 4; byte++) data[at + byte] = (uint8_t)(number >> 8 * byte);
}

static void run(uint32_t address, unsigned is_whole, unsigned series,
                const translated_routine_t *routines) {
    static translated_pass_t pass;
    for (unsigned at = 0; at < DATA; at++) data[at] = (uint8_t)draw();
    const uint32_t a = is_whole ? draw_whole() : draw_number((uint32_t)draw());
    put(22, a), put(18, is_whole ? draw_whole() : draw_number(a));
    data[1] = 0;
    if (series != 0) put(22, draw_number(0x3F000000)), put(30, series | data[32] << 16);
    if (is_whole == 2) {
        data[24] = draw() & 1 ? 0 : 0xF0, data[25] = draw() & 1 ? 1 : 8;
        put(0x100, draw() & 7 ? (uint32_t)draw() & 0x7FFFFFFF : draw_whole());
    }
    data[0x5D] = SP & 0xFF, data[0x5E] = SP >> 8;
    data[SP + 2] = (uint8_t)(BACK / 2), data[SP + 1] = BACK / 2 >> 8;
    for (unsigned at = 0; at < FLAGS; at++) flags[at] = draw() >> 20 & 1;
    flags[7] = 0;
    translated_chip_t chip = {.data = data, .flags = flags, .flash = translation.flash};
    chip.effects = effects;
    chip.pass = &pass;
    chip.routines = routines;
    chip.pc = address;
    chip.left = draw() & 7 ? 1 << 20 : (int64_t)(draw() % 1200);
    const uint8_t is_short = chip.left < 1200;
    int turns = 0;
    translated_end_t end = GO_ON;
    while (end == GO_ON && translation.region_of[chip.pc / 2] != 0 && turns++ < 4000)
        end = translation.code[translation.region_of[chip.pc / 2] - 1](&chip);
    for (unsigned at = 0; at < REGISTERS; at++) printf("%02x", data[at]);
    printf(" ");
    for (unsigned at = 0; at < FLAGS; at++) printf("%d", flags[at]);
    printf(" ");
    for (unsigned at = SP + 2; at > SP - SHOWN_STACK; at--) printf("%02x", data[at]);
    uint32_t sum = 0;
    for (unsigned at = 0x100; at < DATA; at++) sum = sum * 31 + data[at];
    printf(" %08x %lld %x %d%s\n", sum, (long long)chip.left, (unsigned)chip.pc, (int)end,
           is_short ? " short" : "");
}

int main(int arguments, char **argument) {
    if (arguments != 4) return 2;
    const unsigned states = (unsigned)atoi(argument[1]);
    seed = 0x9E3779B97F4A7C15 + (uint64_t)atoi(argument[2]);
    const translated_routine_t *routines = atoi(argument[3]) ? translated_routines : 0;
    unsigned address, series;
    char name[64];
    while (scanf("%x %63s %x", &address, name, &series) == 3) {
        const unsigned is_whole = strcmp(name, "do_rand") == 0                  ? 2
                                  : strstr(name, "mod") || strstr(name, "sisf") ? 1
                                                                                : 0;
        for (unsigned state = 0; state < states; state++) run(address, is_whole, series, routines);
    }
    return 0;
}
