#include "avr/chip/self_programming.h"

#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>

#include <algorithm>

namespace kilotwin {

using namespace atmega328p;

namespace {

// From the instruction that writes SPMCSR, which takes two cycles, to SPM.
constexpr uint64_t ANNOUNCED_CYCLES = 6;
constexpr uint16_t R0 = 0, R1 = 1, ZL = 30, ZH = 31;

}  // namespace

/// Callbacks for simavr.
struct SelfProgramming::Hooks {
    static void control(avr_t *, avr_io_addr_t, uint8_t value, void *programming) {
        static_cast<SelfProgramming *>(programming)->control_written(value);
    }

    // SPM did not come in time after its announcement.
    static avr_cycle_count_t expire(avr_t *, avr_cycle_count_t, void *programming) {
        auto &expired = *static_cast<SelfProgramming *>(programming);
        expired.control() &= SPMCSR_RWWSB;
        return 0;
    }

    static avr_cycle_count_t end(avr_t *, avr_cycle_count_t, void *programming) {
        static_cast<SelfProgramming *>(programming)->operation_ends();
        return 0;
    }
};

SelfProgramming::SelfProgramming(avr_t *avr, uint32_t boot_section)
    : avr_(avr),
      boot_section_(boot_section) {
    std::copy_n(avr->flash, content_.size(), content_.begin());
    clear_buffer();
    auto &handler = avr->io[AVR_DATA_TO_IO(SPMCSR)];
    handler.r = {};
    handler.w.c = Hooks::control;
    handler.w.param = this;
}

uint8_t &SelfProgramming::control() const { return avr_->data[SPMCSR]; }

void SelfProgramming::control_written(uint8_t value) {
    if (busy_) return;
    control() = static_cast<uint8_t>((value & ~SPMCSR_RWWSB) | (control() & SPMCSR_RWWSB));
    avr_cycle_timer_cancel(avr_, Hooks::expire, this);
    if ((value & SPMCSR_SPMEN) == 0) return;
    announced_until_ = avr_->cycle + ANNOUNCED_CYCLES;
    avr_cycle_timer_register(avr_, ANNOUNCED_CYCLES + 1, Hooks::expire, this);
}

void SelfProgramming::execute() {
    const uint8_t what = control();
    if (busy_ || (what & SPMCSR_SPMEN) == 0 || avr_->cycle > announced_until_) return;
    if (avr_->pc < boot_section_) return;
    avr_cycle_timer_cancel(avr_, Hooks::expire, this);
    const uint32_t address = (avr_->data[ZL] | avr_->data[ZH] << 8) % FLASH_BYTES;
    const uint32_t page = address / PAGE_BYTES * PAGE_BYTES;
    if ((what & (SPMCSR_PGERS | SPMCSR_PGWRT)) != 0) return begin(page, (what & SPMCSR_PGWRT) != 0);
    control() &= SPMCSR_RWWSB;
    if ((what & SPMCSR_RWWSRE) != 0) {
        hide(false);
        control() = 0;
        clear_buffer();
    } else if (what == SPMCSR_SPMEN || what == (SPMCSR_SPMEN | SPMCSR_RWWSB)) {
        const uint32_t word = address % PAGE_BYTES / 2;
        if (filled_[word]) return;
        filled_[word] = true;
        buffer_[2 * word] = avr_->data[R0];
        buffer_[2 * word + 1] = avr_->data[R1];
    }
}

/// The part below the boot section is programmed while the program runs on; for the boot section
/// itself the processor waits.
void SelfProgramming::begin(uint32_t page, bool writes) {
    page_ = page;
    writes_ = writes;
    busy_ = true;
    if (page >= boot_section_) {
        avr_->cycle += OPERATION_CYCLES;
        return operation_ends();
    }
    control() |= SPMCSR_RWWSB;
    hide(true);
    avr_cycle_timer_register(avr_, OPERATION_CYCLES, Hooks::end, this);
}

void SelfProgramming::operation_ends() {
    for (uint32_t i = 0; i < PAGE_BYTES; i++) {
        uint8_t &byte = content_[page_ + i];
        byte = writes_ ? byte & buffer_[i] : ERASED;
        if (page_ >= boot_section_) avr_->flash[page_ + i] = byte;
    }
    if (writes_) clear_buffer();
    busy_ = false;
    control() &= SPMCSR_RWWSB;
    operations_++;
    changes_++;
}

void SelfProgramming::hide(bool hidden) {
    changes_++;
    if (hidden)
        std::fill_n(avr_->flash, boot_section_, ERASED);
    else
        std::copy_n(content_.begin(), boot_section_, avr_->flash);
}

/// simavr has cleared its timers and registers.
void SelfProgramming::was_reset() {
    busy_ = false;
    hide(false);
    clear_buffer();
}

void SelfProgramming::clear_buffer() {
    buffer_.fill(ERASED);
    filled_.fill(false);
}

}  // namespace kilotwin
