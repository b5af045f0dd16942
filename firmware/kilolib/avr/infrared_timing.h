/// The time slots of a frame, in cycles of 125 ns (hardware.md 1.6).
///
/// A frame is a leader byte of zero and the twelve bytes of a message. A byte is ten slots: a start
/// pulse, eight bits from the lowest on, of which a 1 is a pulse and a 0 is none, a stop pulse.
#ifndef KILOLIB_AVR_INFRARED_TIMING_H
#define KILOLIB_AVR_INFRARED_TIMING_H

#define SLOT_CYCLES 269
#define BYTE_SLOTS 10
#define STOP_SLOT 9

#endif
