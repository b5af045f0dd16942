/// Data in flash memory. Here it is ordinary memory.
#ifndef KT_AVR_PGMSPACE_H
#define KT_AVR_PGMSPACE_H

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "io.h"

#define PROGMEM
#define PGM_P const char *
#define PGM_VOID_P const void *
#define PSTR(text) (text)

typedef char prog_char;
typedef unsigned char prog_uchar;
typedef int8_t prog_int8_t;
typedef uint8_t prog_uint8_t;
typedef int16_t prog_int16_t;
typedef uint16_t prog_uint16_t;
typedef int32_t prog_int32_t;
typedef uint32_t prog_uint32_t;

typedef const uint8_t __attribute__((may_alias, aligned(1))) kt_flash8_t;
typedef const uint16_t __attribute__((may_alias, aligned(1))) kt_flash16_t;
typedef const uint32_t __attribute__((may_alias, aligned(1))) kt_flash32_t;
typedef const int16_t __attribute__((may_alias, aligned(1))) kt_flash_signed16_t;
typedef const int32_t __attribute__((may_alias, aligned(1))) kt_flash_signed32_t;
typedef const float __attribute__((may_alias, aligned(1))) kt_flash_float_t;
typedef const double __attribute__((may_alias, aligned(1))) kt_flash_double_t;
typedef const void *__attribute__((may_alias, aligned(1))) kt_flash_pointer_t;

static const uint8_t kt_erased_flash[8]
    __attribute__((unused)) = {0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};

/// Memory for a flash address. Addresses that a program gives as plain numbers, whose content only
/// the robot's linker knows, read as erased.
static inline __attribute__((unused)) const void *kt_in_flash(uintptr_t address) {
    return address <= FLASHEND ? kt_erased_flash : (const void *)address;
}
#define KT_IN_FLASH(address) kt_in_flash((uintptr_t)(address))

/// The size of what `address`, a pointer or a number, points to.
#define KT_SIZE_AT(address) sizeof(*(1 ? (address) : (void *)0))

/// Whether that is a `type`, const or not.
#define KT_IS_AT(address, type) \
    __builtin_types_compatible_p(__typeof__(*(1 ? (address) : (void *)0)), type)

#define pgm_read_byte(address) (*(kt_flash8_t *)KT_IN_FLASH(address))
#define pgm_read_ptr(address) ((void *)*(const kt_flash_pointer_t *)KT_IN_FLASH(address))

/// Words and longs of signed tables are read as signed: on the robot the int or long that they are
/// assigned to is no wider, so that a negative number stays one. Bytes are always unsigned.
#define pgm_read_dword(address)                                              \
    __builtin_choose_expr(KT_IS_AT(address, int) || KT_IS_AT(address, long), \
                          *(kt_flash_signed32_t *)KT_IN_FLASH(address),      \
                          *(kt_flash32_t *)KT_IN_FLASH(address))

/// Pointers are words on the robot, and doubles are floats: what `address` points to decides.
#define pgm_read_word(address)                                                    \
    __builtin_choose_expr(                                                        \
        KT_SIZE_AT(address) == sizeof(void *),                                    \
        (uintptr_t) * (const kt_flash_pointer_t *)KT_IN_FLASH(address),           \
        __builtin_choose_expr(KT_IS_AT(address, int) || KT_IS_AT(address, short), \
                              *(kt_flash_signed16_t *)KT_IN_FLASH(address),       \
                              *(kt_flash16_t *)KT_IN_FLASH(address)))
#define pgm_read_float(address)                                       \
    __builtin_choose_expr(KT_SIZE_AT(address) == sizeof(double),      \
                          *(kt_flash_double_t *)KT_IN_FLASH(address), \
                          *(kt_flash_float_t *)KT_IN_FLASH(address))

#define pgm_read_byte_near(address) pgm_read_byte(address)
#define pgm_read_word_near(address) pgm_read_word(address)
#define pgm_read_dword_near(address) pgm_read_dword(address)
#define pgm_read_float_near(address) pgm_read_float(address)
#define pgm_read_ptr_near(address) pgm_read_ptr(address)

#define memccpy_P memccpy
#define memchr_P memchr
#define memcmp_P memcmp
#define memcpy_P memcpy
#define memmem_P memmem
#define memrchr_P memrchr
#define strcasecmp_P strcasecmp
#define strcasestr_P strcasestr
#define strcat_P strcat
#define strchr_P strchr
#define strchrnul_P strchrnul
#define strcmp_P strcmp
#define strcpy_P strcpy
#define strcspn_P strcspn
#define strlcat_P strlcat
#define strlcpy_P strlcpy
#define strlen_P strlen
#define strncasecmp_P strncasecmp
#define strncat_P strncat
#define strncmp_P strncmp
#define strncpy_P strncpy
#define strnlen_P strnlen
#define strpbrk_P strpbrk
#define strrchr_P strrchr
#define strsep_P strsep
#define strspn_P strspn
#define strstr_P strstr
#define strtok_P strtok
#define strtok_rP strtok_r

#endif
