/// The two registers that the Kilogrid helpers write, as variables of the test.
#ifndef FIRMWARE_TESTS_FAKE_AVR_IO_H
#define FIRMWARE_TESTS_FAKE_AVR_IO_H

#include <stdint.h>

extern volatile uint8_t DDRB, DDRD;

#endif
