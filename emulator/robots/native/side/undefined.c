// Functions that compilers call when a check of -fsanitize=undefined or bounds fails, in place of
// their own library: they hand the finding to the engine. The data of a place is a variable of the
// program, so of each robot; its column is set once it has been told.
#include "side.h"

typedef struct {
    const char *file;
    uint32_t line, column;
} place_t;

#define TOLD UINT32_MAX

// Two checks may find the same at a line.
static const char *last_file;
static uint32_t last_line;

static void tell(uint8_t what, place_t *place, uintptr_t first, uintptr_t second) {
    if (place->column == TOLD) return;
    place->column = TOLD;
    if (place->file == last_file && place->line == last_line) return;
    last_file = place->file;
    last_line = place->line;
    kt_host->undefined(what, place, first, second);
}

#define HANDLER_OF_0(name, what)                \
    void __ubsan_handle_##name(place_t *place); \
    void __ubsan_handle_##name(place_t *place) { tell(what, place, 0, 0); }
#define HANDLER_OF_1(name, what)                                 \
    void __ubsan_handle_##name(place_t *place, uintptr_t first); \
    void __ubsan_handle_##name(place_t *place, uintptr_t first) { tell(what, place, first, 0); }
#define HANDLER_OF_2(name, what)                                                    \
    void __ubsan_handle_##name(place_t *place, uintptr_t first, uintptr_t second);  \
    void __ubsan_handle_##name(place_t *place, uintptr_t first, uintptr_t second) { \
        tell(what, place, first, second);                                           \
    }

HANDLER_OF_2(add_overflow, KT_UB_ADD)
HANDLER_OF_2(sub_overflow, KT_UB_SUBTRACT)
HANDLER_OF_2(mul_overflow, KT_UB_MULTIPLY)
HANDLER_OF_1(negate_overflow, KT_UB_NEGATE)
HANDLER_OF_2(divrem_overflow, KT_UB_DIVIDE)
HANDLER_OF_2(shift_out_of_bounds, KT_UB_SHIFT)
HANDLER_OF_1(out_of_bounds, KT_UB_INDEX)
HANDLER_OF_1(type_mismatch_v1, KT_UB_ACCESS)
HANDLER_OF_1(vla_bound_not_positive, KT_UB_LENGTH)
HANDLER_OF_1(float_cast_overflow, KT_UB_CONVERSION)
HANDLER_OF_1(load_invalid_value, KT_UB_VALUE)
HANDLER_OF_2(pointer_overflow, KT_UB_POINTER)
HANDLER_OF_0(nonnull_arg, KT_UB_NULL_ARGUMENT)
HANDLER_OF_0(invalid_builtin, KT_UB_BUILTIN)

void __ubsan_handle_builtin_unreachable(place_t *place);
void __ubsan_handle_builtin_unreachable(place_t *place) {
    (void)place;
    kt_unusable("came to __builtin_unreachable()");
}
