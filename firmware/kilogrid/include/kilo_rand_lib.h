/// Random numbers on libc's random(), for robots and modules.
#ifndef __KILO_RAND_LIB_H__
#define __KILO_RAND_LIB_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <math.h>
#include <stdint.h>

/// |N(mu, sigma)| seconds, rounded down to whole ones, in ticks. The including file has
/// TICKS_PER_SEC.
#define INT_GAUSSIAN_TICKS(mu_s, sigma_s) \
    ((uint32_t)(floor(fabs(g_ran_gaussian((mu_s), (sigma_s)))) * TICKS_PER_SEC))

/// Seeds random(). 0 stands for four bytes of rand_hard().
void g_ran_set_seed_uint32(uint32_t seed);

/// Uniform in [0, 1], both ends included.
double g_ran_uniform(void);

/// Uniform over 0..2^32 - 1, in steps of 2.
uint32_t g_ran_uniform_uint32(void);

/// Exponential with rate `lambda` > 0, mean 1 / lambda.
double g_ran_exponential(double lambda);

/// Normal. Draws two numbers at a time (Box and Muller 1958), the second of which the next call
/// takes.
double g_ran_gaussian(double mu, double sigma);

#endif
