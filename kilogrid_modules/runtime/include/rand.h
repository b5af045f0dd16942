/// Random bytes. A program may use libc's rand() and random() as well.
#ifndef __RAND_H__
#define __RAND_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Eight random bits from the noise of the converter. Takes about 0.5 ms.
uint8_t rand_hard(void);
/// Eight pseudo-random bits: fast, short period, the same on every module unless seeded.
uint8_t rand_soft(void);
/// Seeds rand_soft(): by rand_hard(), if modules are to differ.
void rand_set_seed(uint8_t seed);

#ifdef __cplusplus
}
#endif

#endif
