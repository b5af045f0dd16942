/// Interface between the AVR-shaped headers and the guest's thin half (robots/native/side). Those
/// headers include it, programs never do.
///
/// Registers are of three kinds:
/// - outputs, which drive motors and LED: in `kt_outputs`, which the engine reads;
/// - live: an access has an effect. They are reached by kt_register(), which first carries out
/// writes since the last time, since C cannot see a write as such;
/// - plain: all others. They keep the value written, without effect.
#ifndef KT_AVR_H
#define KT_AVR_H

#include <inttypes.h>
#include <stddef.h>
#include <stdint.h>

typedef volatile uint8_t kt_register8_t;
typedef volatile uint16_t __attribute__((may_alias, aligned(1))) kt_register16_t;

/// Registers by data address, 0x20..0xFF. Live ones have their latest value here.
extern kt_register8_t kt_registers[256];

/// `kt_outputs` of abi.h, byte by byte, in its order.
extern kt_register8_t kt_output_registers[8] __asm__("kt_outputs");
enum { KT_OCR2A, KT_OCR2B, KT_DDRB, KT_DDRC, KT_DDRD, KT_PORTB, KT_PORTC, KT_PORTD };

/// The register at a data address, up to date; for one access.
kt_register8_t *kt_register(uint8_t address);
/// ADCW and TCNT1, all 16 bits.
kt_register16_t *kt_adc_result(void);
kt_register16_t *kt_timer1(void);
/// UDR0: bytes written are printed. Wider than the register, to tell a byte written from none.
/// Reads as 0: nothing is ever received.
kt_register16_t *kt_serial_data(void);

/// Carries out writes to live registers and passes printed text on. The engine calls it after each
/// callback and loop(), and before time passes.
void kt_settle(void);

/// sei() and cli(), with SREG in step.
void kt_sei(void);
void kt_cli(void);
/// Begin of an atomic block: cli(); returns SREG as it was. Then the two ways to end one.
uint8_t kt_enter_atomic(void);
void kt_restore_sreg(const uint8_t *sreg);
void kt_leave_atomic(const uint8_t *sreg);

/// Lets time pass up to the next tick, if SMCR enables sleep.
void kt_sleep(void);

/// Lets cycles of 125 ns pass, rounded up.
void kt_delay(double cycles);

// See side/side.h.
uint8_t kt_eeprom_read(uint16_t address);
void kt_eeprom_write(uint16_t address, uint8_t value);
void kt_interrupts(uint8_t on);
uint8_t kt_timer0(void);
void kt_wait(uint32_t cycles);
void kt_print(const char *text, uint32_t bytes, uint8_t line);
void kt_unusable(const char *what) __attribute__((noreturn));

#endif
