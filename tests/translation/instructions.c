/// Runs single instructions, translated and by simavr, from the same random states, and compares
/// all that they leave: registers, flags, data space, program counter, cycles.
///
/// Usage: instructions STATES SEED < ADDRESSES. Each line of the input is the byte address of one
/// to test, at which the translation can be entered. Prints for each how often it was translated
/// (the interpreter is asked for the rest: effects, addresses outside SRAM); ends with 1 at the
/// first difference. With INTERPRETER it is the guests' interpreter that is tested, which executes
/// one instruction each.
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef INTERPRETER
#include "robots/translated/interpreter.h"
#endif
#include "draws.h"
#include "robots/translated/code.h"

extern const translation_t translation;

// Cycles that suffice for any of them and for what follows it in its block.
enum { DATA = 0x900, FLASH = 0x8000, FLAGS = 8, ENOUGH = 8 };

static void point(uint8_t *low, unsigned begin, unsigned bytes) {
    const unsigned address = begin + (unsigned)(draw() % bytes);
    low[0] = (uint8_t)address;
    low[1] = (uint8_t)(address >> 8);
}

#ifdef INTERPRETER
// simavr ends where the stack, or a pointer with a displacement of 6 bits, leaves SRAM.
enum { OFTEN = 1, FIRST = 0x140, SPAN = 0x780 };
#else
enum { OFTEN = 8, FIRST = 0x100, SPAN = 0x800 };
#endif

/// Pointers lead into SRAM, mostly, so that more than the interpreter is tested.
static void make_state(avr_t *avr) {
    for (unsigned i = 0; i < DATA; i += sizeof(uint64_t)) {
        const uint64_t bytes = draw_64_bits();
        memcpy(avr->data + i, &bytes, sizeof bytes);
    }
    if (draw() % 4 == 0) avr->data[draw() % 32] = draw() % 2 ? 0 : 0xFF;
    for (unsigned i = 0; i < FLAGS; i++) avr->sreg[i] = draw() & 1;
    for (unsigned pair = 26; pair <= 30; pair += 2)
        if (draw() % OFTEN != 0 || OFTEN == 1) point(avr->data + pair, FIRST, SPAN);
    if (draw() % OFTEN != 0 || OFTEN == 1) point(avr->data + R_SPL, FIRST, SPAN);
    avr->state = cpu_Running;
    avr->interrupt_state = 0;
    avr->cycle = 1000;
}

static void fail(const char *what, unsigned address, unsigned translated, unsigned interpreted) {
    printf("at 0x%04X: %s: translated %u, simavr %u\n", address, what, translated, interpreted);
    exit(1);
}

// Address of the status register, which simavr keeps up to date only where it is read.
enum { STATUS = 0x5F };

#ifdef INTERPRETER
/// Executes the instruction in place of its translation. Zero if there is none.
static int execute(translated_chip_t *chip) {
    static const registers_t none;
    return interpret(chip, &none);
}

/// It wraps at the flash's end, as the chip does and simavr does not.
static unsigned simavrs_counter(const avr_t *avr) { return avr->pc % FLASH; }
#else
static int execute(translated_chip_t *chip) {
    const unsigned region = translation.region_of[chip->pc / 2];
    if (region == 0) fail("may not be entered", chip->pc, 0, 0);
    translation.code[region - 1](chip);
    return 1;
}

static unsigned simavrs_counter(const avr_t *avr) { return avr->pc; }
#endif

/// True if it was translated.
static int test(avr_t *avr, unsigned address) {
    static uint8_t data[DATA], effects[0x100], flags[FLAGS];
    make_state(avr);
    memcpy(data, avr->data, DATA);
    memcpy(flags, avr->sreg, FLAGS);
    translated_chip_t chip = {data, flags, avr->flash, effects, ENOUGH, address};
    static translated_pass_t pass;
    chip.pass = &pass;
    const int64_t given = chip.left;
    if (!execute(&chip)) return 0;
    avr->pc = address;
    const uint64_t end = avr->cycle + (uint64_t)(given - chip.left);
    while (avr->cycle < end) {
        if (avr->interrupt_state != 0) fail("simavr waits", address, 0, 1);
        avr->run_cycle_count = 1;
        avr->pc = avr_run_one(avr);
    }
    if (avr->cycle != end)
        fail("cycles", address, (unsigned)(given - chip.left), (unsigned)(avr->cycle - 1000));
    if (simavrs_counter(avr) != chip.pc) fail("program counter", address, chip.pc, avr->pc);
    for (unsigned i = 0; i < FLAGS; i++)
        if (avr->sreg[i] != flags[i]) fail("flag", address, i << 4 | flags[i], avr->sreg[i]);
    avr->data[STATUS] = data[STATUS];
    if (memcmp(avr->data, data, DATA) != 0)
        for (unsigned i = 0; i < DATA; i++)
            if (avr->data[i] != data[i]) fail("data", address, i << 8 | data[i], avr->data[i]);
    return given != chip.left;
}

int main(int argc, char **argv) {
    if (argc != 3) return 2;
    const unsigned long states = strtoul(argv[1], NULL, 10);
    seed = strtoull(argv[2], NULL, 10) * 2 + 1;
    avr_t *avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    avr->log = LOG_NONE;
    // No register has an effect here; those that have one are the interpreter's.
    memset(avr->io, 0, sizeof avr->io);
    memcpy(avr->flash, translation.flash, FLASH);
    unsigned address;
    while (scanf("%x", &address) == 1) {
        unsigned long translated = 0;
        for (unsigned long i = 0; i < states; i++) translated += (unsigned)test(avr, address);
        printf("%x %lu\n", address, translated);
    }
    return 0;
}
