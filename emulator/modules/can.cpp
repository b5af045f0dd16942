#include <algorithm>

#include "base/message_crc.h"
#include "modules/module.h"
#include "modules/timing.h"
#include "robots/inbox.h"
#include "runtime/core/answers.h"
#include "runtime/core/eeprom_map.h"
#include "runtime/core/original_orders.h"

namespace kilotwin {

std::array<uint16_t, KILOGRID_FILTERS> Module::filters() const {
    std::array<uint16_t, KILOGRID_FILTERS> ids{};
    kilogrid_filters(x_, y_, ids.data());
    return ids;
}

void Module::receive_can(Cycles at, const CanFrame &frame) {
    if (life_ == Life::STOPPED || at < power_up_) return;
    if (at < busy_until_ && ++buffered_ > CONTROLLER_BUFFERS) {
        buffered_ = CONTROLLER_BUFFERS;
        miss_frame();
        return;
    }
    insert_by_time(can_inbox_, CanReception{at, frame});
}

// The world counts it, and so does the health report until the next reset.
void Module::miss_frame() {
    counts_.frames_missed++;
    orders_count_refused(&orders_, 1);
}

// Orders

// The core decides; here is done what it names, at the interrupt's time.
void Module::take_can() {
    const CanFrame frame = can_inbox_.front().frame;
    can_inbox_.erase(can_inbox_.begin());
    if (orders_.state == STATE_BOOT_LOADER) return take_in_boot_loader(frame);
    const uint8_t before = orders_.state;
    const auto receive = is_original() ? original_receive : orders_receive;
    const order_t order = receive(&orders_, frame.data.data(), frame.dlc, frame.rtr);
    follow_state(before);
    carry_out(order, frame);
}

void Module::carry_out(order_t order, const CanFrame &frame) {
    switch (order) {
    case ORDER_DONE: return;
    case ORDER_REFUSED: counts_.frames_refused++; return;
    case ORDER_HAND_OVER: return hand_over(frame);
    case ORDER_CONFIG_SIZE:
        *table().module->configuration_size = orders_.transfer.config.size;
        return;
    case ORDER_CONFIGURE: return configure();
    case ORDER_FORWARD: return forward();
    case ORDER_SILENCE: sending_cells_ = 0; return;
    case ORDER_BOOT_LOADER: return enter_boot_loader();
    }
}

void Module::configure() {
    const auto &config = orders_.transfer.config;
    std::copy_n(config.data, config.size, table().module->configuration);
}

void Module::forward() {
    const calibration_area_t area = {eeprom(EEPROM_CALIB_RESTRICTED), eeprom(EEPROM_CALIB_X_MIN),
                                     eeprom(EEPROM_CALIB_X_MAX), eeprom(EEPROM_CALIB_Y_MIN),
                                     eeprom(EEPROM_CALIB_Y_MAX)};
    const uint8_t before = orders_.state;
    if (orders_forward(&orders_, x_, y_, &area)) repeat_at_ = time_.now;
    follow_state(before);
}

// The program is gone, with all that it was doing; timer 0 is off.
void Module::enter_boot_loader() {
    time_.next_tick = NEVER;
    burst_.job = JOB_NONE;
    drop_call();
    stack().abandon();
}

// The boot loader is left by an order, or when the last page is in. The program stays the one that
// was built for the emulator.
void Module::take_in_boot_loader(const CanFrame &frame) {
    if (frame.rtr || frame.dlc == 0) {
        counts_.frames_refused++;
        return;
    }
    if (orders_leaves_boot_loader(frame.data[0])) restart();
    if (!orders_is_own_program(frame.data[0])) return;
    transfer_t &transfer = orders_.transfer;
    const auto event = transfer_receive(&transfer, frame.data.data(), frame.dlc);
    counts_.frames_refused += event == TRANSFER_REFUSED;
    if (event != TRANSFER_OWN_PAGE_DONE || transfer_own_pages_missing(&transfer) > 0) return;
    report(EventKind::PRINT, "its boot loader has taken " + std::to_string(transfer.own.pages) +
                                 " pages; it goes on with the program it was built with\n");
    restart();
}

// Leaves the interrupt that runs, and all calls of the program.
void Module::restart() {
    reset(time_.now);
    stack().abandon();
}

// The program's buffer is one: it is valid until the callback returns.
void Module::hand_over(const CanFrame &frame) {
    const auto &api = *table().module;
    api.can_message->id = frame.id;
    api.can_message->header = static_cast<uint8_t>(frame.dlc << 1);
    std::copy_n(frame.data.begin(), frame.data.size(), api.can_message->data);
    const Interrupt interrupt(*this);
    (*api.can_rx)(api.can_message);
}

// Answers

CanFrame Module::frame_to_host() const {
    CanFrame frame;
    frame.id = kilogrid_id({x_, y_, ADDR_DISPATCHER});
    return frame;
}

void Module::forward_reports() {
    CanFrame frame = frame_to_host();
    frame.dlc = ROBOT_REPORT_BYTES;
    while (robot_reports_take(&orders_.reports, frame.data.data())) queue_answer(frame, 0);
}

// All records are taken at once; the chip takes them one by one, a few milliseconds later.
void Module::answer_poll() {
    auto &records = *table().module->records;
    const Cycles pass = orders_.state == STATE_IDLE ? BREATH_STEP : AFTER_RECORD;
    CanFrame start = frame_to_host();
    const uint8_t waiting = records.store.used;
    start.dlc = answers_poll(waiting, start.data.data());
    queue_answer(start, 0);
    for (uint8_t i = 0; i < waiting; i++) {
        const auto &record = records.slots[record_store_take(&records.store)];
        queue_answer(frame_of(record, start.id), i == 0 ? AFTER_START : pass);
    }
}

void Module::answer_health(uint8_t part) {
    const auto &api = *table().module;
    const auto seconds_up = static_cast<uint64_t>(seconds(time_.now - power_up_));
    health_facts_t facts{};
    facts.config_crc = configuration_crc();
    facts.uptime_s = static_cast<uint16_t>(std::min<uint64_t>(seconds_up, UINT16_MAX));
    facts.config_size = *api.configuration_size;
    facts.lost_records = api.records->store.lost;
    facts.transmit_errors = tec_;
    facts.receive_errors = rec_;
    CanFrame frame = frame_to_host();
    frame.dlc = answers_health(&orders_, part, &facts, frame.data.data());
    queue_answer(frame, 0);
}

// Volatile memory of the program: copied byte by byte.
uint16_t Module::configuration_crc() const {
    const auto &api = *table().module;
    std::array<uint8_t, MODULE_CONFIGURATION_BUFFER_SIZE> bytes;
    std::copy_n(api.configuration, bytes.size(), bytes.begin());
    return crc_of(bytes.data(), answers_configured(&orders_, *api.configuration_size));
}

/// Puts a frame behind those that wait, `gap` after them.
void Module::queue_answer(const CanFrame &frame, Cycles gap) {
    const Cycles last = answers_.empty() ? time_.now : std::max(time_.now, answers_.back().at);
    answers_.push_back({last + gap, frame});
    const Interrupt interrupt(*this);
    (*table().module->can_tx_success)();
}

void Module::emit_answers(Cycles until) {
    auto due = answers_.begin();
    while (due != answers_.end() && due->at < until) can_frames.push_back(*due++);
    answers_.erase(answers_.begin(), due);
}

CanFrame Module::frame_of(const kt_can_message_t &message, uint16_t id) {
    CanFrame frame;
    frame.id = id;
    frame.dlc = std::min<uint8_t>(message.header >> 1 & 0x0F, CanFrame::DATA_MAX);
    std::copy_n(message.data, frame.dlc, frame.data.begin());
    return frame;
}

}  // namespace kilotwin
