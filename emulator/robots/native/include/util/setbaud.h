/// UBRR_VALUE and USE_2X for the BAUD and F_CPU that the program has defined. May be included again
/// with other values.
#if !defined(F_CPU) || !defined(BAUD)
#error "setbaud.h needs F_CPU and BAUD"
#endif

#undef UBRR_VALUE
#undef UBRRL_VALUE
#undef UBRRH_VALUE
#undef USE_2X

#ifndef BAUD_TOL
#define BAUD_TOL 2
#endif

#define UBRR_VALUE (((F_CPU) + 8UL * (BAUD)) / (16UL * (BAUD)) - 1UL)
#define USE_2X 0

#if 100 * (F_CPU) > (16 * (UBRR_VALUE + 1)) * (100 * (BAUD) + (BAUD) * (BAUD_TOL)) || \
    100 * (F_CPU) < (16 * (UBRR_VALUE + 1)) * (100 * (BAUD) - (BAUD) * (BAUD_TOL))
#undef UBRR_VALUE
#undef USE_2X
#define UBRR_VALUE (((F_CPU) + 4UL * (BAUD)) / (8UL * (BAUD)) - 1UL)
#define USE_2X 1
#endif

#define UBRRL_VALUE (UBRR_VALUE & 0xFF)
#define UBRRH_VALUE (UBRR_VALUE >> 8)
