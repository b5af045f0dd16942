/// The ATmega328P's registers and interrupt vectors that a board has to do with: addresses in data
/// space, and bits (datasheet, register summary).
#ifndef KILOTWIN_AVR_REGISTERS_H
#define KILOTWIN_AVR_REGISTERS_H

#include <cstdint>

namespace kilotwin::atmega328p {

constexpr uint16_t DDRB = 0x24, PORTB = 0x25, DDRC = 0x27, PORTC = 0x28, DDRD = 0x2A, PORTD = 0x2B;
constexpr uint16_t MCUCR = 0x55;
constexpr uint8_t MCUCR_IVSEL = 1 << 1;  ///< the vectors are in the boot section

constexpr uint16_t ADCL = 0x78, ADCH = 0x79, ADCSRA = 0x7A, ADCSRB = 0x7B, ADMUX = 0x7C;
constexpr uint8_t ADCSRA_ADEN = 1 << 7, ADCSRA_ADSC = 1 << 6, ADCSRA_ADATE = 1 << 5,
                  ADCSRA_ADIF = 1 << 4, ADCSRA_ADPS = 7;
constexpr uint8_t ADCSRB_ADTS = 7, ADTS_FREE_RUNNING = 0, ADTS_COMPARATOR = 1;
constexpr uint8_t ADMUX_MUX = 15, ADMUX_ADLAR = 1 << 5;

constexpr uint16_t TCCR2A = 0xB0, TCCR2B = 0xB1, OCR2A = 0xB3, OCR2B = 0xB4;

constexpr uint8_t VECTOR_TIMER0_COMPA = 14, VECTOR_ADC = 21, VECTOR_COMPARATOR = 23;
constexpr uint8_t VECTORS = 26;
constexpr uint32_t VECTOR_BYTES = 4;

constexpr uint32_t FLASH_BYTES = 32 * 1024;
constexpr uint32_t BOOT_SECTION = 0x7000;  ///< byte address; BOOTSZ = 00

}  // namespace kilotwin::atmega328p

#endif
