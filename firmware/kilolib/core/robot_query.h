/// Questions to robots by infrared light and their answers (boot_loaders.md 5.1): what the boot
/// loader, programs, the Kilogrid's modules and the host have in common.
///
/// Types that original loaders and kilolib ignore. Pure, constant time.
#ifndef KILOLIB_CORE_ROBOT_QUERY_H
#define KILOLIB_CORE_ROBOT_QUERY_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BOOTPGM_CRC 0x8B     ///< the CRCs of four pages
#define BOOTPGM_QUERY 0x8C   ///< asks which pages are missing, for the image's id, for vitals
#define BOOTPGM_REPORT 0x8D  ///< the answer
#define BOOTPGM_START 0x8E   ///< start the application

#define ROBOT_QUERY_BYTES 5       ///< of a question's data that count, the rest is 0
#define ROBOT_QUERY_ALL 0xFFFF    ///< uid of a question to all robots
#define ROBOT_QUERY_MOST_SLOTS 8  ///< slots are 2 to this power at most; more are taken as so many
#define ROBOT_QUERY_VITALS 0xE1   ///< in place of a page: how the robot is, and what it reads
#define ROBOT_QUERY_GAINS 0xE2    ///< an entry of its gain tables, the first of GAIN_ENTRIES
#define ROBOT_REPORT_IN_PROGRAM 16  ///< states from here on are those of a program

/// Places in the data of a question; QUERY_UID has two bytes, low one first.
enum { QUERY_FIRST, QUERY_SLOTS, QUERY_NONCE, QUERY_UID };

/// Places in the data of an answer: uid, 2 bytes; as asked; 4 bytes; state; lowest byte of the id.
enum { REPORT_UID = 0, REPORT_FIRST = 2, REPORT_BYTES = 3, REPORT_STATE = 7, REPORT_ID_LOW = 8 };
#define REPORT_CONTENT 4  ///< bytes from REPORT_BYTES on

/// The content of an answer to VITALS: a voltage as get_voltage() gives it, 1023 where it is not
/// known; both gains of the last such answer of another robot that it heard, and a count of those,
/// modulo 4. All but the highest two bits of each number have a byte of their own.
enum { VITALS_VOLTAGE, VITALS_LOW_GAIN, VITALS_HIGH_GAIN, VITALS_HIGHEST };
/// Places of those bits, and of the count, in VITALS_HIGHEST.
enum {
    VITALS_LOW_GAIN_BIT = 0,
    VITALS_HIGH_GAIN_BIT = 2,
    VITALS_COUNT_BIT = 4,
    VITALS_VOLTAGE_BIT = 6
};

/// The state in a program's answer: a robot_state_t, and above it what was asked for, so that an
/// answer that comes late is not taken for another one.
static inline uint8_t robot_report_state(uint8_t first, uint8_t state) {
    return (uint8_t)((uint8_t)(first << 4) + state);
}

/// Whether a question, its data, is for the robot: for all, or for one that is missing an answer.
static inline bool robot_query_is_for(const uint8_t *data, uint16_t uid) {
    const uint16_t asked = (uint16_t)(data[QUERY_UID] | data[QUERY_UID + 1] << 8);
    return asked == uid || asked == ROBOT_QUERY_ALL;
}

/// The slot, 0 to 2^power - 1, of a robot's answer. For a pair of robots, at most 2 of 2^power
/// nonces put both into one slot, on average: multiply-shift hashing whose multiplier comes from
/// the nonce. Two robots of one slot part with another nonce, which a CRC of both would not
/// achieve.
static inline uint8_t robot_query_slot(uint16_t uid, uint8_t nonce, uint8_t power) {
    const uint16_t multiplier = (uint16_t)(0x9E37U + nonce * 0x6D2AU);
    uint16_t hash = (uint16_t)(uid * (uint32_t)multiplier);
    if (power > ROBOT_QUERY_MOST_SLOTS) power = ROBOT_QUERY_MOST_SLOTS;
    for (; power < 16; power++) hash >>= 1;
    return (uint8_t)hash;
}

#ifdef __cplusplus
}
#endif

#endif
