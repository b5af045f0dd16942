// Registers behind <avr/io.h> (kt_avr.h). Linked only into programs that use them.
#include "../../../../firmware/kilolib/core/sensors.h"
#include "abi.h"
#include "avr/interrupt.h"
#include "avr/io.h"
#include "side.h"

// Outputs of kt_avr.h and of abi.h are the same bytes.
#define SAME_PLACE(register, field) \
    _Static_assert((register) == offsetof(kt_outputs_t, field), "kt_avr.h follows abi.h")
SAME_PLACE(KT_OCR2A, ocr2a);
SAME_PLACE(KT_OCR2B, ocr2b);
SAME_PLACE(KT_DDRB, ddrb);
SAME_PLACE(KT_DDRC, ddrc);
SAME_PLACE(KT_DDRD, ddrd);
SAME_PLACE(KT_PORTB, portb);
SAME_PLACE(KT_PORTC, portc);
SAME_PLACE(KT_PORTD, portd);

// Data addresses; PLAIN is the value there, without the effects of an access by the program.
enum {
    PIND_AT = 0x29,
    EECR_AT = 0x3F,
    EEDR_AT = 0x40,
    EEAR_AT = 0x41,
    TCNT0_AT = 0x46,
    SPSR_AT = 0x4D,
    MCUSR_AT = 0x54,
    SREG_AT = 0x5F,
    ADC_AT = 0x78,
    ADCSRA_AT = 0x7A,
    TCNT1_AT = 0x84,
    TCNT2_AT = 0xB2,
    TWCR_AT = 0xBC,
    UCSR0A_AT = 0xC0,
};
#define PLAIN(address) kt_registers[address]
#define PLAIN16(address) _SFR_MEM16(address)

enum { NOT_CHARGING = _BV(PIND0), POWERED_UP = _BV(PORF), INTERRUPTS = _BV(SREG_I) };

kt_register8_t kt_registers[256] = {
    [PIND_AT] = NOT_CHARGING, [MCUSR_AT] = POWERED_UP, [SREG_AT] = INTERRUPTS};

static uint8_t interrupts_on = INTERRUPTS;  // as last passed to the engine

static void settle_interrupts(void) {
    const uint8_t wanted = PLAIN(SREG_AT) & INTERRUPTS;
    if (wanted == interrupts_on) return;
    interrupts_on = wanted;
    kt_interrupts(wanted != 0);
}

void kt_sei(void) {
    PLAIN(SREG_AT) |= INTERRUPTS;
    settle_interrupts();
}

void kt_cli(void) {
    PLAIN(SREG_AT) &= (uint8_t)~INTERRUPTS;
    settle_interrupts();
}

uint8_t kt_enter_atomic(void) {
    const uint8_t sreg = SREG;
    kt_cli();
    return sreg;
}

void kt_restore_sreg(const uint8_t *sreg) {
    PLAIN(SREG_AT) = *sreg;
    settle_interrupts();
}

void kt_leave_atomic(const uint8_t *sreg) {
    (void)sreg;
    kt_sei();
}

// UDR0. C cannot see a write: a value that no write leaves marks that there was none.
enum { NOTHING_WRITTEN = 0x4000, SERIAL_BYTES = 80 };

static kt_register16_t serial_data = NOTHING_WRITTEN;
static char serial_text[SERIAL_BYTES];
static uint8_t serial_used;
static uint8_t polls_serial;  // waits until the line takes a byte: the text goes on

static void print_serial(void) {
    if (serial_used > 0) kt_print(serial_text, serial_used, KT_NO_LINE);
    serial_used = 0;
}

static void settle_serial(void) {
    if (serial_data == NOTHING_WRITTEN) return;
    const char character = (char)serial_data;
    serial_data = NOTHING_WRITTEN;
    kt_serial_written();
    serial_text[serial_used++] = character;
    if (character == '\n' || serial_used == SERIAL_BYTES) print_serial();
}

kt_register16_t *kt_serial_data(void) {
    settle_serial();
    return &serial_data;
}

