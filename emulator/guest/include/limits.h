/// The compiler's own, with the names that avr-gcc has beside.
#ifndef KT_LIMITS_H
#define KT_LIMITS_H

#include_next <limits.h>

#ifndef LONG_LONG_MAX
#define LONG_LONG_MAX __LONG_LONG_MAX__
#define LONG_LONG_MIN (-LONG_LONG_MAX - 1LL)
#define ULONG_LONG_MAX (LONG_LONG_MAX * 2ULL + 1)
#endif

#endif
