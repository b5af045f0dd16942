#include "frame_sender.h"

#include <avr/io.h>

#include "../core/infrared_frame.h"

// Waits, in loops of three cycles.
#define LEADER_WAIT 176
#define SAME_BYTE_WAIT 83
#define NEXT_BYTE_WAIT 80

// A pulse is nine cycles long. From pulse to pulse it is 269 cycles, whatever is sent: all ways
// through the loop take the same time. The cycles of an instruction, or of a line, stand behind it.
bool kilolib_infrared_send_frame(const message_t *message, uint8_t pins) {
    const uint8_t *next = (const uint8_t *)message;
    const uint8_t dark = PORTB;
    const uint8_t lit = PORTB | pins;
    uint8_t wait = LEADER_WAIT;
    uint8_t polls = LEADER_POLLS;
    uint8_t bytes = FRAME_BYTES;
    // Slots left of a byte, the next one lowest: at first the leader's stop.
    uint8_t slots = 1;
    uint8_t low = 1, high = 0;
    __asm__ volatile(
        "out %[port], %[lit]            \n"
        "rjmp .+0 $ rjmp .+0 $ rjmp .+0 $ rjmp .+0 \n"  // 8
        "out %[port], %[dark]           \n"             // 1
        "1: dec %[wait]                 \n"
        "brne 1b                        \n"  // 3 * 176 - 1
        "nop                            \n"  // 1
        "nop                            \n"  // 1, two slots are over
        "2: in __tmp_reg__, %[acsr]     \n"  // 1
        "sbrc __tmp_reg__, %[aco]       \n"  // 2
        "rjmp 6f                        \n"
        "rjmp .+0                       \n"  // 2
        "dec %[polls]                   \n"  // 1
        "brne 2b                        \n"  // 2, 1 the last time

        "3: mov __tmp_reg__, %[dark]    \n"             // 1
        "sbrc %[low], 0                 \n"             // 2 with the next, either way
        "mov __tmp_reg__, %[lit]        \n"             //
        "out %[port], __tmp_reg__       \n"             // 1
        "rjmp .+0 $ rjmp .+0 $ rjmp .+0 $ rjmp .+0 \n"  // 8
        "out %[port], %[dark]           \n"             // 1
        "lsr %[high]                    \n"             // 1
        "ror %[low]                     \n"             // 1
        "dec %[slots]                   \n"             // 1
        "breq 4f                        \n"             // 1
        "nop                            \n"             // 1
        "ldi %[wait], %[same_byte]      \n"
        "1: dec %[wait]                 \n"
        "brne 1b                        \n"  // 3 * 83
        "rjmp 3b                        \n"  // 2, together 269

        "4: ldi %[wait], %[next_byte]   \n"  // 2 for the way here
        "1: dec %[wait]                 \n"
        "brne 1b                        \n"  // 3 * 80
        "dec %[bytes]                   \n"  // 1
        "breq 6f                        \n"  // 1, at the end of the last slot
        "ld %[low], %a[next]+           \n"  // 2
        "ldi %[high], 1                 \n"  // 1
        "sec                            \n"  // 1
        "rol %[low]                     \n"  // 1, a start in front of the bits
        "rol %[high]                    \n"  // 1, a stop behind them
        "ldi %[slots], %[byte_slots]    \n"  // 1
        "rjmp 3b                        \n"  // 2, together 269
        "6:                             \n"
        : [wait] "+d"(wait), [polls] "+d"(polls), [bytes] "+r"(bytes), [slots] "+d"(slots),
          [low] "+r"(low), [high] "+d"(high), [next] "+e"(next)
        : [port] "I"(_SFR_IO_ADDR(PORTB)), [acsr] "I"(_SFR_IO_ADDR(ACSR)), [aco] "I"(ACO),
          [lit] "r"(lit), [dark] "r"(dark), [same_byte] "M"(SAME_BYTE_WAIT),
          [next_byte] "M"(NEXT_BYTE_WAIT), [byte_slots] "M"(BYTE_SLOTS)
        : "memory");
    return bytes == 0;
}
