/// A file descriptor that closes itself, and the error for a system call that failed.
#ifndef KILOTWIN_GRID_DESCRIPTOR_H
#define KILOTWIN_GRID_DESCRIPTOR_H

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

#include "grid/bridge.h"

namespace kilotwin {

/// Owns one descriptor, or none (-1). Moved, never copied; usable from any thread, but not from two
/// at a time.
class Descriptor {
  public:
    /// Takes `fd` over.
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    /// Leaves `other` without one.
    Descriptor(Descriptor &&other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
    /// Swaps: the other one closes what this one had.
    Descriptor &operator=(Descriptor &&other) noexcept {
        std::swap(fd_, other.fd_);
        return *this;
    }
    /// Closes; an error of close() is ignored, as nothing could be done about it.
    ~Descriptor() {
        if (fd_ >= 0) ::close(fd_);
    }
    /// -1 if it owns none.
    int get() const { return fd_; }

  private:
    int fd_;  ///< -1: none
};

/// Throws BridgeError: `what`, and errno in words. To be called right after the system call that
/// failed.
[[noreturn]] inline void fail(const std::string &what) {
    throw BridgeError(what + ": " + std::strerror(errno));
}

}  // namespace kilotwin

#endif
