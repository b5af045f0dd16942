/// Calibration of a robot: the CALIB message, and the API's variables that the EEPROM holds
/// (hardware.md 1.4, 1.9).
#ifndef KILOLIB_CORE_CALIBRATION_H
#define KILOLIB_CORE_CALIBRATION_H

#include <stdint.h>

#include "robot_query.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Bytes of a CALIB message's data.
enum {
    CALIB_MODE,  ///< a calibration_mode_t
    CALIB_UID_LOW,
    CALIB_UID_HIGH,
    CALIB_TURN_LEFT,  ///< duties from here on, 0..255
    CALIB_TURN_RIGHT,
    CALIB_STRAIGHT_LEFT,
    CALIB_STRAIGHT_RIGHT,
    CALIB_MARK,  ///< two bytes: CALIB_MARK_LOW and CALIB_MARK_HIGH, or anything else
};

/// An addition to the original: with this mark, CALIB is for the robot alone whose kilo_uid is the
/// message's uid, trials and SAVE alike, so that many robots are calibrated at once. The original's
/// senders leave the bytes 0 and address all robots; there the uid of SAVE is the new one.
enum { CALIB_MARK_LOW = 'K', CALIB_MARK_HIGH = 'T' };

/// CALIB_MODE; other values change nothing.
typedef enum {
    CALIBRATION_SAVE,        ///< write uid and duties into the EEPROM; only after a trial
    CALIBRATION_UID,         ///< stand still
    CALIBRATION_TURN_LEFT,   ///< try the duty
    CALIBRATION_TURN_RIGHT,  ///< try the duty
    CALIBRATION_STRAIGHT,    ///< try both duties
    /// Ours: from here on, one for each of GAIN_ENTRIES (gains.h): write this entry of both gain
    /// tables into the EEPROM. Needs the mark. The four bytes of duties are the low gain's word and
    /// the high gain's, upper bytes first. Not while a program runs; no trial is needed.
    CALIBRATION_GAINS = ROBOT_QUERY_GAINS,
} calibration_mode_t;

/// Sets kilo_uid and the four duties to what the EEPROM holds; an erased one gives 65535 and 255.
/// First it finishes a save that a power cut broke off.
void kilolib_calibration_load(void);

/// Writes uid and duties, or an entry of the gain tables, from the data of a CALIB message into the
/// EEPROM, and loads uid and duties; a program's tables are read at its start. A power
/// cut at any moment leaves all old or all new values: a record of them with CRC and a number comes
/// first, in turn in one of two places (eeprom_map.h), then a mark that it is pending, the
/// original's places, and the mark that it is done. A record that is done changes nothing: what
/// other programs write into the original's places holds. On the chip it takes up to 65 ms: 3.4 ms
/// for each byte that differs, 18 of them and the mark.
void kilolib_calibration_save(const uint8_t *data);

/// The four bytes of an entry of the gain tables as they are in the EEPROM, in the order in which
/// CALIB carries them. `mode` is CALIBRATION_GAINS and more.
void kilolib_calibration_gains(uint8_t mode, uint8_t *bytes);

/// The driver's EEPROM; addresses by eeprom_map.h.
uint8_t kilolib_eeprom_read(uint16_t address);

/// Writes a byte if it differs: a cell wears out after 100,000 times.
void kilolib_eeprom_update(uint16_t address, uint8_t value);

#ifdef __cplusplus
}
#endif

#endif
