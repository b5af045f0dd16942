/// The parameters of the program; names, keys, meanings, units and ranges are in default_params.h.
#ifndef AGGREGATION_PARAMS_H
#define AGGREGATION_PARAMS_H

#include <stdbool.h>
#include <stdint.h>

#include "wire.h"

/// Values of the parameters that choose between readings.
enum { RULE_SIMPLIFIED, RULE_FIRAT };
enum { SIGNAL_FROM_REST, SIGNAL_FROM_CROSSING };
enum { FIRST_LEAVE_NEXT_STEP, FIRST_LEAVE_FULL_PERIOD };
enum { WALK_OUT_WALK, WALK_OUT_REST };
enum { ENTRY_OBSTACLE_TURN, ENTRY_OBSTACLE_REST, ENTRY_OBSTACLE_PAUSE };
enum { FIRAT_JOIN_CROSSING, FIRAT_JOIN_FIRST_UPDATE, FIRAT_JOIN_EVERY_UPDATE };
enum { FIRAT_SIGNAL_FROM_CROSSING, FIRAT_SIGNAL_FROM_REST };
enum { START_ON_SITE_ENTERED, START_ON_SITE_MUST_LEAVE };
enum { UPDATE_CLOCK_OWN, UPDATE_CLOCK_COMMON };
enum { PUSHED_OFF_STAY, PUSHED_OFF_WALK };

/// The narrowest type that holds a parameter's largest value: 53 bytes in all instead of 112.
#define PARAMS_TYPE(most)             \
    __typeof__(__builtin_choose_expr( \
        (most) > 0xFFFF, (uint32_t)0, \
        __builtin_choose_expr((most) > 0xFF, (uint16_t)0, (uint8_t)0)))
// NOLINTNEXTLINE(bugprone-macro-parentheses): declares a name
#define PARAMS_FIELD(name, key, preset, least, most) PARAMS_TYPE(most) name;

/// One field for each parameter, named like its key: params.UPDATE_TICKS.
typedef struct {
    WIRE_CONFIG_KEYS(PARAMS_FIELD)
} params_t;

/// All parameters at their defaults.
void params_reset(params_t *params);

/// Sets the parameter with the WIRE_KEY_ `key`. False, and nothing is changed, if there is none or
/// if the value is out of its range.
bool params_set(params_t *params, uint8_t key, uint32_t value);

#endif
