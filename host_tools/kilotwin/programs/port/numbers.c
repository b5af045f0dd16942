/// Handlers that the compiler's checks call on the chip where a number does not fit its type
/// (numbers.py). The calls are watched. Each handler does something of its own, so that the
/// compiler does not make one function of several.
#include <avr/io.h>

void __ubsan_handle_add_overflow(void *place, void *left, void *right) { GPIOR0 = 1; }
void __ubsan_handle_sub_overflow(void *place, void *left, void *right) { GPIOR0 = 2; }
void __ubsan_handle_mul_overflow(void *place, void *left, void *right) { GPIOR0 = 3; }
void __ubsan_handle_negate_overflow(void *place, void *value) { GPIOR0 = 4; }
void __ubsan_handle_divrem_overflow(void *place, void *left, void *right) { GPIOR0 = 5; }
void __ubsan_handle_float_cast_overflow(void *place, void *value) { GPIOR0 = 6; }
