/// Fuzz target: a module that is sent anything. Each frame of the input is a length and so many
/// data bytes. Nothing it may hear makes it write beyond its memory, or say that something has
/// arrived which has not.
#include <assert.h>
#include <string.h>

#include "address.h"
#include "kilogrid_can.h"
#include "transfer.h"

// Received bytes, kept in the plainest way: all chunks since the beginning of the transfer.
typedef struct {
    uint8_t size, chunks;
    uint8_t bytes[TRANSFER_PAGE_CHUNKS * TRANSFER_CHUNK_BYTES];
} plain_t;

static void begin(plain_t *plain, uint8_t size) {
    memset(plain, 0, sizeof *plain);
    plain->size = size;
}

static void take_chunk(plain_t *plain, const uint8_t *data) {
    if (data[1] == 0) plain->chunks = 0;
    if (data[1] != plain->chunks || plain->chunks == TRANSFER_PAGE_CHUNKS) return;
    memcpy(plain->bytes + plain->chunks++ * TRANSFER_CHUNK_BYTES, data + 2, TRANSFER_CHUNK_BYTES);
}

static void check_sanity(const transfer_t *transfer) {
    assert(transfer->config.size <= TRANSFER_CONFIG_BYTES);
    assert(transfer->kilo.pages <= TRANSFER_PAGES && transfer->own.pages <= TRANSFER_PAGES);
    assert(transfer->kilo.page < TRANSFER_PAGES && transfer->own.page < TRANSFER_PAGES);
    assert(transfer_own_pages_missing(transfer) <= transfer->own.pages);
}

// The codecs take any bytes, and what they wrote they read again.
static void check_codecs(const uint8_t data[8]) {
    struct kilogrid_can_to_module_t to_module, again;
    struct kilogrid_can_to_host_t to_host, host_again;
    uint8_t packed[8];
    memset(&to_module, 0, sizeof to_module);
    memset(&again, 0, sizeof again);
    assert(kilogrid_can_to_module_unpack(&to_module, data, 8) == 0);
    assert(kilogrid_can_to_module_pack(packed, &to_module, 8) == 8);
    assert(kilogrid_can_to_module_unpack(&again, packed, 8) == 0);
    assert(memcmp(&to_module, &again, sizeof again) == 0);
    memset(&to_host, 0, sizeof to_host);
    memset(&host_again, 0, sizeof host_again);
    assert(kilogrid_can_to_host_unpack(&to_host, data, 8) == 0);
    assert(kilogrid_can_to_host_pack(packed, &to_host, 8) == 8);
    assert(kilogrid_can_to_host_unpack(&host_again, packed, 8) == 0);
    assert(memcmp(&to_host, &host_again, sizeof host_again) == 0);
}

static void check_address(uint16_t id) {
    kilogrid_address_t address;
    if (kilogrid_address(id, &address)) assert(kilogrid_id(address) == id);
}

typedef struct {
    transfer_t transfer;
    plain_t config, kilo, own, ir;
} module_t;

static void keep_plainly(module_t *module, const uint8_t data[8], uint8_t length) {
    if (length < 3) return;
    switch (data[0]) {
    case 0x0F: begin(&module->config, data[2]); break;
    case 0x05: begin(&module->kilo, TRANSFER_PAGE_BYTES); break;
    case 0x09:
    case 0xA8: begin(&module->own, TRANSFER_PAGE_BYTES); break;
    case 0x10:
        if (length == 8) take_chunk(&module->config, data);
        break;
    case 0x03:
        if (length == 8) take_chunk(&module->kilo, data);
        break;
    case 0x07:
    case 0xA6:
        if (length == 8) take_chunk(&module->own, data);
        break;
    default: break;
    }
}

static void check_event(const module_t *module, transfer_event_t event, const uint8_t data[8]) {
    const transfer_t *transfer = &module->transfer;
    switch (event) {
    case TRANSFER_CONFIG_DONE:
        assert(transfer->config.size == module->config.size);
        assert(memcmp(transfer->config.data, module->config.bytes, module->config.size) == 0);
        break;
    case TRANSFER_PAGE_DONE:
        assert(memcmp(transfer->kilo.data, module->kilo.bytes, TRANSFER_PAGE_BYTES) == 0);
        break;
    case TRANSFER_OWN_PAGE_DONE:
        assert(memcmp(transfer->own.data, module->own.bytes, TRANSFER_PAGE_BYTES) == 0);
        break;
    case TRANSFER_IR_DONE:
        assert(memcmp(transfer->ir.data + 6, data + 2, 3) == 0 && transfer->ir.type == data[5]);
        break;
    default: break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *input, size_t size) {
    module_t module;
    memset(&module, 0, sizeof module);
    transfer_init(&module.transfer);
    if (size >= 2) check_address((uint16_t)(input[0] << 8 | input[1]));
    for (size_t at = 0; at < size;) {
        // A block of just these bytes, so that reading one more is noticed.
        const uint8_t length = input[at++] % 9;
        uint8_t exact[8], padded[8] = {0};
        if (size - at < length) break;
        memcpy(exact, input + at, length);
        memcpy(padded, input + at, length);
        keep_plainly(&module, padded, length);
        const transfer_event_t event = transfer_receive(&module.transfer, input + at, length);
        check_event(&module, event, padded);
        check_sanity(&module.transfer);
        check_codecs(padded);
        if (event == TRANSFER_REFUSED)
            assert(module.transfer.dropped.too_short + module.transfer.dropped.out_of_range +
                       module.transfer.dropped.out_of_order >
                   0);
        if (length > 2 && exact[0] == 0x0B) transfer_abandon_config(&module.transfer);
        at += length;
    }
    return 0;
}
