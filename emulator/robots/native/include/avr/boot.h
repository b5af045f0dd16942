/// Self-programming. There is no flash here that a program could write: one that tries is stopped.
#ifndef KT_AVR_BOOT_H
#define KT_AVR_BOOT_H

#include <limits.h>

#include "eeprom.h"
#include "io.h"

#define BOOTLOADER_SECTION

#define GET_LOW_FUSE_BITS 0x0000
#define GET_LOCK_BITS 0x0001
#define GET_EXTENDED_FUSE_BITS 0x0002
#define GET_HIGH_FUSE_BITS 0x0003

#define BLB12 5
#define BLB11 4
#define BLB02 3
#define BLB01 2

#define KT_NO_SELF_PROGRAMMING() kt_unusable("writes or reads its flash or fuses (avr/boot.h)")

#define boot_page_fill(address, data) ((void)(address), (void)(data), KT_NO_SELF_PROGRAMMING())
#define boot_page_erase(address) ((void)(address), KT_NO_SELF_PROGRAMMING())
#define boot_page_write(address) ((void)(address), KT_NO_SELF_PROGRAMMING())
#define boot_lock_bits_set(bits) ((void)(bits), KT_NO_SELF_PROGRAMMING())
#define boot_lock_fuse_bits_get(address) ((void)(address), KT_NO_SELF_PROGRAMMING(), (uint8_t)0)
#define boot_rww_enable() ((void)0)

#define boot_page_fill_safe(address, data) boot_page_fill(address, data)
#define boot_page_erase_safe(address) boot_page_erase(address)
#define boot_page_write_safe(address) boot_page_write(address)
#define boot_lock_bits_set_safe(bits) boot_lock_bits_set(bits)
#define boot_rww_enable_safe() boot_rww_enable()

#define boot_spm_busy() 0
#define boot_rww_busy() 0
#define boot_spm_busy_wait() \
    do {                     \
    } while (boot_spm_busy())
#define boot_is_spm_interrupt() (SPMCSR & _BV(SPMIE))
#define boot_spm_interrupt_enable() ((void)(SPMCSR = (uint8_t)(SPMCSR | _BV(SPMIE))))
#define boot_spm_interrupt_disable() ((void)(SPMCSR = (uint8_t)(SPMCSR & ~_BV(SPMIE))))

/// The signature row: bytes 0, 2 and 4 say ATmega328P.
#define boot_signature_byte_get(address)      \
    ((uint8_t)((address) == 0   ? SIGNATURE_0 \
               : (address) == 2 ? SIGNATURE_1 \
               : (address) == 4 ? SIGNATURE_2 \
                                : 0xFF))

#endif
