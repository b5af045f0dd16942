/// Messages through queues instead of callbacks.
///
/// kilo_message_buffered() installs callbacks that put what comes in into a queue and send what is
/// in another. The program calls rxbuffer_* and txbuffer_* from loop(); no locks are needed, since
/// each index is one byte that one side alone writes. Checksums are the program's business:
/// txbuffer_push() sends the crc it is given.
///
/// Everything is in this header, as upstream, so that a program may choose the sizes. `weak` lets
/// several files of a program include it and share the queues.
#ifndef __MESSAGE_BUFFERED_H__
#define __MESSAGE_BUFFERED_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stddef.h>

#include "kilolib.h"

/// Messages that fit, 1..254. All files of a program have to agree.
#ifndef RXBUFFER_SIZE
#define RXBUFFER_SIZE 16
#endif
#ifndef TXBUFFER_SIZE
#define TXBUFFER_SIZE 4
#endif

#ifdef __cplusplus
extern "C" {
#endif

/// A message as it was received. The distance is raw: estimate_distance() makes millimetres of it.
typedef struct {
    message_t msg;
    distance_measurement_t dist;
} received_message_t;

/// One slot is always free: it tells a full queue from an empty one.
typedef struct {
    volatile uint8_t first;  ///< written by the side that takes out
    volatile uint8_t end;    ///< written by the side that puts in
    received_message_t slots[RXBUFFER_SIZE + 1];
} rxbuffer_t;

/// Likewise for messages to send; here the interrupt takes out.
typedef struct {
    volatile uint8_t first;
    volatile uint8_t end;
    message_t slots[TXBUFFER_SIZE + 1];
} txbuffer_t;

/// The two queues of the program. Use the functions below; the layout is not part of the API.
__attribute__((weak)) rxbuffer_t rxbuffer;
__attribute__((weak)) txbuffer_t txbuffer;

/// Keeps the compiler from moving the access to a slot past the write of the index that gives the
/// slot away.
static inline void message_buffered_settle(void) { __asm__ volatile("" ::: "memory"); }

/// The index behind `index`, in a ring of `size` + 1 slots.
static inline uint8_t message_buffered_after(uint8_t index, uint8_t size) {
    return index == size ? 0 : (uint8_t)(index + 1);
}

/// How many slots of such a ring are in use, 0..size.
static inline uint8_t message_buffered_count(uint8_t first, uint8_t end, uint8_t size) {
    return (uint8_t)(end >= first ? end - first : end + size + 1 - first);
}

/// Messages received and not yet taken out.
__attribute__((weak)) uint8_t rxbuffer_size(void) {
    return message_buffered_count(rxbuffer.first, rxbuffer.end, RXBUFFER_SIZE);
}

/// The callback for received messages. When the queue is full the new message is lost.
__attribute__((weak)) void rxbuffer_push(message_t *msg, distance_measurement_t *dist) {
    const uint8_t end = rxbuffer.end;
    const uint8_t after = message_buffered_after(end, RXBUFFER_SIZE);
    if (after == rxbuffer.first) return;
    rxbuffer.slots[end].msg = *msg;
    rxbuffer.slots[end].dist = *dist;
    message_buffered_settle();
    rxbuffer.end = after;
}

/// The oldest message, or NULL; `dist` is set only if there is one. It stays valid until the pop.
__attribute__((weak)) message_t *rxbuffer_peek(distance_measurement_t *dist) {
    const uint8_t first = rxbuffer.first;
    if (first == rxbuffer.end) return NULL;
    *dist = rxbuffer.slots[first].dist;
    return &rxbuffer.slots[first].msg;
}

/// Takes out the oldest message, if there is one; what rxbuffer_peek() gave is not valid any more.
__attribute__((weak)) void rxbuffer_pop(void) {
    const uint8_t first = rxbuffer.first;
    message_buffered_settle();
    if (first != rxbuffer.end) rxbuffer.first = message_buffered_after(first, RXBUFFER_SIZE);
}

/// Messages waiting to be sent.
__attribute__((weak)) uint8_t txbuffer_size(void) {
    return message_buffered_count(txbuffer.first, txbuffer.end, TXBUFFER_SIZE);
}

/// Puts a message in the queue. When the queue is full it is lost: check txbuffer_size() first.
__attribute__((weak)) void txbuffer_push(message_t *msg) {
    const uint8_t end = txbuffer.end;
    const uint8_t after = message_buffered_after(end, TXBUFFER_SIZE);
    if (after == txbuffer.first) return;
    txbuffer.slots[end] = *msg;
    message_buffered_settle();
    txbuffer.end = after;
}

/// The callback for sending: the oldest message, or NULL.
__attribute__((weak)) message_t *txbuffer_peek(void) {
    const uint8_t first = txbuffer.first;
    return first == txbuffer.end ? NULL : &txbuffer.slots[first];
}

/// The callback for a message sent: takes it out.
__attribute__((weak)) void txbuffer_pop(void) {
    const uint8_t first = txbuffer.first;
    message_buffered_settle();
    if (first != txbuffer.end) txbuffer.first = message_buffered_after(first, TXBUFFER_SIZE);
}

/// Empties both queues and installs the callbacks. Call it before kilo_start().
static inline void kilo_message_buffered(void) {
    rxbuffer.first = rxbuffer.end = 0;
    txbuffer.first = txbuffer.end = 0;
    kilo_message_rx = rxbuffer_push;
    kilo_message_tx = txbuffer_peek;
    kilo_message_tx_success = txbuffer_pop;
}

#ifdef __cplusplus
}
#endif

#endif
