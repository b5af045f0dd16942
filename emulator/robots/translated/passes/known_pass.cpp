#include "robots/translated/passes/known_pass.h"

#include <algorithm>

namespace kilotwin {

namespace {

constexpr unsigned MOST_BITS = 64;

uint64_t mask_of(unsigned bits) {
    return bits >= MOST_BITS ? UINT64_MAX : (uint64_t{1} << bits) - 1;
}

/// Ticks until a number that goes by `slope`, -1 to 1, comes to the other end of its `bits`.
uint64_t until_wrap(uint64_t number, int slope, uint64_t mask) {
    if (slope == 0) return UINT64_MAX;
    const uint64_t way = slope > 0 ? mask - number : number;
    return way == UINT64_MAX ? way : way + 1;
}

/// Ticks until a < b comes out differently, unless one of them wraps before.
uint64_t until_crossing(uint64_t a, uint64_t b, int slope) {
    if (slope > 0 && a < b) return b - a;
    if (slope < 0 && a >= b) return a - b + 1;
    return UINT64_MAX;
}

/// Two ticks at a time are looked at singly: nothing is passed over.
constexpr uint64_t SINGLY = 1;

}  // namespace

uint64_t LinearForm::value(const uint8_t *data, uint32_t ticks) const {
    uint64_t sum = constant + static_cast<uint64_t>(static_cast<int64_t>(slope)) * ticks;
    for (const Term &term : terms) {
        const uint64_t part = uint64_t{data[term.address]} << term.shift;
        sum += term.sign > 0 ? part : ~part + 1;
    }
    return sum;
}

void LinearForm::add(const LinearForm &other, int sign) {
    slope += sign * other.slope;
    constant += sign > 0 ? other.constant : ~other.constant + 1;
    for (Term term : other.terms) {
        term.sign = static_cast<int8_t>(term.sign * sign);
        terms.push_back(term);
    }
}

uint64_t BranchCondition::lasts(const uint8_t *data, uint32_t ticks) const {
    const uint64_t mask = mask_of(bits);
    uint64_t first = a.value(data, ticks) & mask;
    if (kind == Kind::ZERO) {
        if ((first == 0) != outcome) return 0;
        if (a.slope == 0) return UINT64_MAX;
        return first == 0 ? SINGLY : (a.slope > 0 ? mask - first + 1 : first);
    }
    if (kind == Kind::BIT) {
        if (((first >> bit & 1) != 0) != outcome) return 0;
        return until_wrap(first & mask_of(bit), a.slope, mask_of(bit));
    }
    uint64_t second = b.value(data, ticks) & mask;
    if (kind == Kind::LESS_SIGNED) {
        const uint64_t top = mask ^ mask >> 1;  // numbers with a sign, in order without one
        first ^= top, second ^= top;
    }
    if ((first < second) != outcome) return 0;
    return std::min({until_crossing(first, second, a.slope - b.slope),
                     until_wrap(first, a.slope, mask), until_wrap(second, b.slope, mask)});
}

uint32_t PathCondition::lasts(const uint8_t *data, uint32_t ticks) const {
    for (const auto &[address, value] : equal)
        if (data[address] != value) return 0;
    uint64_t lasts = MOST_TICKS;
    for (const BranchCondition &condition : conditions)
        lasts = std::min(lasts, condition.lasts(data, ticks));
    return static_cast<uint32_t>(lasts);
}

bool PathCondition::has(uint16_t address, unsigned bytes) const {
    const auto is_there = [&](const auto &one) { return one.address - address + 0u < bytes; };
    const auto asks = [&](const LinearForm &number) {
        return std::any_of(number.terms.begin(), number.terms.end(), is_there);
    };
    return std::any_of(equal.begin(), equal.end(), is_there) ||
           std::any_of(conditions.begin(), conditions.end(), [&](const auto &condition) {
               return asks(condition.a) || asks(condition.b);
           });
}

bool ClockCopy::holds(const uint8_t *data, uint32_t ticks) const {
    const uint64_t value = ticks + ahead;
    for (unsigned byte = 0; byte < bytes; byte++)
        if (data[address + byte] != static_cast<uint8_t>(value >> 8 * byte)) return false;
    return true;
}

void KnownPass::add_to_first(const PathCondition &more) {
    const auto has = [](const auto &all, const auto &one) {
        return std::find(all.begin(), all.end(), one) != all.end();
    };
    for (const PathCondition::Equal &one : more.equal)
        if (!has(rest.equal, one) && !has(first.equal, one)) first.equal.push_back(one);
    for (const BranchCondition &one : more.conditions) {
        BranchCondition before = one;  // the same of the tick before
        for (LinearForm *number : {&before.a, &before.b})
            number->constant += static_cast<uint64_t>(static_cast<int64_t>(number->slope));
        const bool is_said = has(rest.conditions, one) || has(rest.conditions, before);
        if (!is_said && !has(first.conditions, one)) first.conditions.push_back(one);
    }
    first.changes |= more.changes;
}

uint32_t KnownPass::lasts(const uint8_t *data, uint32_t ticks) const {
    for (const ClockCopy &copy : copies)
        if (!copy.holds(data, ticks)) return 0;
    const uint32_t lasts = rest.lasts(data, ticks);
    return lasts <= 1 ? lasts : std::min(lasts, 1 + first.lasts(data, ticks + 1));
}

}  // namespace kilotwin
