/// Single instructions.
#ifndef KT_AVR_CPUFUNC_H
#define KT_AVR_CPUFUNC_H

#define _NOP() __asm__ volatile("" ::: "memory")
#define _MemoryBarrier() __asm__ volatile("" ::: "memory")

#endif
