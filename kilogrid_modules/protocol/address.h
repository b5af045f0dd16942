/// Addresses of CAN frames: the 11-bit identifier is an address in the grid.
///
/// Identifier, most significant bit first: [y + 1 : 5][x + 1 : 5][to host : 1]. A coordinate field
/// of zero means "all", so 0x000 reaches every module, (y + 1) << 6 a row, (x + 1) << 1 a column. A
/// module answers with its own coordinates and the lowest bit set. The lower identifier wins the
/// bus: a broadcast before everything else (hardware.md 3.2).
///
/// Pure C99 for the module, the emulator (C++) and the tests. What the eight data bytes of a frame
/// mean is in kilogrid.dbc and the code made from it, kilogrid_can.h.
#ifndef KILOGRID_ADDRESS_H
#define KILOGRID_ADDRESS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Coordinates are 0 to 30: the fields have 5 bits and 0 means "all".
#define KILOGRID_COORDINATE_MAX 30
/// No identifier: an address that cannot be written as one.
#define KILOGRID_NO_ID 0xFFFF
/// Identifiers of modules' filters are compared in all 11 bits, those of the host's in the lowest.
#define KILOGRID_MODULE_MASK 0x7FF
#define KILOGRID_HOST_MASK 0x001
#define KILOGRID_HOST_ID 0x001
/// Identifiers that a module listens to.
#define KILOGRID_FILTERS 4

/// The lab's names for the types of an address.
enum {
    ADDR_BROADCAST = 0,      ///< all modules; x and y say nothing
    ADDR_ROW = 1,            ///< all modules of row y
    ADDR_COLUMN = 2,         ///< all modules of column x
    ADDR_INDIVIDUAL = 3,     ///< module (x, y)
    ADDR_DISPATCHER = 0xFF,  ///< from module (x, y) to the host, which once was the dispatcher
};

/// An address; x is the column, y the row, both from 0.
typedef struct {
    uint8_t x;
    uint8_t y;
    uint8_t type;
} kilogrid_address_t;

/// The identifier of `address`, or KILOGRID_NO_ID if its type is none of the above or a coordinate
/// that counts is over KILOGRID_COORDINATE_MAX.
uint16_t kilogrid_id(kilogrid_address_t address);

/// The address of identifier `id`; a coordinate that says nothing is 0. False, and `address` as it
/// was, for what nobody sends: more than 11 bits, or to the host without a module's coordinates.
bool kilogrid_address(uint16_t id, kilogrid_address_t *address);

/// The identifiers that module (x, y) listens to: broadcast, row, column, its own; to be compared
/// under KILOGRID_MODULE_MASK. False, and `ids` as they were, if there can be no such module.
bool kilogrid_filters(uint8_t x, uint8_t y, uint16_t ids[KILOGRID_FILTERS]);

/// How many data bytes a frame to a module, or to the host, is sent with: 8 but for the short ones.
uint8_t kilogrid_dlc_to_module(uint8_t type);
uint8_t kilogrid_dlc_to_host(uint8_t type);

/// How many data bytes a frame must have at least to be acted upon. As the original module, ours
/// reads what it needs and does not mind more; `type` is data[0], for the host its lower 6 bits.
uint8_t kilogrid_least_dlc_to_module(uint8_t type);
uint8_t kilogrid_least_dlc_to_host(uint8_t type);

#ifdef __cplusplus
}
#endif

#endif
