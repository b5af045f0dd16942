// The part of the thin half that every guest has, a robot's program as a module's: the guard pages
// around the variables, the budget of basic blocks, random bytes, and the calls that go to the
// engine through `kt_host`.
#include <stddef.h>

#include "abi.h"
#include "side.h"

const kt_host_t *kt_host KT_SHARED = NULL;
int32_t kt_budget KT_SHARED = 0;

char kt_guard_low[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_low"))) = {0};
char kt_guard_high[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_high"))) = {0};

volatile kt_outputs_t kt_outputs;

static uint8_t soft_seed = 0xAA;
static uint8_t soft_accumulator;

// Loop variables may live in registers only: they are laid open beside the stack, so that the
// engine can tell a program that computes from one that waits.
static __attribute__((noinline)) void budget_spent(void) {
    uint64_t registers[5];
    __asm__ volatile(
        "movq %%rbx, %0; movq %%r12, %1; movq %%r13, %2; movq %%r14, %3; movq %%r15, %4"
        : "=m"(registers[0]), "=m"(registers[1]), "=m"(registers[2]), "=m"(registers[3]),
          "=m"(registers[4]));
    kt_host->spent((uint8_t *)registers);
}

/// Called by the compiler's instrumentation at every basic block of the program.
void __sanitizer_cov_trace_pc(void);
void __sanitizer_cov_trace_pc(void) {
    if (--kt_budget < 0) budget_spent();
}

uint8_t rand_hard(void);
uint8_t rand_hard(void) { return kt_host->rand_hard(); }

// hardware.md 1.7: an 8-bit xorshift with an additive counter that seeding leaves alone.
uint8_t rand_soft(void);
uint8_t rand_soft(void) {
    soft_seed ^= (uint8_t)(soft_seed << 3);
    soft_seed ^= (uint8_t)(soft_seed >> 5);
    soft_seed ^= (uint8_t)(soft_accumulator >> 2);
    soft_accumulator++;
    return soft_seed;
}

void kt_rand_seed(uint8_t seed) { soft_seed = seed; }

uint32_t kt_ticks(void) { return *kt_table.ticks; }
int16_t kt_sensor(uint8_t which) { return kt_host->sensor(which); }
void kt_print(const char *text, uint32_t bytes) { kt_host->print(text, bytes); }
uint8_t kt_eeprom_read(uint16_t address) { return kt_host->eeprom_read(address); }
void kt_eeprom_write(uint16_t address, uint8_t value) { kt_host->eeprom_write(address, value); }
void kt_interrupts(uint8_t on) { kt_host->interrupts(on); }
uint8_t kt_timer0(void) { return kt_host->timer0(); }
void kt_wait(uint32_t cycles) { kt_host->wait(cycles); }
void kt_unusable(const char *what) { kt_host->unusable(what); }
