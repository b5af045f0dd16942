/// Random numbers of the engine: one counter-based generator (Philox 4x32-10), keyed by seed, robot
/// and purpose.
///
/// The n-th draw of a purpose depends on nothing else: neither another robot nor another source of
/// noise shifts a draw, and draws may be made in any order. No state, so that any number of users
/// may share one object.
#ifndef KILOTWIN_BASE_CHANCE_H
#define KILOTWIN_BASE_CHANCE_H

#include <Random123/philox.h>

#include <cstdint>

namespace kilotwin {

/// Purpose of a draw. Numbers are part of "same seed, same result": never change or reuse one.
/// 1 to 31 robots, 32 to 39 chips on boards, 40 to 63 modules and cells, 64 CAN, 72 twins,
/// 80 to 95 the host: cameras and virtual environments, 96 to 99 objects (by object, not robot).
enum class Purpose : uint32_t {
    PLACE = 1,           ///< where a robot without a pose starts: x, y, and again while it overlaps
    HEADING = 2,         ///< which way it looks there
    POWER_UP = 3,        ///< its time zero
    RAND_HARD = 4,       ///< bytes of rand_hard()
    CLOCK = 5,           ///< its oscillator error
    RANGE = 6,           ///< how far it is received
    SENSITIVITY = 7,     ///< its receiver, compared with others
    FRAME_LOSS = 8,      ///< whether a frame is lost at it
    LOW_GAIN = 9,        ///< noise of the low-gain reading
    HIGH_GAIN = 10,      ///< noise of the high-gain reading
    SPEED = 11,          ///< its speed, compared with others
    LEFT_BIAS = 12,      ///< its left motor, for the whole run
    RIGHT_BIAS = 13,     ///< likewise
    LEFT_NOISE = 14,     ///< its left motor, from second to second
    RIGHT_NOISE = 15,    ///< likewise
    LIGHT = 16,          ///< not drawn now
    OVERHEAD_LOSS = 17,  ///< whether an overhead controller's frame is lost at it
    DISTANCE_ERROR = 18,          ///< what it takes every distance to be more than it is
    CONVERTER_NOISE = 32,         ///< lowest bit of a conversion
    LOST_PULSE = 33,              ///< which pulse of a lost frame is not seen
    MODULE_RAND_HARD = 40,        ///< bytes of rand_hard()
    MODULE_CONVERTER_NOISE = 41,  ///< lowest bit of a conversion
    MODULE_POWER_UP = 48,         ///< a module's time zero
    MODULE_CLOCK = 49,            ///< its oscillator error
    WEAK_LIGHT = 50,              ///< spells in which a robot is hardly received
    CELL_LOSS = 51,               ///< whether a frame is lost at a cell
    CAN_ERROR = 64,               ///< whether an error destroys a frame
    DIFFERENTIAL_INPUT = 72,      ///< inputs of a differential test
    CAMERA_MISS = 80,             ///< whether a camera does not see a robot in a picture
    CAMERA_X = 81,                ///< error of the place that it sees
    CAMERA_Y = 82,                ///< likewise
    CAMERA_HEADING = 83,          ///< error of the heading
    ENVIRONMENT = 84,             ///< a virtual environment's own
    OBJECT_PLACE = 96,            ///< where an object without a pose begins, and how it is turned
    BEACON = 97,                  ///< when an object's beacon sends first
};

/// See above. 8 bytes; all calls are const and may come from any thread.
class Chance {
  public:
    /// Any seed, 0 included.
    explicit Chance(uint64_t seed) : seed_(seed) {}

    /// The n-th draw of `robot` for `purpose`, n from 0: 64 uniform bits. Costs ten rounds of two
    /// multiplications, as each draw below.
    [[gnu::flatten]] uint64_t bits(uint32_t robot, Purpose purpose, uint64_t n) const {
        const auto out = block(robot, purpose, n);
        return static_cast<uint64_t>(out[1]) << 32 | out[0];
    }

    /// Uniform in [0, 1), a multiple of 2^-53.
    double uniform(uint32_t robot, Purpose purpose, uint64_t n) const {
        return static_cast<double>(bits(robot, purpose, n) >> 11) * 0x1p-53;
    }

    /// Mean 0, variance 1, nearly normal: the sum of eight uniform numbers, hence within +-4.9.
    [[gnu::flatten]] double normal(uint32_t robot, Purpose purpose, uint64_t n) const {
        uint32_t sum = 0;
        for (const uint32_t word : block(robot, purpose, n)) sum += (word & 0xFFFF) + (word >> 16);
        return (static_cast<double>(sum) - MEAN_OF_EIGHT) * SCALE;
    }

    /// As given. With it others draw the same numbers (base/normal_pairs.h).
    uint64_t seed() const { return seed_; }

    // How normal() standardises its sum of eight uniform numbers of 16 bits: it subtracts their
    // mean, then scales to a standard deviation of 1.
    static constexpr double MEAN_OF_EIGHT = 4 * 0xFFFF;
    static constexpr double SCALE = 1.224744871391589 * 0x1p-16;  // sqrt(12 / 8)

  private:
    // Inlined always: out of line its result would go through memory. Its callers are flat, since
    // gcc would call a function in each round. Ten rounds of Philox, after Salmon et al., "Parallel
    // random numbers: as easy as 1, 2, 3" (2011), by Random123.
    [[gnu::always_inline]] r123::Philox4x32::ctr_type block(uint32_t robot, Purpose purpose,
                                                            uint64_t n) const {
        const r123::Philox4x32::ctr_type counter = {{static_cast<uint32_t>(n),
                                                     static_cast<uint32_t>(n >> 32), robot,
                                                     static_cast<uint32_t>(purpose)}};
        const r123::Philox4x32::key_type key = {
            {static_cast<uint32_t>(seed_), static_cast<uint32_t>(seed_ >> 32)}};
        return r123::Philox4x32()(counter, key);
    }

    uint64_t seed_;  ///< the generator's key; robot, purpose and n are its counter
};

}  // namespace kilotwin

#endif
