#include "cell.h"

#include "../../firmware/aggregation/wire.h"

#define BRIGHTNESS 240
#define FIRST_SITE_CODE 3

enum { OFF = 0, RED = 1, GREEN = 2, YELLOW = 3, BLUE = 4, MAGENTA = 5, CYAN = 6, WHITE = 7 };
enum { CODE_WALL = 1, CODE_FREE = 2, CODE_LAST = 8 };

static const uint8_t COLOURS[CODE_LAST + 1] = {OFF,   RED,    BLUE, WHITE,  OFF,
                                               GREEN, YELLOW, CYAN, MAGENTA};

// Codes as the labs' .kconf files have them (hardware.md 4.1), and ours from 5 on.
static cell_t customary(uint8_t code) {
    if (code == 0 || code > CODE_LAST) return (cell_t){0};
    cell_t cell = {.speaks = true, .colour = COLOURS[code], .brightness = BRIGHTNESS};
    if (code == CODE_WALL) cell.flags = WIRE_CELL_WALL;
    if (code >= FIRST_SITE_CODE) cell.site = (uint8_t)(code - FIRST_SITE_CODE + 1);
    return cell;
}

// Site, wall and colour in the bits of the code itself: for up to 14 sites without a table.
static cell_t in_full(uint8_t code) {
    const uint8_t site = code & CELL_CODE_SITE;
    const bool wall = site == CELL_CODE_WALL;
    return (cell_t){
        .speaks = true,
        .site = wall ? 0 : site,
        .flags = wall ? WIRE_CELL_WALL : 0,
        .colour = (uint8_t)(code >> CELL_CODE_COLOUR_SHIFT & CELL_COLOUR),
        .brightness = BRIGHTNESS,
    };
}

// The code is the number of an entry: site, look, brightness.
static cell_t by_table(const volatile uint8_t *entry) {
    const uint8_t look = entry[1];
    return (cell_t){
        .speaks = true,
        .site = entry[0],
        .flags = look & CELL_LOOK_WALL ? WIRE_CELL_WALL : 0,
        .colour = look & CELL_COLOUR,
        .brightness = entry[2],
    };
}

cell_t cell_of(const volatile uint8_t *configuration, uint8_t size, uint8_t cell) {
    if (cell >= CELL_COUNT || cell >= size) return (cell_t){0};
    const uint8_t code = configuration[cell];
    if (code & CELL_CODE_FULL) return in_full(code);
    const uint8_t table_bytes = size > CELL_COUNT ? (uint8_t)(size - CELL_COUNT) : 0;
    if (code == 0 || code > table_bytes / CELL_TABLE_ENTRY_BYTES) return customary(code);
    return by_table(configuration + CELL_COUNT + (code - 1) * CELL_TABLE_ENTRY_BYTES);
}
