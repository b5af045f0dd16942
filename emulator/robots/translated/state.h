/// State of a translated robot besides its record.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_STATE_H
#define KILOTWIN_ROBOTS_TRANSLATED_STATE_H

#include <cstdint>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/memory.h"
#include "kilolib.h"
#include "robots/translated/image.h"

namespace kilotwin {

/// A frame whose edges a robot has not all taken.
struct SeenFrame {
    uint64_t begin;       ///< own cycles
    uint64_t heard_from;  ///< edges before are late ones, taken then: end of a frame of its own
    message_t message;
    uint16_t slot = 0;         ///< edges before it have been taken
    uint16_t start_delay = 0;  ///< so long the byte's start has waited, if that is all it goes by
    bool is_lost = false;      ///< an edge of it is
};

/// A frame of which a robot has not taken all edges, or its begin while the converter was busy.
struct FlawedFrame {
    static constexpr int16_t LOST = -1;

    uint64_t begin;     ///< own cycles
    int16_t high_gain;  ///< what is measured of its begin; LOST: an edge of it is
};

struct TranslatedState {
    /// State of few robots: those that light fell on, that wrote to their EEPROM, or that printed.
    struct Rare {
        Own<std::string> line;            ///< that it prints
        uint64_t eeprom_free = 0;         ///< when it has written the last byte
        uint64_t light_asked = 0;         ///< when it last asked whether a frame has begun
        uint64_t last_edge = 0;           ///< when the one came that was taken last
        std::vector<SeenFrame> lights;    ///< in order of time
        std::vector<FlawedFrame> flawed;  ///< those that may yet be in the inbox
        std::vector<Cycles> beside;  ///< when messages beside the medium come, if others are missed
    };

    TranslatedImage image;
    Own<Rare> rare;  ///< by written()

    Rare &written() {
        if (!rare) rare = Own<Rare>::make();
        return *rare;
    }
};

}  // namespace kilotwin

#endif
