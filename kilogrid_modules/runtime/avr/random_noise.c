/// Noise for rand_hard() on a module: the lowest bit of a conversion of the receiver's dark signal.
#include <util/atomic.h>

#include "../../../firmware/kilolib/core/random.h"
#include "board.h"
#include "infrared.h"
#include "rand.h"

void rand_set_seed(uint8_t seed) { kilolib_random_seed(seed); }

// A conversion in the middle of a frame would spoil its strength.
uint8_t kilolib_random_noise_bit(void) {
    uint8_t bit = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        if (!runtime_infrared_receiving()) ADCSRA |= BIT(ADSC);
        while (ADCSRA & BIT(ADSC)) {
        }
        bit = (uint8_t)ADC & 1;
    }
    return bit;
}
