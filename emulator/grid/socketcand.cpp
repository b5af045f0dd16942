#include "grid/socketcand.h"

#include <charconv>
#include <cmath>
#include <optional>

namespace kilotwin {

namespace {

constexpr std::string_view OK = "< ok >";
constexpr std::string_view HEX = "0123456789ABCDEF";

using Words = std::vector<std::string_view>;

/// The words of a command, separated by blanks.
Words words_of(std::string_view text) {
    Words words;
    size_t begin = 0;
    while ((begin = text.find_first_not_of(" \t\r\n", begin)) != std::string_view::npos) {
        size_t end = std::min(text.find_first_of(" \t\r\n", begin), text.size());
        words.push_back(text.substr(begin, end - begin));
        begin = end;
    }
    return words;
}

/// The number that `text` as a whole stands for; none if it is not one of `base`, or above `most`.
std::optional<unsigned> number_of(std::string_view text, int base, unsigned most) {
    unsigned value = 0;
    auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
    if (error != std::errc() || end != text.data() + text.size() || value > most) return {};
    return value;
}

/// "send", an identifier of up to three hexadecimal digits, a length, as many hexadecimal bytes.
std::optional<CanFrame> frame_of(const Words &words) {
    constexpr size_t STANDARD_DIGITS = 3;
    if (words.size() < 3 || words[1].size() > STANDARD_DIGITS) return {};
    auto id = number_of(words[1], 16, CanFrame::ID_MAX);
    auto length = number_of(words[2], 10, CanFrame::DATA_MAX);
    if (!id || !length || words.size() != 3 + *length) return {};
    CanFrame frame = {static_cast<uint16_t>(*id), static_cast<uint8_t>(*length)};
    for (size_t i = 0; i < *length; i++) {
        auto byte = number_of(words[3 + i], 16, 0xFF);
        if (!byte || words[3 + i].size() > 2) return {};
        frame.data[i] = static_cast<uint8_t>(*byte);
    }
    return frame;
}

}  // namespace

void append_socketcand_frame(std::string &text, const CanFrame &frame, double at_s) {
    constexpr uint64_t MICROSECONDS = 1'000'000;
    auto at_us = static_cast<uint64_t>(std::llround(std::abs(at_s) * MICROSECONDS));
    std::string fraction = std::to_string(at_us % MICROSECONDS);
    text += "< frame ";
    for (int shift = 8; shift >= 0; shift -= 4) text += HEX[frame.id >> shift & 0xF];
    text += at_s < 0 && at_us > 0 ? " -" : " ";
    text += std::to_string(at_us / MICROSECONDS);
    text += '.';
    text.append(6 - fraction.size(), '0').append(fraction);
    // Without data two spaces remain, which python-can needs.
    text += ' ';
    for (size_t i = 0; i < frame.dlc; i++) {
        text += HEX[frame.data[i] >> 4];
        text += HEX[frame.data[i] & 0xF];
    }
    text += " >";
}

void SocketcandSession::feed(std::string_view bytes, std::string &replies,
                             std::vector<CanFrame> &frames) {
    for (char c : bytes) {
        if (closing_) return;
        if (c == '<') {
            // A "<" within a command begins another.
            if (inside_) refuse("unknown command", replies);
            inside_ = true;
            stray_ = false;
            command_.clear();
        } else if (!inside_) {
            // Text between commands is one error, however long; blanks and line ends are none.
            bool is_blank = c == ' ' || c == '\n' || c == '\r' || c == '\t';
            if (!is_blank && !stray_) refuse("unknown command", replies);
            stray_ = stray_ || !is_blank;
        } else if (c == '>') {
            inside_ = false;
            execute(command_, replies, frames);
        } else if (command_.size() == COMMAND_MAX) {
            inside_ = false;
            stray_ = true;
            refuse("unknown command", replies);
        } else {
            command_ += c;
        }
    }
}

/// `echo` is answered always, everything else but `open` only once a bus is open.
void SocketcandSession::execute(std::string_view command, std::string &replies,
                                std::vector<CanFrame> &frames) {
    Words words = words_of(command);
    std::string_view verb = words.empty() ? std::string_view() : words[0];
    if (verb == "echo" && words.size() == 1) {
        replies += "< echo >";
    } else if (!opened_) {
        if (verb == "open" && words.size() == 2)
            open(words[1], replies);
        else
            refuse("unknown command", replies);
    } else if ((verb == "rawmode" || verb == "bcmmode") && words.size() == 1) {
        raw_ = verb == "rawmode";
        replies += OK;
    } else if (verb == "send") {
        if (auto frame = frame_of(words))
            frames.push_back(*frame);
        else
            refuse("syntax error in send command", replies);
    } else {
        refuse("unknown command", replies);
    }
}

/// Buses are named can0, can1 ...; an unknown one ends the connection, as socketcand does.
void SocketcandSession::open(std::string_view name, std::string &replies) {
    constexpr std::string_view PREFIX = "can";
    auto index = name.starts_with(PREFIX) ? number_of(name.substr(PREFIX.size()), 10, 0xFFFF)
                                          : std::optional<unsigned>();
    if (!index || *index >= buses_) {
        refuse("could not open bus", replies);
        closing_ = true;
        return;
    }
    opened_ = true;
    bus_ = *index;
    replies += OK;
}

/// Answers with an error and counts it.
void SocketcandSession::refuse(std::string_view reason, std::string &replies) {
    malformed_++;
    replies.append("< error ").append(reason).append(" >");
}

}  // namespace kilotwin
