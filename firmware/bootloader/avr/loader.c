#include "loader.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <util/atomic.h>

#include "../../kilolib/avr/board.h"
#include "../../kilolib/avr/infrared_send.h"
#include "../../kilolib/core/calibration.h"
#include "../../kilolib/core/eeprom_map.h"
#include "../../kilolib/core/pins.h"
#include "../../kilolib/core/timer.h"
#include "../core/boot_messages.h"
#include "kilolib.h"
#include "receiver.h"

#define ERASED 0xFF
#define COUNTS_OF_MS(ms) ((ms)*CYCLES_PER_MS / COUNT_CYCLES)
#define SECOND COUNTS_OF_MS(1000)
#define BLINK COUNTS_OF_MS(5)
#define SLOT COUNTS_OF_MS(BOOT_SLOT_MS)
#define PATIENCE_S 600
#define ATTEMPTS 4

static image_store_t store;
static uint16_t uid;
// Counts of timer 0, of 128 us each, with more bits than it has; differences count.
static uint16_t now, second_began, answer_at;
static uint16_t seconds_in_silence;
static boot_query_t query;
static uint8_t attempts;  // left to answer it

// The application that was left may have had any part of the chip at work.
static void silence_chip(void) {
    eeprom_busy_wait();
    EIMSK = PCICR = TIMSK0 = TIMSK1 = TIMSK2 = ADCSRA = SPCR = TWCR = UCSR0B = EECR = 0;
    DDRB = DDRC = DDRD = 0;
    PORTB = PORTC = 0;
    PORTD = DDRD = RECEIVER_POWER;
}

static void move_vectors(uint8_t place) {
    MCUCR = BIT(IVCE);
    MCUCR = place;
}

static void init(void) {
    silence_chip();
    const uint8_t osccal = kilolib_eeprom_read(EEPROM_OSCCAL);
    if (osccal != ERASED) OSCCAL = osccal;
    uid = (uint16_t)(kilolib_eeprom_read(EEPROM_UID) | kilolib_eeprom_read(EEPROM_UID + 1) << 8);
    image_store_init(&store);
    kilolib_infrared_send_init();
    TCCR0A = 0;
    TCCR0B = BIT(CS02) | BIT(CS00);
    receiver_init();
    move_vectors(BIT(IVSEL));
    sei();
}

// To what is valid, with the chip as after a reset. Returns if nothing is.
static void leave(void) {
    const uint16_t entry = image_application_entry();
    if (entry == IMAGE_NO_ENTRY) return;
    cli();
    move_vectors(0);
    receiver_stop();
    TCCR0B = 0;
    DDRB = DDRC = DDRD = 0;
    PORTD = 0;
    boot_application(entry, 0);
}

static void obey(const message_t *message) {
    seconds_in_silence = 0;
    switch (boot_message_take(&store, message, uid, &query)) {
    case BOOT_ORDER_ANSWER:
        answer_at = (uint16_t)(now + query.slot * SLOT);
        attempts = ATTEMPTS;
        break;
    case BOOT_ORDER_LEAVE: leave(); break;
    case BOOT_ORDER_NONE: break;
    }
}

// When others send in its slot, the next one is tried.
static void answer(void) {
    message_t message;
    if (attempts == 0 || (int16_t)(now - answer_at) < 0) return;
    answer_at = (uint16_t)(answer_at + SLOT);
    attempts--;
    if (receiver_in_frame()) return;
    boot_message_report(&store, query.first, uid, &message);
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        if (kilolib_infrared_send(&message)) attempts = 0;
    }
}

// Often enough: timer 0 wraps after 33 ms.
static void keep_time(void) {
    now = (uint16_t)(now + (uint8_t)(TCNT0 - (uint8_t)now));
    if ((uint16_t)(now - second_began) < SECOND) return;
    second_began = (uint16_t)(second_began + SECOND);
    if (seconds_in_silence < PATIENCE_S) seconds_in_silence++;
}

// Blue and green are all that is on port C.
static void show(void) {
    const bool lit = store.state > STORE_ANNOUNCED || (uint16_t)(now - second_began) < BLINK;
    uint8_t pins = lit ? led_pins(RGB(0, 0, 3)).ddrc : 0;
    if (store.state == STORE_COMPLETE) pins = led_pins(RGB(0, 3, 0)).ddrc;
    DDRC = pins;
}

static bool starts_by_itself(void) {
    return store.state == STORE_COMPLETE &&
           (!store.image.checked || seconds_in_silence == PATIENCE_S);
}

__attribute__((used)) void boot_load(void) {
    init();
    for (;;) {
        keep_time();
        const message_t *message = receiver_oldest();
        if (message != NULL) {
            if (image_crc(message, sizeof *message) == 0) obey(message);
            receiver_drop_oldest();
        } else if (!image_store_work(&store) && starts_by_itself()) {
            leave();
        }
        answer();
        show();
    }
}
