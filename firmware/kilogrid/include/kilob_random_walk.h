/// A random walk: straight on for a while, then a turn to the left or to the right for a while.
#ifndef KILOB_RANDOM_WALK_H
#define KILOB_RANDOM_WALK_H

#include "kilo_rand_lib.h"
#include "kilolib.h"
#include "utils.h"

/// Sets the walk's times, in seconds, and starts it anew. A straight leg lasts |N(forward_mu,
/// forward_sigma)|, a turn |N(rotation_mu, rotation_span)|, both in whole seconds, rounded down.
/// Without a call it is (3.0, 1.5, 1.5, 3.0).
void kilob_random_walk_init(double forward_mu_s, double forward_sigma_s, double rotation_mu_s,
                            double rotation_span_s);

/// One step: call it from loop() as often as you like. Sets motors where a leg or a turn begins,
/// which blocks for 20 ms (utils.h); costs a comparison of ticks otherwise.
void kilob_random_walk(void);

/// Starts with a new straight leg.
void kilob_random_walk_reset(void);

#endif
