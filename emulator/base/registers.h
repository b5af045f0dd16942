/// The ATmega328P's registers and interrupt vectors that the board models touch (datasheet,
/// register summary). Registers are addresses in data space, above 0x20; REGISTER_BIT is a mask, or
/// the value of a field in place; VECTOR_ is the number of an interrupt, 0 for reset.
#ifndef KILOTWIN_BASE_REGISTERS_H
#define KILOTWIN_BASE_REGISTERS_H

#include <cstdint>

namespace kilotwin::atmega328p {

// Ports: direction (1: output) and output level.
constexpr uint16_t PIND = 0x29;  ///< levels of port D's pins
constexpr uint16_t DDRB = 0x24, PORTB = 0x25, DDRC = 0x27, PORTC = 0x28, DDRD = 0x2A, PORTD = 0x2B;
// Sleep mode.
constexpr uint16_t SMCR = 0x53;
constexpr uint8_t SMCR_SE = 1 << 0, SMCR_SM = 7 << 1, SLEEP_IDLE = 0 << 1,
                  SLEEP_NOISE_REDUCTION = 1 << 1, SLEEP_POWER_DOWN = 2 << 1;
// Watchdog: its interrupt is enabled.
constexpr uint16_t WDTCSR = 0x60;
constexpr uint8_t WDTCSR_WDIE = 1 << 6;
// Stack pointer and flags.
constexpr uint16_t SPL = 0x5D, SPH = 0x5E;  ///< low and high byte
constexpr uint16_t STATUS = 0x5F;           ///< C Z N V S H T I from bit 0 on
// EEPROM: control, data, address.
constexpr uint16_t EECR = 0x3F, EEDR = 0x40, EEARL = 0x41, EEARH = 0x42;
constexpr uint8_t EECR_EEMPE = 1 << 2, EECR_EEPE = 1 << 1, EECR_EERE = 1 << 0;
// Timer 0, which makes the ticks: flags, clock, count, compare value, mask of interrupts; the bit
// of compare match A in flags and mask. Timer 1, which times the receiver.
constexpr uint16_t TIFR0 = 0x35, TCCR0B = 0x45, TCNT0 = 0x46, OCR0A = 0x47, TIMSK0 = 0x6E;
constexpr uint8_t TCCR0B_CS = 7, TIMER0_MATCH_A = 1 << 1;
constexpr uint16_t TCNT1L = 0x84, TCNT1H = 0x85;  ///< reading the low byte keeps the high one
constexpr uint16_t MCUCR = 0x55;
constexpr uint8_t MCUCR_IVSEL = 1 << 1;  ///< the vectors are in the boot section
// Cause of the last reset.
constexpr uint16_t MCUSR = 0x54;
constexpr uint8_t MCUSR_PORF = 1 << 0;  ///< power-up
// Self-programming.
constexpr uint16_t SPMCSR = 0x57;
constexpr uint8_t SPMCSR_RWWSB = 1 << 6, SPMCSR_RWWSRE = 1 << 4, SPMCSR_PGWRT = 1 << 2,
                  SPMCSR_PGERS = 1 << 1, SPMCSR_SPMEN = 1 << 0;

// Analog comparator: ACI is its interrupt flag, cleared by writing a one.
constexpr uint16_t ACSR = 0x50;
constexpr uint8_t ACSR_ACD = 1 << 7, ACSR_ACI = 1 << 4, ACSR_ACIE = 1 << 3;

// Analog-to-digital converter.
constexpr uint16_t ADCL = 0x78, ADCH = 0x79, ADCSRA = 0x7A, ADCSRB = 0x7B, ADMUX = 0x7C;
constexpr uint8_t ADCSRA_ADEN = 1 << 7, ADCSRA_ADSC = 1 << 6, ADCSRA_ADATE = 1 << 5,
                  ADCSRA_ADIF = 1 << 4, ADCSRA_ADPS = 7;
constexpr uint8_t ADCSRB_ADTS = 7, ADTS_FREE_RUNNING = 0;
constexpr uint8_t ADMUX_MUX = 15, ADMUX_ADLAR = 1 << 5;

// Timer 2, which drives the motors of a Kilobot.
constexpr uint16_t TCCR2A = 0xB0, TCCR2B = 0xB1, OCR2A = 0xB3, OCR2B = 0xB4;

// SPI.
constexpr uint16_t SPCR = 0x4C, SPSR = 0x4D, SPDR = 0x4E;

// UART.
constexpr uint16_t UCSR0A = 0xC0, UCSR0B = 0xC1, UCSR0C = 0xC2, UBRR0L = 0xC4, UBRR0H = 0xC5,
                   UDR0 = 0xC6;
constexpr uint8_t UCSR0A_UDRE = 1 << 5, UCSR0A_U2X = 1 << 1, UCSR0B_UDRIE = 1 << 5;

// Two-wire interface (I2C).
constexpr uint16_t TWBR = 0xB8, TWSR = 0xB9, TWDR = 0xBB, TWCR = 0xBC;
constexpr uint8_t TWCR_TWINT = 1 << 7, TWCR_TWEA = 1 << 6, TWCR_TWSTA = 1 << 5, TWCR_TWSTO = 1 << 4,
                  TWCR_TWEN = 1 << 2;
constexpr uint8_t TWSR_TWPS = 3;

// Interrupts, by number of their vector.
constexpr uint8_t VECTOR_TIMER0_COMPA = 14, VECTOR_UDRE = 19, VECTOR_ADC = 21,
                  VECTOR_COMPARATOR = 23, VECTOR_TWI = 24;
/// Vector of the interrupt whose flag starts a conversion, by ADTS: free running (none),
/// comparator, INT0, timer 0 compare A and overflow, timer 1 compare B, overflow and capture.
constexpr uint8_t ADC_TRIGGERS[] = {0, 23, 1, 14, 16, 12, 13, 10};
constexpr uint32_t VECTOR_BYTES = 4;

/// A byte of flash that is erased.
constexpr uint8_t ERASED = 0xFF;
/// SRAM in data space, behind the registers.
constexpr uint16_t SRAM_BEGIN = 0x100, SRAM_END = 0x900;
/// Size of the flash; addresses wrap there.
constexpr uint32_t FLASH_BYTES = 32 * 1024;

}  // namespace kilotwin::atmega328p

#endif
