/// The modules' boot loader (boot_loaders.md 8).
#include <avr/interrupt.h>
#include <stddef.h>
#include <string.h>

#include "../../../firmware/bootloader/avr/clock.h"
#include "../../../firmware/bootloader/avr/entry.h"
#include "../core/boot_frames.h"
#include "board.h"
#include "bus.h"
#include "i2c.h"

// A period is a blink: half of it on, half off.
#define PERIOD BOOT_COUNTS_OF_MS(400)
#define BLINK BOOT_COUNTS_OF_MS(200)
// How long it sleeps at most if nothing wakes it.
#define NAP (8 * CYCLES_PER_MS)
#define PATIENCE (600 * 1000UL / 400)

// Registers of the LED driver, a PCA9635 (datasheet, chapter 7), and what they are: awake; the
// published outputs; the brightness of all; and two bits for each output, from red of cell 0 on,
// which make it dark, or light it up with its brightness.
enum { FROM_MODE1 = 0x80, MODE2 = 0x01, LEDOUT0 = 0x14, REGISTERS = 0x17 };
enum { AWAKE = 0x80, BRIGHTNESS = 0x20 };
// The first four outputs. Those behind them go on alike: every third one.
enum { DARK = 0x00, GREEN = 0x08, BLUE = 0x20 };

static image_store_t store;
static boot_frames_t frames;
static uint8_t shown;

// A change of the controller's pin.
BOOT_VECTORS(BOOT_INTERRUPT(5), BOOT_WAKE(12))

// All of the driver's registers, since the application may have left them in any state. Takes 2.5
// ms, during which frames come in.
static void show(uint8_t outputs) {
    uint8_t registers[REGISTERS];
    if (outputs == shown) return;
    shown = outputs;
    memset(registers, BRIGHTNESS, LEDOUT0);
    registers[0] = AWAKE;
    registers[MODE2] = LED_DRIVER_MODE2;
    for (uint8_t i = LEDOUT0; i < REGISTERS; i++) {
        registers[i] = outputs;
        outputs = (uint8_t)(outputs >> 2 | outputs << 4);
    }
    (void)runtime_i2c_write(LED_DRIVER_ADDRESS, FROM_MODE1, registers, REGISTERS);
}

// As the robots' loader, but for the blink, which is that of the published one.
static uint8_t outputs(void) {
    if (store.state == STORE_COMPLETE) return GREEN;
    const bool lit =
        store.state > STORE_ANNOUNCED || (uint16_t)(boot_now - boot_period_began) < BLINK;
    return lit ? BLUE : DARK;
}

static void init(void) {
    boot_silence_chip();
    image_store_init(&store);
    boot_frames_init(&frames);
    boot_clock_init();
    runtime_i2c_init();
    boot_bus_init();
    boot_take_interrupts();
}

static void answer(void) {
    can_frame_t frame;
    if (frames.asked == BOOT_NOTHING_ASKED) return;
    boot_frames_answer(&frames, &store, frame.data);
    if (boot_bus_send(&frame)) frames.asked = BOOT_NOTHING_ASKED;
}

static void obey(const can_frame_t *frame) {
    boot_patience = PATIENCE;
    if (!frame->rtr && boot_frames_take(&frames, &store, frame->data, frame->length)) boot_leave();
}

__attribute__((used)) void boot_load(void) {
    init();
    for (;;) {
        boot_clock_keep(PERIOD);
        const can_frame_t *frame = boot_bus_oldest();
        if (frame != NULL) {
            obey(frame);
            boot_bus_drop_oldest();
        } else if (!image_store_work(&store)) {
            if (boot_starts_by_itself(&store)) boot_leave();
            cli();
            if (boot_bus_oldest() == NULL) boot_sleep(NAP);
            sei();
        }
        answer();
        show(outputs());
    }
}
