#include "robots/native/undefined.h"

#include <cstdio>

#include "robots/native/abi.h"

namespace kilotwin {

namespace {

/// A type as compilers describe it: `info` of a whole number is 2 log2(bits), plus 1 if it has a
/// sign. The name stands in quotes.
struct Type {
    uint16_t kind, info;
    char name[1];

    bool is_whole() const { return kind == 0; }
    bool has_sign() const { return (info & 1) != 0; }
    unsigned bits() const { return 1u << (info >> 1); }
};

/// The types of a place follow its file, line and column.
const Type &type_of(const void *data, size_t number) {
    constexpr size_t LOCATION_BYTES = 16;
    const void *types = static_cast<const uint8_t *>(data) + LOCATION_BYTES;
    return *static_cast<const Type *const *>(types)[number];
}

std::string name_of(const Type &type) {
    std::string name = type.name;
    if (name.size() >= 2 && name.front() == '\'') name = name.substr(1, name.find('\'', 1) - 1);
    return name;
}

bool is_negative(const Type &type, uint64_t value) {
    return type.has_sign() && type.bits() <= 64 && (value >> (type.bits() - 1) & 1) != 0;
}

std::string number_of(const Type &type, uint64_t value) {
    if (!type.is_whole() || type.bits() > 64) return "a number";
    const unsigned unused = 64 - type.bits();
    const uint64_t raised = value << unused;
    return type.has_sign() ? std::to_string(static_cast<int64_t>(raised) >> unused)
                           : std::to_string(raised >> unused);
}

std::string operation(const void *data, uint64_t first, const char *sign, uint64_t second) {
    const Type &type = type_of(data, 0);
    return number_of(type, first) + " " + sign + " " + number_of(type, second);
}

/// An int that fits here may not on the robot, which is worth a word where it does not even here.
std::string overflow(const void *data, uint64_t first, const char *sign, uint64_t second) {
    const std::string name = name_of(type_of(data, 0));
    return operation(data, first, sign, second) + " does not fit into " + name +
           (name == "int" ? ", which has 16 bits on the robot" : "");
}

std::string shift(const void *data, uint64_t first, uint64_t second) {
    const Type &left = type_of(data, 0), &right = type_of(data, 1);
    const std::string by = number_of(right, second);
    if (is_negative(right, second)) return "a shift by " + by + ", which is negative";
    if (right.bits() <= 64 && second >= left.bits())
        return "a shift by " + by + " bits of " + name_of(left) + ", which has " +
               std::to_string(left.bits());
    return number_of(left, first) + " << " + by + " does not fit into " + name_of(left);
}

std::string address_of(uint64_t pointer) {
    char text[32];
    std::snprintf(text, sizeof text, "address 0x%llx", static_cast<unsigned long long>(pointer));
    return text;
}

/// The compiler's name of what is done behind the type and an exponent of its alignment.
std::string access(const void *data, uint64_t pointer) {
    static constexpr const char *DOES[] = {
        "a load of", "a store to", "a reference to", "a member of", "a call of", "a call of",
        "a call of", "a cast of",  "a cast of",      "a cast of",   "a cast of", "a cast of"};
    const uint8_t does = static_cast<const uint8_t *>(data)[25];
    const std::string what = does < sizeof DOES / sizeof *DOES ? DOES[does] : "a use of";
    const std::string type = name_of(type_of(data, 0));
    if (pointer == 0) return what + " " + type + " by a pointer that is NULL";
    return what + " " + type + " at " + address_of(pointer) + ", where there is less than that";
}

}  // namespace

std::string undefined_text(uint8_t what, const void *data, uint64_t first, uint64_t second) {
    switch (what) {
    case KT_UB_ADD: return overflow(data, first, "+", second);
    case KT_UB_SUBTRACT: return overflow(data, first, "-", second);
    case KT_UB_MULTIPLY: return overflow(data, first, "*", second);
    case KT_UB_NEGATE:
        return "-(" + number_of(type_of(data, 0), first) + ") does not fit into " +
               name_of(type_of(data, 0));
    case KT_UB_DIVIDE:
        if (second == 0) return "a division by zero";
        return overflow(data, first, "/", second);
    case KT_UB_SHIFT: return shift(data, first, second);
    case KT_UB_INDEX:
        return "index " + number_of(type_of(data, 1), first) + " out of bounds for type " +
               name_of(type_of(data, 0));
    case KT_UB_ACCESS: return access(data, first);
    case KT_UB_LENGTH:
        return "an array of " + number_of(type_of(data, 0), first) + " items: it must have one";
    case KT_UB_CONVERSION:
        return "a number of type " + name_of(type_of(data, 0)) + " that is out of the range of " +
               name_of(type_of(data, 1));
    case KT_UB_VALUE:
        return "a value of " + number_of(type_of(data, 0), first) + ", which " +
               name_of(type_of(data, 0)) + " cannot have";
    case KT_UB_POINTER: return "a pointer that leaves memory, from " + address_of(first);
    case KT_UB_NULL_ARGUMENT: return "NULL for an argument that must not be NULL";
    case KT_UB_BUILTIN: return "the bits of 0 are counted, which no processor does alike";
    default: return "undefined behaviour";
    }
}

}  // namespace kilotwin
