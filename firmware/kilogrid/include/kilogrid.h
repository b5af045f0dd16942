/// Messages of robots, modules and the host about the grid.
#ifndef __KILOGRID_H__
#define __KILOGRID_H__  // NOLINT(bugprone-reserved-identifier): programs know it

#include <stdint.h>

/// Addressees of a CAN message; one byte.
typedef enum __attribute__((__packed__)) {
    ADDR_BROADCAST = 0,      ///< every module
    ADDR_ROW = 1,            ///< the modules of row y
    ADDR_COLUMN = 2,         ///< the modules of column x
    ADDR_INDIVIDUAL = 3,     ///< module (x, y)
    ADDR_DISPATCHER = 0xFF,  ///< the host, from module (x, y)
} kilogrid_addressing_type_t;

typedef struct __attribute__((__packed__)) {
    uint8_t x;  ///< column, from 0
    uint8_t y;  ///< row, from 0
    kilogrid_addressing_type_t type;
} kilogrid_address_t;

/// Bytes of a tracking record that are the robot program's own.
#define TRACKING_MSG_USER_DATA 7

typedef struct __attribute__((__packed__)) {
    uint8_t byte[TRACKING_MSG_USER_DATA];
} tracking_user_data_t;

#endif
