/// Colour and messages of a cell, from the module's configuration. Pure: no input or output, no
/// state.
///
/// The configuration, at most 48 bytes, begins with one code per cell: 0 top left, 1 top right, 2
/// bottom left, 3 bottom right. A code from 0x80 up has all in itself:
///
///     bits 0-3  site number 1..14; 0: no site; 15: next to a wall, and no site
///     bits 4-6  colour: 1 red, 2 green, 4 blue
///
/// at brightness 240. The others mean what they mean in the labs, or what is in a table that may
/// follow from byte 4 on, three bytes each for code 1, 2, ... up to 14:
///
///     1 wall   red       2 free   blue      3 site 1 white     4 site 2 off (black)
///     5 site 3 green     6 site 4 yellow    7 site 5 cyan      8 site 6 magenta
///
///     table: site        0 none, 1..255
///            look        bits 0-2 colour, bit 3: next to a wall
///            brightness  of the LEDs, 0..255
///
/// A cell of code 0, or of a code without a meaning, is dark and sends nothing.
#ifndef SITES_CELL_H
#define SITES_CELL_H

#include <stdbool.h>
#include <stdint.h>

#define CELL_COUNT 4
#define CELL_TABLE_ENTRY_BYTES 3
#define CELL_CODE_MAX 14

/// Codes with all in themselves.
#define CELL_CODE_FULL 0x80
#define CELL_CODE_SITE 0x0F
#define CELL_CODE_WALL 0x0F
#define CELL_CODE_COLOUR_SHIFT 4

/// Bits of a table entry's second byte, and the colour's of a full code.
#define CELL_COLOUR 0x07
#define CELL_LOOK_WALL 0x08

typedef struct {
    bool speaks;         ///< sends CELL messages; if not, the rest is 0
    uint8_t site;        ///< 0 none
    uint8_t flags;       ///< WIRE_CELL_ of wire.h
    uint8_t colour;      ///< bit 0 red, 1 green, 2 blue
    uint8_t brightness;  ///< 0..255
} cell_t;

/// The cell number `cell`, 0..3, by the `size` bytes of `configuration`. A table that breaks off in
/// the middle of an entry ends before it.
cell_t cell_of(const volatile uint8_t *configuration, uint8_t size, uint8_t cell);

#endif
