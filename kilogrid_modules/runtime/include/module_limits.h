/// Sizes of the Kilogrid module API that its runtimes share. Programs include module.h.
#ifndef KILOGRID_MODULE_LIMITS_H
#define KILOGRID_MODULE_LIMITS_H

/// Cells of a module.
#define N_CELLS 4

/// Bytes of the largest configuration.
#define MODULE_CONFIGURATION_BUFFER_SIZE 48

/// Tracking records kept between two polls.
#define CAN_MESSAGE_BUFFER_SIZE 10

#endif
