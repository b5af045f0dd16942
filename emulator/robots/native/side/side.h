/// Interface between the parts of a guest's thin half.
#ifndef KILOTWIN_GUEST_SIDE_H
#define KILOTWIN_GUEST_SIDE_H

#include <stdint.h>

#include "abi.h"

/// Marks a variable of the process, outside the state of robots.
#define KT_SHARED __attribute__((section(".kt_shared")))

extern const kt_host_t *kt_host;
extern int32_t kt_budget;
extern char kt_guard_low[KT_GUARD_BYTES], kt_guard_high[KT_GUARD_BYTES];
extern uint8_t kt_state_begin[], kt_state_end[];

/// Names of the interrupt handlers that the program defines (avr/interrupt.h), each ended by a 0.
extern __attribute__((weak, visibility("hidden"))) const char __start_kt_handlers[];
extern __attribute__((weak, visibility("hidden"))) const char __stop_kt_handlers[];

/// The program's main().
extern int kt_guest_main();
/// Runs the program's constructors, then its main().
int kt_run_program();

/// kt_table_t.settle. Null unless the program uses such registers (avr.c).
extern __attribute__((weak, visibility("hidden"))) void kt_settle(void);

/// Defined in programs that cannot change kilo_tx_period after their set-up (settled_period.c).
extern __attribute__((weak, visibility("hidden"))) const uint8_t kt_settled_period;

/// The robot's or module's count of ticks.
uint32_t kt_ticks(void);

/// Reads a channel of the converter: 0..1023, or -1.
int16_t kt_sensor(uint8_t channel);

/// Hands text to the run folder, with the robot and its tick. `line`: KT_LINE_..., which says how
/// long it takes.
void kt_print(const char *text, uint32_t bytes, uint8_t line);

/// A byte was written to UDR0; waits until the next can be.
void kt_serial_written(void);
void kt_serial_ready(void);

/// The robot's EEPROM, 1,024 bytes.
uint8_t kt_eeprom_read(uint16_t address);
void kt_eeprom_write(uint16_t address, uint8_t value);

/// sei() and cli().
void kt_interrupts(uint8_t on);

/// TCNT0.
uint8_t kt_timer0(void);

/// Lets time pass, as delay() does.
void kt_wait(uint32_t cycles);

/// Stops the robot; `what` completes "the program ...".
void kt_unusable(const char *what) __attribute__((noreturn));

#endif
