/// Names of the robot's core (firmware/kilolib/core) within a guest. They begin with kt_ there, so
/// that a program may use all others for itself. Included before every file of the thin half.
#ifndef KILOTWIN_GUEST_CORE_NAMES_H
#define KILOTWIN_GUEST_CORE_NAMES_H

#define kilolib_calibration_load kt_calibration_load
#define kilolib_calibration_save kt_calibration_save
#define kilolib_eeprom_read kt_calibration_read
#define kilolib_eeprom_update kt_calibration_update
#define kilolib_random_seed kt_random_seed

#endif
