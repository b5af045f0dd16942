/// The main loop of a module: which job comes next. Pure.
///
/// On the chip the loop goes round for ever. The emulator jumps from one job to the next: a job
/// that is JOB_NONE or JOB_BREATHE now stays so until a frame or the program changes the orders,
/// except that an answer may be due (orders_answer_due()).
#ifndef MODULE_CORE_MAIN_LOOP_H
#define MODULE_CORE_MAIN_LOOP_H

#include "orders.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    JOB_NONE,          ///< nothing until an interrupt changes the orders
    JOB_BEGIN,         ///< orders_begin()
    JOB_BREATHE,       ///< the next step of the breathing pattern (light_patterns.h)
    JOB_REPEAT,        ///< a burst: the forwarded message once by each cell
    JOB_SEND_PAGE,     ///< a burst: the page that came in, by one cell
    JOB_SET_UP,        ///< orders_begin_setup(), perhaps setup(), orders_end_setup()
    JOB_START_ROBOTS,  ///< a burst: RUN by each cell, ten rounds
    JOB_ASK_ROBOTS,    ///< a burst: a question of the host once by each cell
    JOB_LOOP,          ///< loop()
} job_t;

/// The job of the next pass. Depends on the orders alone: a handful of comparisons.
static inline job_t main_loop_job(const orders_t *orders) {
    if (orders->ask && orders->state != STATE_INIT) return JOB_ASK_ROBOTS;
    switch (orders->state) {
    case STATE_INIT: return JOB_BEGIN;
    case STATE_IDLE: return JOB_BREATHE;
    case STATE_SETUP_KILOBOTS: return JOB_REPEAT;
    case STATE_BOOTLOADING_KILOBOTS: return orders->page ? JOB_SEND_PAGE : JOB_NONE;
    case STATE_SETUP: return orders->set_up && !orders->autostart ? JOB_NONE : JOB_SET_UP;
    case STATE_RUNNING: return orders->started ? JOB_LOOP : JOB_START_ROBOTS;
    default: return JOB_NONE;
    }
}

#ifdef __cplusplus
}
#endif

#endif
