#include <algorithm>

#include "modules/module.h"
#include "modules/timing.h"
#include "robots/inbox.h"

namespace kilotwin {

// With interrupts off the timer's flag is set all the same, once.
Cycles Module::next_interrupt() const {
    if (interrupts_off_) return time_.next_tick;
    Cycles next = time_.next_tick;
    if (!can_inbox_.empty()) next = std::min(next, can_inbox_.front().at);
    if (!cell_inbox_.empty()) next = std::min(next, cell_inbox_.front().at);
    return next;
}

// Priorities of a moment: timer, CAN, infrared.
void Module::serve_interrupt(Cycles at) {
    time_.now = std::max(time_.now, at);
    if (at == time_.next_tick) {
        time_.next_tick += time_.tick_length;
        if (interrupts_off_)
            tick_pending_ = loop_due_ = true;
        else
            tick();
    } else if (!can_inbox_.empty() && at == can_inbox_.front().at) {
        take_can();
    } else {
        take_cell_message();
    }
}

Module::Interrupt::Interrupt(Module &module)
    : module_(module),
      budget_(*module.table().budget),
      nested_(module.in_program_) {
    module.in_interrupt_ = module.in_program_ = true;
    *module.table().budget = TURNS_PER_TICK;
}

Module::Interrupt::~Interrupt() {
    const auto &table = module_.program_->table();
    *table.budget = budget_;
    module_.in_interrupt_ = module_.interrupts_off_ = false;
    module_.in_program_ = nested_;
    if (table.settle != nullptr) table.settle();
}

void Module::tick() {
    const auto &table = program_->table();
    last_tick_ = *table.ticks + 1;
    *table.ticks = last_tick_;
    loop_due_ = true;
    if (turns_tick(&turns_)) take_turn();
}

void Module::take_turn() {
    const uint8_t cell = turns_next_cell(&turns_);
    if (sending_cells_ >> cell & 1) return ask(Asking::TURN, cell, cell_messages_[cell]);
    turns_passed(&turns_);
}

// The main loop asks and returns; a program that waits, or sends by itself, waits for the answer.
void Module::ask(Asking why, uint8_t cell, const message_t &message) {
    outgoing_ = {time_.now, cell, message};
    asking_ = why;
    if (time_.now + FRAME_CYCLES < unheard_until_) {
        unheard_++;
        answer(Answer::SENT);
    }
    if (!in_program_) return;
    while (asking_ != Asking::NOTHING) stack().suspend();
    settle();
}

void Module::answer(Answer answer) {
    answer_ = answer;
    answered_ = asking_;
    asking_ = Asking::NOTHING;
    if (answer == Answer::SENT) keep_busy(time_.now + FRAME_CYCLES);
}

// Acts on the answer, when the module goes on. A failed attempt takes the time of listening.
void Module::settle() {
    const Asking why = answered_;
    answered_ = Asking::NOTHING;
    if (answer_ != Answer::SENT && why == Asking::AT_ONCE) time_.now += SENSE_CYCLES;
    if (why == Asking::AT_ONCE) {
        const bool pauses = !is_original() && burst_pauses(&burst_);
        burst_at_ = time_.now + (pauses ? BURST_GAP_CYCLES : 0);
        return;
    }
    if (answer_ == Answer::RECEIVING) return;
    const auto &table = program_->table();
    if (answer_ == Answer::SENT) {
        turns_passed(&turns_);
        const Interrupt interrupt(*this);
        (*table.module->ir_tx_success)(turns_.cell);
        return;
    }
    time_.now += SENSE_CYCLES;
    time_.next_tick = time_.now + turns_retry(&turns_, (*table.random)()) * COUNT_CYCLES;
}

// Interrupts are off while a frame goes out: the CAN controller keeps two frames, the receiver
// none.
void Module::keep_busy(Cycles until) {
    time_.now = busy_until_ = until;
    buffered_ = 0;
    auto kept = can_inbox_.begin();
    for (const auto &reception : can_inbox_) {
        const bool early = reception.at < busy_until_;
        if (early && buffered_ == CONTROLLER_BUFFERS) {
            miss_frame();
            continue;
        }
        buffered_ = static_cast<uint8_t>(buffered_ + early);
        *kept++ = reception;
    }
    can_inbox_.erase(kept, can_inbox_.end());
    std::erase_if(cell_inbox_,
                  [this](const auto &reception) { return reception.at < busy_until_; });
}

// The buffer of a cell is the program's until its next message; the distance is one for all.
// Answers of robots to the host are not the program's.
void Module::take_cell_message() {
    const CellReception reception = cell_inbox_.front();
    cell_inbox_.erase(cell_inbox_.begin());
    const auto &table = program_->table();
    const uint8_t cell = reception.cell % CELLS_PER_MODULE;
    if (!is_original() && !reception.crc_error &&
        robot_reports_add(&orders_.reports, &reception.message, cell))
        return;
    table.rx_message[cell] = reception.message;
    *table.rx_distance = reception.distance;
    const Interrupt interrupt(*this);
    (*table.module->ir_rx)(&table.rx_message[cell], cell, table.rx_distance, reception.crc_error);
}

// The receiver

void Module::receive_ir(Cycles at, uint8_t cell, const message_t &message,
                        distance_measurement_t distance, bool crc_error) {
    if (life_ == Life::STOPPED || at < busy_until_ || orders_.state == STATE_BOOT_LOADER) return;
    insert_by_time(cell_inbox_, CellReception{at, message, distance, cell, crc_error});
}

void Module::hold_receiver(Cycles begin, Cycles end) {
    listening_cell(begin);
    held_from_ = begin;
    held_until_ = end;
}

// Jumps over the dwells since the last call by division, as stepping through them would go.
uint8_t Module::listening_cell(Cycles at) {
    if (dwell_end_ > at) return dwell_cell_;
    // Dwells that end before a moment. At the end of one that is held the cell stays.
    auto ends_before = [this](Cycles moment) {
        return moment > dwell_end_ ? (moment - 1 - dwell_end_) / DWELL_CYCLES + 1 : 0;
    };
    const Cycles dwells = ends_before(at + 1);
    Cycles held = 0;
    if (held_until_ > dwell_end_)
        held = std::min(ends_before(held_until_), dwells) -
               std::min(ends_before(held_from_ + 1), dwells);
    const auto moves = static_cast<uint8_t>((dwells - held) % CELLS_PER_MODULE);
    dwell_cell_ = turns_listening_after(dwell_cell_, moves);
    dwell_end_ += dwells * DWELL_CYCLES;
    return dwell_cell_;
}

}  // namespace kilotwin
