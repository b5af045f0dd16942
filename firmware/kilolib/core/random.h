/// Random numbers of the API (hardware.md 1.7): rand_soft() in random_soft.c, rand_hard() in
/// random_hard.c. Robots, modules and the emulator's guests share them.
///
/// Neither is protected against interrupts: a call from a callback may fall into one from loop(),
/// and both then return the same number.
#ifndef KILOLIB_CORE_RANDOM_H
#define KILOLIB_CORE_RANDOM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Sets rand_soft()'s seed, 0xAA at power-up. Its counter goes on as it was.
void kilolib_random_seed(uint8_t seed);

/// Noise for rand_hard(): a bit that is 0 or 1 by chance, though perhaps not equally often.
/// Implemented by the driver of the converter; called up to 2,048 times by one rand_hard().
uint8_t kilolib_random_noise_bit(void);

/// Hold interrupts back and let them through, as the original does around all bits of a number.
void kilolib_random_hold(void);
void kilolib_random_release(void);

#ifdef __cplusplus
}
#endif

#endif
