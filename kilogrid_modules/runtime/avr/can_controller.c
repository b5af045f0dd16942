#include "can_controller.h"

#include "spi.h"

// Instructions, registers and bits: datasheet of the MCP2515, chapters 11 and 12.
enum {
    RESET = 0xC0,
    READ = 0x03,
    WRITE = 0x02,
    BIT_MODIFY = 0x05,
    READ_STATUS = 0xA0,
    READ_BUFFER_0 = 0x90,
    READ_BUFFER_1 = 0x94,
    LOAD_TRANSMIT_BUFFER_0 = 0x40,
    REQUEST_TO_SEND_0 = 0x81,
};
// Addresses of registers; a filter's or mask's four follow one another.
enum {
    RXF0SIDH = 0x00,
    RXF3SIDH = 0x10,
    RXM0SIDH = 0x20,
    CANSTAT = 0x0E,
    CANCTRL = 0x0F,
    TEC = 0x1C,
    REC = 0x1D,
    CNF3 = 0x28,
    CNF2 = 0x29,
    CNF1 = 0x2A,
    CANINTE = 0x2B,
    EFLG = 0x2D,
    RXB0CTRL = 0x60,
};
enum {
    MODE_MASK = 0xE0,
    MODE_NORMAL = 0x00,
    MODE_CONFIGURATION = 0x80,
    STATUS_RECEIVED_0 = 1 << 0,
    STATUS_RECEIVED_1 = 1 << 1,
    STATUS_SENDING_0 = 1 << 2,
    INTERRUPT_ON_RECEPTION = 0x03,
    ROLL_OVER = 1 << 2,  // what does not fit into buffer 0 goes into buffer 1
    OVERFLOWS = 0xC0,
    REMOTE_REQUEST = 1 << 4,
};

// A quantum is 500 ns: 1 to begin with, 1 for the way along the bus, 3 in the first phase, 3 in the
// second. The sample is taken at 62.5 % of the bit.
enum { CNF1_VALUE = 0x01, CNF2_VALUE = 0x90, CNF3_VALUE = 0x02 };

#define FILTER_REGISTERS 4
#define FILTERS_OF_CONTROLLER 6
#define FILTERS_IN_A_ROW 3
#define START_UP_TRIES 200

// Each instruction is one selection of the chip.
static uint8_t read_register(uint8_t address) {
    runtime_spi_select();
    runtime_spi_exchange(READ);
    runtime_spi_exchange(address);
    const uint8_t value = runtime_spi_exchange(0);
    runtime_spi_release();
    return value;
}

static void write_register(uint8_t address, uint8_t value) {
    runtime_spi_select();
    runtime_spi_exchange(WRITE);
    runtime_spi_exchange(address);
    runtime_spi_exchange(value);
    runtime_spi_release();
}

// BIT MODIFY changes flags without a race: the controller may set others meanwhile.
static void clear_bits(uint8_t address, uint8_t bits) {
    runtime_spi_select();
    runtime_spi_exchange(BIT_MODIFY);
    runtime_spi_exchange(address);
    runtime_spi_exchange(bits);
    runtime_spi_exchange(0);
    runtime_spi_release();
}

static uint8_t read_status(void) {
    runtime_spi_select();
    runtime_spi_exchange(READ_STATUS);
    const uint8_t status = runtime_spi_exchange(0);
    runtime_spi_release();
    return status;
}

static void issue(uint8_t instruction) {
    runtime_spi_select();
    runtime_spi_exchange(instruction);
    runtime_spi_release();
}

// 11 bits, the upper 8 in the first register; extended identifiers are not used.
static void write_id(uint8_t address, uint16_t id) {
    write_register(address, (uint8_t)(id >> 3));
    write_register((uint8_t)(address + 1), (uint8_t)(id << 5));
    write_register((uint8_t)(address + 2), 0);
    write_register((uint8_t)(address + 3), 0);
}

