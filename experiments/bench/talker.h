/// Messages of the programs of `kilotwin bench`: each robot says that it is here, and counts the
/// frames that it receives.
#ifndef BENCH_TALKER_H
#define BENCH_TALKER_H

#include <kilolib.h>

static message_t message;
static uint16_t heard;

static void count_received(message_t *received, distance_measurement_t *distance) {
    (void)received;
    (void)distance;
    heard++;
}

static message_t *say_here(void) { return &message; }

/// To be called by main(), before kilo_start().
static void prepare_to_talk(message_tx_t transmit) {
    kilo_message_rx = count_received;
    kilo_message_tx = transmit;
    kilo_init();
    message.data[0] = (uint8_t)kilo_uid;
    message.data[1] = (uint8_t)(kilo_uid >> 8);
    message.crc = message_crc(&message);
}

#endif
