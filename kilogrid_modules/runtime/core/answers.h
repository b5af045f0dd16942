/// Answers to the host: data bytes of the frames that follow a poll or a request for the health
/// report (hardware.md 3.2, kilogrid.dbc). Pure; the identifier is the module's own (address.h).
///
/// A poll is answered by the number of waiting records, then by the records, oldest first. The host
/// gets time to take them in: so long after the first frame, so long after each record.
#ifndef MODULE_CORE_ANSWERS_H
#define MODULE_CORE_ANSWERS_H

#include <stdint.h>

#include "orders.h"

#ifdef __cplusplus
extern "C" {
#endif

#define ANSWERS_AFTER_START_US 1000
#define ANSWERS_AFTER_RECORD_US 500

/// Data bytes of a CAN frame.
#define ANSWERS_BYTES 8

/// Contents of a health report beside the orders.
typedef struct {
    uint16_t config_crc;      ///< CRC-16/MCRF4XX of answers_configured() bytes; of none 0xFFFF
    uint16_t uptime_s;        ///< stays at 65,535
    uint8_t config_size;      ///< the program's configuration_size
    uint8_t lost_records;     ///< record_store_t
    uint8_t transmit_errors;  ///< TEC of the CAN controller
    uint8_t receive_errors;   ///< REC
} health_facts_t;

/// The first frame of the answer to a poll: `waiting` records follow. Returns its data length.
uint8_t answers_poll(uint8_t waiting, uint8_t data[ANSWERS_BYTES]);

/// Part 0 or 1 of the health report. Returns its data length.
uint8_t answers_health(const orders_t *orders, uint8_t part, const health_facts_t *facts,
                       uint8_t data[ANSWERS_BYTES]);

/// How many bytes of the configuration are whole: 0 while a new one is on its way.
uint8_t answers_configured(const orders_t *orders, uint8_t config_size);

#ifdef __cplusplus
}
#endif

#endif
