// The thin half of the mock Kilobot API: it is compiled into every guest, so that the API's plain
// variables are swapped with the program's own. What needs a clock, a body or a medium goes to the
// engine through `kt_host`.
#include <stddef.h>
#include <stdlib.h>

#include "abi.h"
#include "kilolib.h"
#include "side.h"

#define SHARED __attribute__((section(".kt_shared")))
#define CYCLES_PER_MS 8000
#define SPINUP_MS 15

static const kt_host_t *kt_host SHARED = NULL;
static int32_t kt_budget SHARED = 0;

static char kt_guard_low[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_low"))) = {0};
static char kt_guard_high[KT_GUARD_BYTES]
    __attribute__((aligned(4096), used, section(".kt_guard_high"))) = {0};
extern uint8_t kt_state_begin[], kt_state_end[];

volatile uint32_t kilo_ticks;
#pragma weak kilo_tx_period  // tx_period.c
uint16_t kilo_uid;
uint8_t kilo_turn_left;
uint8_t kilo_turn_right;
uint8_t kilo_straight_left;
uint8_t kilo_straight_right;

static void ignore_rx(message_t *message, distance_measurement_t *distance) {
    (void)message;
    (void)distance;
}
static message_t *ignore_tx(void) { return NULL; }
static void ignore_tx_success(void) {}

message_rx_t kilo_message_rx = ignore_rx;
message_tx_t kilo_message_tx = ignore_tx;
message_tx_success_t kilo_message_tx_success = ignore_tx_success;

volatile kt_outputs_t kt_outputs;

// Packed types have alignment 1; the engine writes whole words.
static message_t rx_message __attribute__((aligned(4)));
static distance_measurement_t rx_distance __attribute__((aligned(4)));
static uint8_t soft_seed = 0xAA;
static uint8_t soft_accumulator;

extern int kt_guest_main();

// Only programs that use such registers link it (avr.c).
extern __attribute__((weak, visibility("hidden"))) void kt_settle(void);

// avr/interrupt.h.
extern __attribute__((weak, visibility("hidden"))) const char __start_kt_handlers[];
extern __attribute__((weak, visibility("hidden"))) const char __stop_kt_handlers[];

const kt_table_t kt_table = {
    .abi = KT_GUEST_ABI,
    .guard_low = (uint8_t *)kt_guard_low,
    .state_begin = kt_state_begin,
    .state_end = kt_state_end,
    .guard_high = (uint8_t *)kt_guard_high,
    .program_main = kt_guest_main,
    .ticks = &kilo_ticks,
    .tx_period = &kilo_tx_period,
    .uid = &kilo_uid,
    .turn_left = &kilo_turn_left,
    .turn_right = &kilo_turn_right,
    .straight_left = &kilo_straight_left,
    .straight_right = &kilo_straight_right,
    .message_rx = &kilo_message_rx,
    .message_tx = &kilo_message_tx,
    .message_tx_success = &kilo_message_tx_success,
    .rx_message = &rx_message,
    .rx_distance = &rx_distance,
    .outputs = &kt_outputs,
    .settle = kt_settle,
    .handlers_begin = __start_kt_handlers,
    .handlers_end = __stop_kt_handlers,
    .random = rand,
    .budget = &kt_budget,
    .host = &kt_host,
};

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

void kilo_init(void) { kt_host->init(); }
void kilo_start(void (*setup)(void), void (*loop)(void)) { kt_host->start(setup, loop); }
void delay(uint16_t ms) { kt_host->wait((uint32_t)ms * CYCLES_PER_MS); }

void set_motors(uint8_t left, uint8_t right) {
    kt_outputs.ocr2a = left;
    kt_outputs.ocr2b = right;
    kt_host->outputs();
}

// The pins of an LED light it as outputs, low: set_color() turns outputs on and off (hardware.md
// 1.8).
void set_color(uint8_t rgb) {
    kt_outputs.ddrd = (uint8_t)((kt_outputs.ddrd & ~0x30) | (rgb & 1) << 5 | (rgb & 2) << 3);
    kt_outputs.ddrc = (uint8_t)((kt_outputs.ddrc & ~0x3C) | (rgb & 4) << 1 | (rgb & 8) >> 1 |
                                (rgb & 16) << 1 | (rgb & 32) >> 1);
    kt_host->outputs();
}

void spinup_motors(void) {
    set_motors(255, 255);
    delay(SPINUP_MS);
}

int16_t get_ambientlight(void) { return kt_host->sensor(KT_SENSOR_LIGHT); }
int16_t get_voltage(void) { return kt_host->sensor(KT_SENSOR_VOLTAGE); }
int16_t get_temperature(void) { return kt_host->sensor(KT_SENSOR_TEMPERATURE); }

uint8_t rand_hard(void) { return kt_host->rand_hard(); }

// hardware.md 1.7: an 8-bit xorshift with an additive counter that seeding leaves alone.
uint8_t rand_soft(void) {
    soft_seed ^= (uint8_t)(soft_seed << 3);
    soft_seed ^= (uint8_t)(soft_seed >> 5);
    soft_seed ^= (uint8_t)(soft_accumulator >> 2);
    soft_accumulator++;
    return soft_seed;
}

void rand_seed(uint8_t seed) { soft_seed = seed; }

uint8_t estimate_distance(const distance_measurement_t *measured) {
    return kt_host->distance_mm(measured->low_gain, measured->high_gain);
}

// CRC-16/MCRF4XX over the data and the type (hardware.md 1.5).
uint16_t message_crc(const message_t *message) {
    uint16_t crc = 0xFFFF;
    for (size_t i = 0; i < offsetof(message_t, crc); i++) {
        uint8_t byte = (uint8_t)(((const uint8_t *)message)[i] ^ crc);
        byte ^= (uint8_t)(byte << 4);
        crc = (uint16_t)(((uint16_t)byte << 8 | crc >> 8) ^ (uint8_t)(byte >> 4) ^
                         (uint16_t)(byte << 3));
    }
    return crc;
}

void kt_print(const char *text, uint32_t bytes) { kt_host->print(text, bytes); }
uint8_t kt_eeprom_read(uint16_t address) { return kt_host->eeprom_read(address); }
void kt_eeprom_write(uint16_t address, uint8_t value) { kt_host->eeprom_write(address, value); }
void kt_interrupts(uint8_t on) { kt_host->interrupts(on); }
uint8_t kt_timer0(void) { return kt_host->timer0(); }
void kt_wait(uint32_t cycles) { kt_host->wait(cycles); }
void kt_unusable(const char *what) { kt_host->unusable(what); }
