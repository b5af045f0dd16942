/// Binary interface between the engine and a guest: a program of a robot or of a Kilogrid module,
/// with the thin half of the API (robots/native/side) linked in.
///
/// A guest is one shared object. Its variables are private to each robot, or module: they lie in
/// one section, which the engine swaps. Guests are compiled with -fpack-struct -fshort-enums, so
/// only packed types of fixed width cross here. Times are cycles of 125 ns.
///
/// Control: the engine calls the guest through kt_table_t, on the guests' stack (stack.h), and the
/// guest calls the engine through kt_host_t, always on behalf of the robot or module that is
/// running. A change of anything in this file is a new KT_GUEST_ABI: guests of another one are
/// refused.
#ifndef KILOTWIN_ROBOTS_NATIVE_ABI_H
#define KILOTWIN_ROBOTS_NATIVE_ABI_H

#include <stdint.h>

#include "../../../kilogrid_modules/runtime/core/record_store.h"
#include "../../../kilogrid_modules/runtime/include/module_limits.h"
#include "message.h"

#ifdef __cplusplus
extern "C" {
#endif

#define KT_GUEST_ABI 15
#define KT_PACKED __attribute__((packed))

/// The registers that drive motors and LED (hardware.md 1.8), which a program may write itself. The
/// engine reads them after every callback, loop() and blocking call.
typedef struct KT_PACKED {
    uint8_t ocr2a, ocr2b;  ///< duty of the left and the right motor
    uint8_t ddrb, ddrc, ddrd;
    uint8_t portb, portc, portd;
} kt_outputs_t;

extern volatile kt_outputs_t kt_outputs;

/// How text leaves the robot (kt_host_t.print()).
enum {
    KT_NO_LINE,      ///< at once: debug_init() was never called, where the chip prints nothing
    KT_LINE_WAITS,   ///< the program goes on when the serial line has taken all of it
    KT_LINE_QUEUES,  ///< it goes on at once, and what the queue has no room for is lost
};

/// Kinds of undefined behaviour (kt_host_t.undefined()).
enum {
    KT_UB_ADD,
    KT_UB_SUBTRACT,
    KT_UB_MULTIPLY,
    KT_UB_NEGATE,
    KT_UB_DIVIDE,
    KT_UB_SHIFT,
    KT_UB_INDEX,
    KT_UB_ACCESS,
    KT_UB_LENGTH,
    KT_UB_CONVERSION,
    KT_UB_VALUE,
    KT_UB_POINTER,
    KT_UB_NULL_ARGUMENT,
    KT_UB_BUILTIN,
};

/// CAN frame in a module program's memory (hardware.md 3.3).
typedef struct KT_PACKED {
    uint16_t id;
    uint8_t header;  ///< bit 0 remote frame, bits 1-4 data bytes
    uint8_t data[8];
} kt_can_message_t;

/// Calls from a module's guest into the engine, besides those of kt_host_t. `cell`: 0..KT_CELLS -
/// 1.
typedef struct KT_PACKED {
    void (*autostart)(void);  ///< module_enable_autostart()
    void (*light)(uint8_t cell, uint8_t red, uint8_t green, uint8_t blue);  ///< pulse widths
    /// Sets the message that a cell repeats, and the program's checksum function; null: none.
    void (*cell_message)(uint8_t cell, const message_t *message,
                         uint16_t (*checksum)(const message_t *));
    void (*send_at_once)(uint8_t cell, const message_t *message);
    void (*send_can)(const kt_can_message_t *message, uint8_t x, uint8_t y, uint8_t address_type);
    void (*broadcast_can)(const kt_can_message_t *message);  ///< sent when loop() has returned
    void (*can_address)(uint16_t id, uint8_t address[3]);    ///< id to x, y, type
} kt_module_host_t;

/// Calls from a guest into the engine. They act on the robot or module that is running.
typedef struct KT_PACKED {
    void (*init)(void);  ///< kilo_init, module_init: registers and EEPROM values
    void (*start)(void (*setup)(void),
                  void (*loop)(void));  ///< kilo_start, module_start: does not return
    void (*wait)(uint32_t cycles);      ///< lets time pass; interrupts are served meanwhile
    void (*outputs)(void);              ///< to be called when kt_outputs may have changed
    uint8_t (*rand_hard)(void);
    uint8_t (*distance_mm)(int16_t low_gain,
                           int16_t high_gain);  ///< by the robot's calibration tables
    uint8_t (*eeprom_read)(uint16_t address);
    void (*eeprom_write)(uint16_t address, uint8_t value);
    void (*interrupts)(uint8_t on);  ///< while off, ticks and callbacks wait
    uint8_t (*timer0)(void);         ///< counts of 128 us since the last tick
    /// Reads a channel of the converter (kilolib/core/sensors.h): 0..1023, or -1.
    int16_t (*sensor)(uint8_t channel);
    void (*print)(const char *text, uint32_t bytes, uint8_t line);  ///< `line`: KT_LINE_...
    void (*serial_written)(void);                                   ///< a byte was written to UDR0
    void (*serial_ready)(void);           ///< waits until UDR0 takes a byte
    void (*spent)(const uint8_t *frame);  ///< the budget of iterations is spent; the program's
                                          ///< registers and frames lie from `frame` up
    void (*unusable)(const char *what);   ///< stops the robot: a call that it cannot serve
    /// A program that was built to look (side/undefined.c) does what KT_UB_... says, with these
    /// values. `data` is what the compiler describes the place by; the engine knows its layout.
    void (*undefined)(uint8_t what, const void *data, uint64_t first, uint64_t second);
    const kt_module_host_t *module;  ///< null: a robot runs
} kt_host_t;

/// Tracking records that wait for the next poll, a ring: next_CAN_message() hands out its slots.
typedef struct KT_PACKED {
    record_store_t store;
    kt_can_message_t slots[CAN_MESSAGE_BUFFER_SIZE];
} kt_records_t;

/// Addresses in a module's guest that the engine reads and writes, besides those of kt_table_t.
typedef struct KT_PACKED {
    volatile uint16_t *uid;
    volatile uint8_t *x, *y;
    volatile uint8_t *configuration_size;
    volatile uint8_t *configuration;  ///< MODULE_CONFIGURATION_BUFFER_SIZE
    void (**ir_rx)(message_t *message, uint8_t cell, distance_measurement_t *distance,
                   uint8_t crc_error);
    void (**ir_tx_success)(uint8_t cell);
    void (**can_rx)(kt_can_message_t *message);
    void (**can_tx_success)(void);
    kt_can_message_t *can_message;  ///< receive buffer of can_rx
    kt_records_t *records;
    const uint8_t
        *acts_alone;  ///< null if the program sends by its cells' messages and records only,
                      ///< so that the engine knows when it may send next
} kt_module_t;

/// Addresses in a guest that the engine reads, writes and calls. Variables are part of the state
/// unless stated otherwise.
typedef struct KT_PACKED {
    uint32_t abi;  ///< KT_GUEST_ABI of the guest's build
    uint8_t *guard_low, *state_begin, *state_end,
        *guard_high;  ///< the state section, and the guard pages around it
    int (*program_main)();
    volatile uint32_t *ticks;
    volatile uint16_t *tx_period;  ///< null if the program does not name it
    uint16_t *uid;
    uint8_t *turn_left;
    void (*save_calibration)(const uint8_t *data);  ///< of a CALIB message
    message_rx_t *message_rx;
    message_tx_t *message_tx;  ///< null if the program does not name it: it never sends
    message_tx_success_t *message_tx_success;
    message_t *rx_message;  ///< kilolib's one receive buffer; of a module N_CELLS, one per cell
    distance_measurement_t *rx_distance;
    volatile kt_outputs_t *outputs;
    void (*settle)(void);        ///< carries out writes to registers that act when written;
                                 ///< null if the program uses none
    const char *handlers_begin,  ///< names of the program's own interrupt handlers, each ended by
        *handlers_end;           ///< a zero; null if there are none
    int (*random)(void);         ///< the program's rand()
    int32_t *budget;             ///< iterations left (busy_watch.h); not part of the state
    const kt_host_t **host;      ///< not part of the state
    const kt_module_t *module;   ///< null: a robot's program
    uint8_t original;            ///< whether its runtime has the traits of its core/traits.h
    const uint8_t *settled_period;  ///< null if tx_period may change after set-up
    /// Reads a sensor; null if a robot's program reads none, by a function or a register: then it
    /// need not be told of light on its receiver.
    int16_t (*sensor)(uint8_t channel);
} kt_table_t;

/// The registers of kt_host_t.spent: so many bytes from `frame` up, then the address that the
/// program goes on at.
#define KT_SPENT_REGISTER_BYTES (256 + 15 * 8)

/// Size of a guard: more than the 64 K elements of 4 bytes that an index of 16 bits can be off, so
/// that it never reaches memory of the engine.
#define KT_GUARD_BYTES 0x41000

/// The one symbol a guest exports.
extern __attribute__((visibility("default"))) const kt_table_t kt_table;

#ifdef __cplusplus
}
#endif

#endif
