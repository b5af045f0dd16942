/// A robot's program whose machine code is translated, loaded as a shared object: what all robots
/// that run it share.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_PROGRAM_H
#define KILOTWIN_ROBOTS_TRANSLATED_PROGRAM_H

#include <deque>
#include <string>
#include <utility>

#include "robots/translated/code.h"
#include "robots/translated/passes/known_pass.h"

namespace kilotwin {

/// One per shared object and process, however many simulations use it. Two threads at a time
/// execute robots of different shares.
class TranslatedProgram {
  public:
    /// Loads the translation at `path`, or finds it loaded already. It stays for the life of the
    /// process. Throws EngineError if it cannot be loaded, or was made for another engine.
    static TranslatedProgram &load(const std::string &path, const std::string &name);

    /// Has the translation that is loaded from `path` executed by the code at `faster` from now on:
    /// the same one by another compiler, so that robots' images and known passes stay. Between two
    /// steps. Throws EngineError if nothing is loaded from there, or it is not the same.
    static void take_over(const std::string &path, const std::string &faster);

    /// Loads all three, and takes `debugged` for the code of robots that a debugger holds, and
    /// `watched` for that of one whose stores it notes: the same translation, made with DEBUGGED
    /// and with TRANSLATED_WATCHED. Errors as of load() and take_over().
    static void hold_by(const std::string &path, const std::string &name,
                        const std::string &debugged, const std::string &watched);

    TranslatedProgram(const TranslatedProgram &) = delete;
    TranslatedProgram &operator=(const TranslatedProgram &) = delete;

    const std::string &name() const { return name_; }
    const std::string &path() const { return path_; }
    const translation_t &code() const { return *code_; }
    /// That of robots that are held (debugging.h); null before hold_by().
    const translation_t *debugged() const { return debugged_; }
    /// That of a robot whose stores are noted (written_bytes.h); null likewise.
    const translation_t *watched() const { return watched_; }
    /// Registers that have an effect, by address (code.h).
    static const uint8_t *effects();

    /// Notes where an interrupt begins, by a mark of code.h, if the code has marks.
    void cover(uint32_t pc, uint8_t mark) {
        if (coverage_ != nullptr) coverage_[pc / 2 % COVER_DEPTHS] |= mark;
    }
    /// Whether it notes which of its code has run, in one place for all robots.
    bool is_covered() const { return coverage_ != nullptr; }

    /// Findings about the program from robots that ran it. They change the cost alone.
    struct Learned {
        /// Cycles of a tick's interrupt that only counts; 0: not yet known.
        uint32_t tick_cycles = 0;
        /// Passes of its main loop.
        KnownPasses known_passes;
    };
    /// Those of a share of the robots (base/team.h), for which there is room.
    Learned &learned(uint32_t share) { return learned_[share]; }
    void make_room(uint32_t shares) {
        if (learned_.size() < shares) learned_.resize(shares);
    }

  private:
    TranslatedProgram(const std::string &path, std::string name);

    /// The program that is loaded from `path`, and another translation of it.
    static std::pair<TranslatedProgram *, const translation_t *> another(const std::string &path,
                                                                         const std::string &other);

    std::string name_, path_;
    const translation_t *code_;
    const translation_t *debugged_ = nullptr;
    const translation_t *watched_ = nullptr;
    uint8_t *coverage_;               ///< its marks; null: it has none
    std::deque<Learned> learned_{1};  ///< by share
};

}  // namespace kilotwin

#endif
