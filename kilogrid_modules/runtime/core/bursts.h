/// Bursts: infrared messages that the main loop sends in a row on behalf of the host, and the
/// lights that go with them (hardware.md 3.3, 3.7).
///
/// Pure. A burst holds a copy of what it sends, so that the next page may come in while one goes
/// out. The driver takes frame after frame, adds the checksum and sends:
///
///     burst_begin(&burst, &orders, job);           // interrupts off
///     do show(burst_light(&burst, &orders));
///     while (burst_next(&burst, &orders, &frame) && send(frame)) wait if (burst_pauses(&burst));
///     burst_end(&burst, &orders);                  // interrupts off
#ifndef MODULE_CORE_BURSTS_H
#define MODULE_CORE_BURSTS_H

#include <stdbool.h>
#include <stdint.h>

#include "../../../firmware/kilolib/core/infrared_frame.h"
#include "../../../firmware/kilolib/include/message.h"
#include "main_loop.h"

#ifdef __cplusplus
extern "C" {
#endif

/// RUN goes out so often by each cell before loop() is called.
#define BURST_RUN_ROUNDS 10
/// Darkness between the frames of a page, 0.37 ms: a receiver that lost its place in a frame waits
/// for a leader again, and loses that frame only. Its timeout runs from the last pulse, a slot
/// before the frame's end, which leaves 9 % for its clock. With the number of pages a page takes
/// 109 ms; an original dispatcher sends the next one's chunks 110 ms later (hardware.md 3.7).
#define BURST_GAP_CYCLES BYTE_TIMEOUT

/// A burst on its way; 155 bytes on the module.
typedef struct {
    uint8_t job;     ///< JOB_REPEAT, JOB_START_ROBOTS, JOB_ASK_ROBOTS or JOB_SEND_PAGE;
                     ///< JOB_NONE: no burst
    uint8_t sent;    ///< frames taken by burst_next()
    uint8_t frames;  ///< of the whole burst
    uint8_t cell;    ///< that a page goes out by
    uint8_t pages;   ///< of the robots' program
    uint8_t page;    ///< number of this page
    bool is_first;   ///< a first page of a lap follows the number of pages
    bool is_last;    ///< the lap ends with this page
    bool checked;    ///< `check` goes out with the number of pages
    uint8_t check[TRANSFER_CHECK_BYTES];
    message_t message;  ///< of all but JOB_SEND_PAGE; crc 0
    uint8_t bytes[TRANSFER_PAGE_BYTES];
} burst_t;

typedef struct {
    message_t message;  ///< crc 0: the driver computes it
    uint8_t cell;       ///< 0..3
} burst_frame_t;

/// A change of the lights.
typedef struct {
    uint8_t cells;  ///< bit per cell that changes; 0: none does
    uint8_t color;  ///< a color_t, at ADJUSTED brightness
} burst_light_t;

/// Begins the burst of a job: copies the message, or the page, which counts as taken from now on.
/// 350 cycles at most. Interrupts off.
void burst_begin(burst_t *burst, orders_t *orders, job_t job);

/// The light change that is due before the next frame, or, if there is none, before the burst ends.
burst_light_t burst_light(const burst_t *burst, const orders_t *orders);

/// Takes the next frame; false: the burst is over. RUN stops between two rounds once the state is
/// no longer RUNNING; the others go to their end.
bool burst_next(burst_t *burst, const orders_t *orders, burst_frame_t *frame);

/// Whether there is to be darkness for BURST_GAP_CYCLES before the next frame: between those of a
/// page, which come by one cell. Other frames go round the cells without a gap.
bool burst_pauses(const burst_t *burst);

/// Ends the burst: the robots count as started if the state is RUNNING still; after the last page
/// of a lap the next cell has its turn. Interrupts off.
void burst_end(burst_t *burst, orders_t *orders);

#ifdef __cplusplus
}
#endif

#endif
