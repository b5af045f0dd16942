/// Arrays that are indexed beyond their bounds, as `kilotwin port` hears of them: the compiler
/// calls this instead of stopping the program. Each place is told once.
#include <stdint.h>
#include <stdio.h>

// As compilers lay them out.
struct type {
    uint16_t kind, info;  // of an integer: 0; twice the logarithm of its bits, 1 more if signed
    char name[];
};

struct place {
    const char *file;
    uint32_t line, column;
    const struct type *array, *index;
};

void kt_print(const char *text, uint32_t bytes);

void __ubsan_handle_out_of_bounds(struct place *place, uintptr_t index) {
    if (place->line == 0) return;
    const unsigned unused = 64 - (1u << (place->index->info >> 1));
    const long long value = (place->index->info & 1) != 0
                                ? (long long)(index << unused) >> unused
                                : (long long)(index & (UINT64_MAX >> unused));
    char text[256];
    const int bytes = snprintf(text, sizeof text, "\001%s\t%u\t%lld\t%s\n", place->file,
                               (unsigned)place->line, value, place->array->name);
    place->line = 0;
    kt_print(text, (uint32_t)(bytes < (int)sizeof text ? bytes : (int)sizeof text - 1));
}
