/// The compiler's own <limits.h>, and further names of avr-gcc.
#ifndef KT_LIMITS_H
#define KT_LIMITS_H

#include_next <limits.h>

#ifndef LONG_LONG_MAX
#define LONG_LONG_MAX __LONG_LONG_MAX__
#define LONG_LONG_MIN (-LONG_LONG_MAX - 1LL)
#define ULONG_LONG_MAX (LONG_LONG_MAX * 2ULL + 1)
#endif

#endif
