/// The infrared messages of a robot's boot loader (boot_loaders.md 5): what they do to the image
/// store, and the robot's answers.
///
/// Pure: messages in, orders and messages out. All are of kilolib's size and CRC; those of types
/// beyond CALIB are ours, and original loaders and kilolib ignore them.
#ifndef BOOTLOADER_CORE_BOOT_MESSAGES_H
#define BOOTLOADER_CORE_BOOT_MESSAGES_H

#include <stdint.h>

#include "../../kilolib/core/robot_query.h"
#include "image_store.h"
#include "message.h"

#ifdef __cplusplus
extern "C" {
#endif

/// From slot to slot: a frame of 4.37 ms, what decides on sending it, and a guard.
#define BOOT_SLOT_MS 15

/// Orders of a message to the loader.
typedef enum {
    BOOT_ORDER_NONE,
    BOOT_ORDER_ANSWER,  ///< `query` is filled in
    BOOT_ORDER_LEAVE,   ///< start the application if there is one, else stay
} boot_order_t;

/// A query that is to be answered.
typedef struct {
    uint8_t first;  ///< of BOOT_REPORT_PAGES pages, or BOOT_QUERY_IDENTITY
    uint8_t slot;   ///< begins so many BOOT_SLOT_MS after the query
} boot_query_t;

/// Takes a message with a right CRC. `uid` is the robot's.
boot_order_t boot_message_take(image_store_t *store, const message_t *message, uint16_t uid,
                               boot_query_t *query);

/// Makes the answer to a query for `first`, CRC included, from how things stand now.
void boot_message_report(const image_store_t *store, uint8_t first, uint16_t uid,
                         message_t *message);

#ifdef __cplusplus
}
#endif

#endif
