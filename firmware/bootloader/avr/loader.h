/// The robot's boot loader (boot_loaders.md): from its entries to the application.
#ifndef BOOTLOADER_AVR_LOADER_H
#define BOOTLOADER_AVR_LOADER_H

#include <stdint.h>

/// Receives an image until an application is to be started. Everything of the chip may be in any
/// state but interrupts, which are off, and variables, which are 0.
void boot_load(void) __attribute__((noreturn));

/// Jumps to an application at a word address, with the cause of the last reset, as MCUSR had it, in
/// r2. Interrupts have to be off and the vectors where they are after a reset.
void boot_application(uint16_t entry, uint8_t reset_cause) __attribute__((noreturn));

#endif
