/// What the parts of the guest's thin half need of one another.
#ifndef KILOTWIN_GUEST_SIDE_H
#define KILOTWIN_GUEST_SIDE_H

#include <stdint.h>

/// Hands text to the run folder, with the robot and its tick.
void kt_print(const char *text, uint32_t bytes);

/// The robot's EEPROM, 1,024 bytes.
uint8_t kt_eeprom_read(uint16_t address);
void kt_eeprom_write(uint16_t address, uint8_t value);

/// sei() and cli().
void kt_interrupts(uint8_t on);

/// TCNT0.
uint8_t kt_timer0(void);

/// Lets time pass, as delay() does.
void kt_wait(uint32_t cycles);

/// Stops the robot: it asked for something that a robot does not have.
void kt_unusable(const char *what);

#endif