// EECR: EERE reads a byte; EEPE writes one if EEMPE was set before.
static void settle_eeprom(void) {
    const uint8_t wanted = PLAIN(EECR_AT);
    const uint16_t address = PLAIN16(EEAR_AT) & E2END;
    PLAIN(EECR_AT) = (uint8_t)(wanted & ~(_BV(EERE) | _BV(EEPE)));
    if (wanted & _BV(EERE)) PLAIN(EEDR_AT) = kt_eeprom_read(address);
    if (!(wanted & _BV(EEPE)) || !(wanted & _BV(EEMPE))) return;
    PLAIN(EECR_AT) &= (uint8_t)~_BV(EEMPE);
    kt_eeprom_write(address, PLAIN(EEDR_AT));
}

// kilolib's functions return -1 during a reception; the converter itself would convert: 0 stands
// for its unknown result.
static uint16_t convert(uint8_t channel) {
    const int16_t value = kt_sensor(channel);
    return value < 0 ? 0 : (uint16_t)value;
}

static void settle_adc(void) {
    if (!(PLAIN(ADCSRA_AT) & _BV(ADSC))) return;
    const uint8_t source = ADMUX;
    const uint16_t value = convert(source % CONVERTER_CHANNELS);
    PLAIN16(ADC_AT) = (uint16_t)(source & _BV(ADLAR) ? value << 6 : value);
    PLAIN(ADCSRA_AT) = (uint8_t)((PLAIN(ADCSRA_AT) & ~_BV(ADSC)) | _BV(ADIF));
}

kt_register16_t *kt_adc_result(void) {
    settle_adc();
    return &PLAIN16(ADC_AT);
}

// Ends a line of serial output too, so that texts keep their tick.
void kt_settle(void) {
    settle_interrupts();
    settle_serial();
    if (!polls_serial) print_serial();
    settle_eeprom();
    settle_adc();
}

// Timers as kilolib sets them: timer 0 counts every 1,024 cycles, timer 1 every cycle, timer 2
// every 8, up and down. All are derived from timer 0, so none is finer.
enum {
    CYCLES_PER_COUNT_0 = 1024,
    CYCLES_PER_COUNT_2 = 8,
    COUNTS_PER_TICK = 256,
    ROUND_TRIP_2 = 510
};

kt_register16_t *kt_timer1(void) {
    PLAIN16(TCNT1_AT) = (uint16_t)(kt_timer0() * CYCLES_PER_COUNT_0);
    return &PLAIN16(TCNT1_AT);
}

static uint8_t timer2(void) {
    const uint32_t counts_0 = kt_ticks() * COUNTS_PER_TICK + kt_timer0();
    const uint32_t count = counts_0 * (CYCLES_PER_COUNT_0 / CYCLES_PER_COUNT_2) % ROUND_TRIP_2;
    return (uint8_t)(count < COUNTS_PER_TICK ? count : ROUND_TRIP_2 - count);
}

// Peripherals are always ready, the serial line when it has taken a byte: a program that polls for
// it goes on.
kt_register8_t *kt_register(uint8_t address) {
    settle_interrupts();
    settle_serial();
    settle_eeprom();
    settle_adc();
    switch (address) {
    case TCNT0_AT: PLAIN(address) = kt_timer0(); break;
    case TCNT1_AT:
    case TCNT1_AT + 1: kt_timer1(); break;
    case TCNT2_AT: PLAIN(address) = timer2(); break;
    case UCSR0A_AT:
        polls_serial = 1;
        kt_serial_ready();
        polls_serial = 0;
        PLAIN(address) |= _BV(UDRE0) | _BV(TXC0);
        break;
    case SPSR_AT: PLAIN(address) |= _BV(SPIF); break;
    case TWCR_AT: PLAIN(address) |= _BV(TWINT); break;
    default: break;
    }
    return &kt_registers[address];
}

void kt_sleep(void) {
    if (!(SMCR & _BV(SE))) return;
    kt_settle();
    // A robot's own tick is some counts longer or shorter than nominal, so one wait may end before
    // it; with interrupts off none comes, hence the bound.
    const uint32_t before = kt_ticks();
    for (int tries = 0; tries < COUNTS_PER_TICK && kt_ticks() == before; tries++)
        kt_wait((uint32_t)(COUNTS_PER_TICK - kt_timer0()) * CYCLES_PER_COUNT_0);
}
