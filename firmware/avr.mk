# Compiler flags for the chip of robots and modules, an ATmega328P with a crystal of 8 MHz, as kilolib
# uses them. Their only home: both firmware Makefiles and the top one include this file, and
# host_tools/kilotwin/programs/image/flags.py reads it, for images and for guests of the same dialect on a
# PC. Only lines "NAME := words", of which some are $(NAME) of another, and comments.

AVR_CHIP    := -mmcu=atmega328p -DF_CPU=8000000UL
AVR_DIALECT := -std=gnu99 -O2 -funsigned-char -funsigned-bitfields -fpack-struct -fshort-enums
# Each function of the runtimes and helpers has a section, which the linker leaves out if unused.
AVR_LIBRARY := -ffunction-sections
# Source lines in the .elf, for avr-gdb and `kilotwin port`; no byte of an image changes by it.
AVR_DEBUG   := -gdwarf-2
# The boot section begins at 0x7000 and stays free.
AVR_LINK    := -Wl,--gc-sections -Wl,--relax
# Sections of an .elf that are no part of the flash; the .hex comes without them.
AVR_NOT_FLASHED := .eeprom .fuse .lock .signature .user_signatures

# Sources of kilolib/avr that are part of the modules' runtime as well, beside all of kilolib/core.
AVR_SHARED  := frame_sender.c gains_read.c

# The boot loaders of robots and modules: small rather than fast, as one unit, at the begin of the boot
# section, with vectors of their own. The robots' takes these from kilolib/avr and all that it needs of
# kilolib/core.
AVR_LOADER_LESS := -fno-jump-tables -fno-gcse -fno-move-loop-invariants -fno-tree-loop-optimize -fno-tree-pre -fno-ssa-phiopt
AVR_LOADER      := -Os -flto -mstrict-X $(AVR_LOADER_LESS)
AVR_LOADER_LINK := -nostartfiles -Wl,--section-start=.text=0x7000
AVR_LOADER_SHARED := eeprom.c frame_sender.c infrared_send.c
# Sources of the modules' loader in kilogrid_modules, and here.
AVR_MODULE_LOADER := runtime/avr/can_controller.c runtime/avr/i2c.c runtime/avr/spi.c protocol/address.c
AVR_LOADER_STORE  := bootloader/core/image_record.c bootloader/core/image_store.c kilolib/avr/eeprom.c
AVR_MODULE_LOADER_SHARED := bootloader/avr/clock.c bootloader/avr/entry.c bootloader/avr/flash.c $(AVR_LOADER_STORE)