// A mode is entered once the bus is idle; without a controller it never is.
static bool reaches(uint8_t mode) {
    for (uint8_t tries = 0; tries < START_UP_TRIES; tries++) {
        if ((read_register(CANSTAT) & MODE_MASK) == mode) return true;
    }
    return false;
}

// Buffer 0 looks at filters 0 and 1, buffer 1 at the others; those left over repeat the last.
static void write_filters(const uint16_t ids[CAN_FILTERS], uint16_t mask) {
    write_id(RXM0SIDH, mask);
    write_id(RXM0SIDH + FILTER_REGISTERS, mask);
    uint8_t address = RXF0SIDH;
    for (uint8_t i = 0; i < FILTERS_OF_CONTROLLER; i++) {
        if (i == FILTERS_IN_A_ROW) address = RXF3SIDH;
        write_id(address, ids[i < CAN_FILTERS ? i : CAN_FILTERS - 1]);
        address = (uint8_t)(address + FILTER_REGISTERS);
    }
}

bool runtime_can_controller_init(const uint16_t ids[CAN_FILTERS], uint16_t mask) {
    runtime_spi_init();
    issue(RESET);
    if (!reaches(MODE_CONFIGURATION)) return false;
    write_register(CNF3, CNF3_VALUE);
    write_register(CNF2, CNF2_VALUE);
    write_register(CNF1, CNF1_VALUE);
    write_register(CANINTE, INTERRUPT_ON_RECEPTION);
    write_filters(ids, mask);
    write_register(RXB0CTRL, ROLL_OVER);
    write_register(CANCTRL, MODE_NORMAL);
    return reaches(MODE_NORMAL);
}

// Buffer 0 first: it holds the older frame, unless it rolled over.
bool runtime_can_controller_receive(can_frame_t *frame) {
    const uint8_t status = read_status();
    if (!(status & (STATUS_RECEIVED_0 | STATUS_RECEIVED_1))) return false;
    runtime_spi_select();
    // Reading a whole buffer frees it.
    runtime_spi_exchange(status & STATUS_RECEIVED_0 ? READ_BUFFER_0 : READ_BUFFER_1);
    const uint8_t high = runtime_spi_exchange(0), low = runtime_spi_exchange(0);
    runtime_spi_exchange(0);
    runtime_spi_exchange(0);
    const uint8_t length = runtime_spi_exchange(0) & 0x0F;
    frame->id = (uint16_t)(high << 3 | low >> 5);
    frame->rtr = (low & REMOTE_REQUEST) != 0;
    frame->length = length < CAN_DATA_MAX ? length : CAN_DATA_MAX;
    for (uint8_t i = 0; i < frame->length; i++) frame->data[i] = runtime_spi_exchange(0);
    runtime_spi_release();
    return true;
}

// One of the three transmit buffers only: with several, the controller would change their order.
bool runtime_can_controller_send(const can_frame_t *frame) {
    if (read_status() & STATUS_SENDING_0) return false;
    runtime_spi_select();
    runtime_spi_exchange(LOAD_TRANSMIT_BUFFER_0);
    runtime_spi_exchange((uint8_t)(frame->id >> 3));
    runtime_spi_exchange((uint8_t)(frame->id << 5));
    runtime_spi_exchange(0);
    runtime_spi_exchange(0);
    runtime_spi_exchange(frame->length);
    for (uint8_t i = 0; i < frame->length; i++) runtime_spi_exchange(frame->data[i]);
    runtime_spi_release();
    issue(REQUEST_TO_SEND_0);
    return true;
}

// Overflow flags tell that frames were missed, not how many: one is counted.
can_health_t runtime_can_controller_health(void) {
    const uint8_t overflows = read_register(EFLG) & OVERFLOWS;
    if (overflows) clear_bits(EFLG, OVERFLOWS);
    return (can_health_t){read_register(TEC), read_register(REC), overflows ? 1 : 0};
}
