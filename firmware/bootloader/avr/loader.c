/// The robots' boot loader (boot_loaders.md 7).
#include <avr/interrupt.h>
#include <stddef.h>
#include <util/atomic.h>

#include "../../kilolib/avr/board.h"
#include "../../kilolib/avr/infrared_send.h"
#include "../../kilolib/core/calibration.h"
#include "../../kilolib/core/eeprom_map.h"
#include "../../kilolib/core/pins.h"
#include "../core/boot_messages.h"
#include "clock.h"
#include "entry.h"
#include "kilolib.h"
#include "receiver.h"

#define ERASED 0xFF
#define SECOND BOOT_COUNTS_OF_MS(1000)
#define BLINK BOOT_COUNTS_OF_MS(5)
#define SLOT BOOT_COUNTS_OF_MS(BOOT_SLOT_MS)
#define PATIENCE_S 600
#define ATTEMPTS 4
// How long it sleeps at most if nothing wakes it: less than the LED's blink; while it has to
// answer, less than a slot's guard.
#define NAP (4 * CYCLES_PER_MS)
#define SHORT_NAP (CYCLES_PER_MS / 4)

static image_store_t store;
static uint16_t uid, answer_at;
static boot_query_t query;
static uint8_t attempts;  // left to answer it

// Timer 1, which times edges, and the comparator.
BOOT_VECTORS("", BOOT_INTERRUPT(11) BOOT_WAKE(12) BOOT_INTERRUPT(23))

static void init(void) {
    boot_silence_chip();
    PORTD = DDRD = RECEIVER_POWER;
    const uint8_t osccal = kilolib_eeprom_read(EEPROM_OSCCAL);
    if (osccal != ERASED) OSCCAL = osccal;
    uid = (uint16_t)(kilolib_eeprom_read(EEPROM_UID) | kilolib_eeprom_read(EEPROM_UID + 1) << 8);
    image_store_init(&store);
    kilolib_infrared_send_init();
    boot_clock_init();
    receiver_init();
    boot_take_interrupts();
}

static void obey(const message_t *message) {
    boot_patience = PATIENCE_S;
    switch (boot_message_take(&store, message, uid, &query)) {
    case BOOT_ORDER_ANSWER:
        answer_at = (uint16_t)(boot_now + query.slot * SLOT);
        attempts = ATTEMPTS;
        break;
    case BOOT_ORDER_LEAVE: boot_leave(); break;
    case BOOT_ORDER_NONE: break;
    }
}

// When others send in its slot, the next one is tried.
static void answer(void) {
    message_t message;
    if (attempts == 0 || (int16_t)(boot_now - answer_at) < 0) return;
    answer_at = (uint16_t)(answer_at + SLOT);
    attempts--;
    if (receiver_in_frame()) return;
    boot_message_report(&store, query.first, uid, &message);
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        if (kilolib_infrared_send(&message)) attempts = 0;
    }
}

// Blue and green are all that is on port C.
static void show(void) {
    const bool lit =
        store.state > STORE_ANNOUNCED || (uint16_t)(boot_now - boot_period_began) < BLINK;
    uint8_t pins = lit ? led_pins(RGB(0, 0, 3)).ddrc : 0;
    if (store.state == STORE_COMPLETE) pins = led_pins(RGB(0, 3, 0)).ddrc;
    DDRC = pins;
}

__attribute__((used)) void boot_load(void) {
    init();
    for (;;) {
        boot_clock_keep(SECOND);
        const message_t *message = receiver_oldest();
        if (message != NULL) {
            if (image_crc(message, sizeof *message) == 0) obey(message);
            receiver_drop_oldest();
        } else if (!image_store_work(&store)) {
            if (boot_starts_by_itself(&store)) boot_leave();
            cli();
            if (receiver_oldest() == NULL) boot_sleep(attempts != 0 ? SHORT_NAP : NAP);
            sei();
        }
        answer();
        show();
    }
}
