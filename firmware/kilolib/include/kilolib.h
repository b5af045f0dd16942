/// The Kilobot API, version 2, as robot programs know it.
///
/// The same header serves the robot (ATmega328P), the emulator and tests on a PC: a program says
/// <kilolib.h> and knows no more. It includes <stdint.h>, message.h and message_crc.h, on which
/// programs rely.
///
/// A program installs its callbacks, calls kilo_init() and kilo_start(), and lives in loop() and
/// the callbacks from then on. loop() is called as often as the processor can, thousands of times
/// in a tick: nothing is in step with the ticks but what the program keeps in step. Callbacks
/// interrupt loop() anywhere, so what both touch has to be a single byte or be read with care.
#ifndef __KILOLIB_H__
#define __KILOLIB_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

#include "message.h"
#include "message_crc.h"

/// A colour of the LED for set_color(): each part 0..3.
#define RGB(r, g, b) (((r)&3) | (((g)&3) << 2) | (((b)&3) << 4))

/// Rounded. A tick is 32.768 ms, so there are 30.518 in a second.
#define TICKS_PER_SEC 31

/// Called by the runtime; NULL is not allowed. Until the program installs its own, received
/// messages are ignored and nothing is sent. (Declared with C++ linkage in C++, like upstream.)
extern message_rx_t kilo_message_rx;
extern message_tx_t kilo_message_tx;
extern message_tx_success_t kilo_message_tx_success;

// Empty parentheses, as upstream: some programs call these functions with arguments, which are
// ignored.
#ifdef __cplusplus
extern "C" {
#endif

/// Ticks since kilo_init(). Four bytes that an interrupt counts up: on the robot a plain read can
/// catch them half-way. A program may assign it.
extern volatile uint32_t kilo_ticks;

/// Least time between two messages sent, in units of 128 us. 3906 at the start: every 16 ticks.
extern volatile uint16_t kilo_tx_period;

/// The robot's own number, from its EEPROM.
extern uint16_t kilo_uid;

/// Motor values that make this robot turn and go straight, from its EEPROM, for set_motors().
extern uint8_t kilo_turn_left;
extern uint8_t kilo_turn_right;
extern uint8_t kilo_straight_left;
extern uint8_t kilo_straight_right;

/// Sets up the robot, reads its EEPROM and switches interrupts on. Leaves the callbacks alone.
void kilo_init();

/// Waits for RUN, calls setup() once, then loop() for ever. Never returns. A pause stops the calls
/// of loop() and the motors; the RUN after it goes on with loop() only.
void kilo_start(void (*setup)(void), void (*loop)(void));

/// Distance between the centres of sender and receiver in mm; 33 means that they touch.
uint8_t estimate_distance(const distance_measurement_t *measurement);

/// Waits. Interrupts go on, loop() does not.
void delay(uint16_t ms);

/// Eight random bits from the noise of the converter. Takes about 0.5 ms.
uint8_t rand_hard();
/// Eight pseudo-random bits: fast, short period, the same on every robot unless seeded.
uint8_t rand_soft();
void rand_seed(uint8_t seed);

/// 0..1023, or -1 when a message is being received at this instant.
int16_t get_ambientlight();
int16_t get_voltage();
int16_t get_temperature();

/// Motor values 0 (off) .. 255. The left motor alone turns the robot left (counter-clockwise).
/// A motor does not start from standstill at the usual values: see spinup_motors().
void set_motors(uint8_t left, uint8_t right);
/// Both motors at 255 for 15 ms, which overcomes their static friction. Call set_motors() next.
void spinup_motors();

/// Lights the LED; `rgb` is made by RGB(), 0 is off.
void set_color(uint8_t rgb);

#ifdef __cplusplus
}
#endif

// A program that defines this was written for the Kilombo simulator, whose kilolib.h has its names.
#ifdef SIMULATOR
#include "kilombo.h"
#endif

#endif
