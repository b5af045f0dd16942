/// Dimensions and wires of a Kilogrid, the same for every module of it (hardware.md 3.1,
/// 3.2).
///
/// The only home of these numbers. The emulator includes this file; the host reads its numbers from
/// it (host_tools/kilotwin/files/headers.py).
#ifndef KILOGRID_DIMENSIONS_H
#define KILOGRID_DIMENSIONS_H

#define KILOGRID_CELL_MM 50       ///< width and height of a cell
#define KILOGRID_MODULE_CELLS 4   ///< 2 x 2
#define KILOGRID_MOST_COLUMNS 31  ///< an address has five bits, of which one value means all
#define KILOGRID_MOST_ROWS 31
#define KILOGRID_MOST_MODULES_PER_BUS 112  ///< limit of the dispatcher
#define KILOGRID_CAN_BIT_RATE 250000       ///< 1/s

#endif
