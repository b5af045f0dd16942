// Calls the routines of avr-libc and libgcc that the engine computes, so that they are linked.
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

volatile float a, b;
volatile int32_t number;
volatile uint32_t bits;
volatile int16_t small;
volatile uint16_t few;
volatile uint8_t is;

int main(void) {
    a += b;
    a -= b;
    a = a * b;
    a = a / b;
    is = a < b;
    is = a > b;
    a = number;
    a = bits;
    a = sin(b);
    number = rand();
    number = number / 3;
    bits = bits / number;
    small = small / 7;
    few = few / small;
    return 0;
}
