/// The module's receiving side of everything that takes more than one CAN frame: a configuration,
/// an infrared message to forward, the pages of a program for the robots or for the module itself.
///
/// Chunks must come in order; one that is missing, repeated or out of its turn spoils the transfer,
/// whose later chunks are dropped until it is begun anew (the size, the page's number, part 0).
/// A frame that is too short or out of range is refused, and does not touch what was received
/// before; a refused beginning ends the transfer before it. Either is counted.
///
/// Pure: no I/O, no clock. The caller owns the memory, hands in the data bytes of every frame that
/// the module's filters let through, and does what the returned event says. Not to be called from
/// an interrupt and from the loop at once.
///
/// Three differences from the original firmware, all on purpose: a Kilobot page that lacks its
/// first chunk is dropped, not sent with the bytes of the page before; so is one in the middle of
/// which a first chunk comes, which there begins it again: it may be the next page's, whose number
/// was lost; and the module's own boot loader wants its chunks in order instead of counting bytes,
/// so a chunk that comes twice cannot stand in for one that was lost.
#ifndef KILOGRID_TRANSFER_H
#define KILOGRID_TRANSFER_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define TRANSFER_CHUNK_BYTES 6
#define TRANSFER_CONFIG_BYTES 48  ///< the largest configuration
#define TRANSFER_PAGE_BYTES 128
#define TRANSFER_PAGE_CHUNKS 22  ///< the last one holds 2 bytes of the page
#define TRANSFER_PAGES 220       ///< of a program: what lies below the boot loader
#define TRANSFER_IR_BYTES 9
#define TRANSFER_CHECK_BYTES 6  ///< CRC-16 of a program, 2 bytes, and its id, 4; little-endian

/// Effect of a frame.
typedef enum {
    TRANSFER_NOT_MINE,  ///< no frame of a transfer; the caller handles it
    TRANSFER_GOES_ON,   ///< taken, nothing to do yet
    TRANSFER_REFUSED,   ///< counted, nothing to do
    TRANSFER_CONFIG_BEGUN,
    TRANSFER_CONFIG_DONE,    ///< config.data holds config.size bytes
    TRANSFER_IR_DONE,        ///< ir.data and ir.type hold the message
    TRANSFER_PAGE_BEGUN,     ///< of a program for the robots
    TRANSFER_PAGE_DONE,      ///< kilo.data holds page kilo.page of kilo.pages
    TRANSFER_OWN_PAGE_DONE,  ///< own.data holds page own.page, which was missing until now
    TRANSFER_ANNOUNCED,      ///< a program for robots or module: pages, checked, check
} transfer_event_t;

/// Frames that were dropped, by reason; each stays at 65,535.
typedef struct {
    uint16_t too_short;     ///< fewer data bytes than its type has
    uint16_t out_of_range;  ///< size, page, part or chunk that cannot be
    uint16_t out_of_order;  ///< not the chunk that was due
} transfer_dropped_t;

typedef struct {
    uint8_t size;  ///< bytes announced; 0: none yet
    uint8_t next;  ///< the chunk that is due; TRANSFER_NOTHING_DUE: none
    uint8_t data[TRANSFER_CONFIG_BYTES];
} transfer_config_t;

typedef struct {
    bool has_first;  ///< part 0 has come, part 1 is due
    uint8_t type;
    uint8_t data[TRANSFER_IR_BYTES];
} transfer_ir_t;

typedef struct {
    uint8_t pages;  ///< of the whole program; 0: not announced
    uint8_t page;
    uint8_t next;    ///< as in transfer_config_t
    bool checked;    ///< `check` came with the announcement: senders of ours
    bool check_due;  ///< `check` has come, and is the next announcement's
    uint8_t check[TRANSFER_CHECK_BYTES];
    uint8_t data[TRANSFER_PAGE_BYTES];
} transfer_page_t;

#define TRANSFER_NOTHING_DUE 0xFF

/// All of a module's transfers. 373 bytes there; any member may be read at any time.
typedef struct {
    transfer_config_t config;
    transfer_ir_t ir;
    transfer_page_t kilo;  ///< a program for the robots, one page at a time
    transfer_page_t own;   ///< the module's own program, while in its boot loader
    uint8_t own_pages[(TRANSFER_PAGES + 7) / 8];  ///< bit per page of it: is in
    transfer_dropped_t dropped;
} transfer_t;

/// Nothing received, nothing counted.
void transfer_init(transfer_t *transfer);

/// Takes the data bytes of a frame to this module; `length` 0 to 8, more is treated as 8.
transfer_event_t transfer_receive(transfer_t *transfer, const uint8_t *data, uint8_t length);

/// Gives up a configuration on its way, as any command that changes the module's state does; chunks
/// of it that still come are out of order.
void transfer_abandon_config(transfer_t *transfer);

/// Pages of the module's own program that are still to come; 0 if none was announced.
uint8_t transfer_own_pages_missing(const transfer_t *transfer);

#ifdef __cplusplus
}
#endif

#endif
