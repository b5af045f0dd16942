#include "i2c.h"

#include "board.h"

#define BIT_RATE 100000UL
#define WAIT_LOOPS 1000  // a few bytes' time: a bus that hangs must not hang the module
#define STATUS_MASK 0xF8
enum { STARTED = 0x08, ADDRESS_ACKNOWLEDGED = 0x18, DATA_ACKNOWLEDGED = 0x28 };

void runtime_i2c_init(void) {
    TWSR = 0;
    TWBR = (uint8_t)((F_CPU / BIT_RATE - 16) / 2);
}

// Each step starts the hardware and waits for its status.
static bool step(uint8_t control, uint8_t expected) {
    TWCR = BIT(TWINT) | BIT(TWEN) | control;
    for (uint16_t i = 0; i < WAIT_LOOPS; i++) {
        if (TWCR & BIT(TWINT)) return (TWSR & STATUS_MASK) == expected;
    }
    return false;
}

static bool send(uint8_t byte, uint8_t expected) {
    TWDR = byte;
    return step(0, expected);
}

// The stop is sent in any case, so that the device lets go of the bus.
bool runtime_i2c_write(uint8_t device, uint8_t first, const uint8_t *bytes, uint8_t count) {
    bool answers = step(BIT(TWSTA), STARTED) &&
                   send((uint8_t)(device << 1), ADDRESS_ACKNOWLEDGED) &&
                   send(first, DATA_ACKNOWLEDGED);
    for (uint8_t i = 0; answers && i < count; i++) answers = send(bytes[i], DATA_ACKNOWLEDGED);
    TWCR = BIT(TWINT) | BIT(TWEN) | BIT(TWSTO);
    for (uint16_t i = 0; i < WAIT_LOOPS && (TWCR & BIT(TWSTO)); i++) {
    }
    return answers;
}
