/// The engine's one exception.
#ifndef KILOTWIN_BASE_ERRORS_H
#define KILOTWIN_BASE_ERRORS_H

#include <stdexcept>

namespace kilotwin {

/// Thrown for anything wrong with what the user gave: a program, a file, a setting. The text is for
/// people and names the thing and what would be right. Never thrown for a bug of our own.
class EngineError : public std::invalid_argument {
  public:
    using std::invalid_argument::invalid_argument;
};

}  // namespace kilotwin

#endif
