/// How registers are named and their bits tested.
#ifndef KT_AVR_SFR_DEFS_H
#define KT_AVR_SFR_DEFS_H

#include "../kt_avr.h"

/// By data address. An I/O address is 0x20 less.
#define _SFR_MEM8(address) (kt_registers[(address)])
#define _SFR_MEM16(address) (*(kt_register16_t *)&kt_registers[(address)])
#define _SFR_IO8(address) _SFR_MEM8((address) + 0x20)
#define _SFR_IO16(address) _SFR_MEM16((address) + 0x20)
#define _MMIO_BYTE(address) _SFR_MEM8(address)
#define _MMIO_WORD(address) _SFR_MEM16(address)

#define __SFR_OFFSET 0x20
#define _SFR_BYTE(sfr) (sfr)
#define _SFR_WORD(sfr) (sfr)

#define _BV(bit) (1 << (bit))
#define bit_is_set(sfr, bit) ((sfr)&_BV(bit))
#define bit_is_clear(sfr, bit) (!((sfr)&_BV(bit)))
#define loop_until_bit_is_set(sfr, bit) \
    do {                                \
    } while (bit_is_clear(sfr, bit))
#define loop_until_bit_is_clear(sfr, bit) \
    do {                                  \
    } while (bit_is_set(sfr, bit))

#define _VECTOR(number) __vector_##number

#endif
