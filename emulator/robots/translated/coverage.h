/// Marks of a translation that was made to see what runs (TRANSLATED_MARKED).
#ifndef KILOTWIN_ROBOTS_TRANSLATED_COVERAGE_H
#define KILOTWIN_ROBOTS_TRANSLATED_COVERAGE_H

/// Marks by word address: COVER_RAN of a block that begins there, COVER_TAKEN and COVER_NOT_TAKEN
/// of the branch there, the others where a message or a tick has interrupted. Behind them, from
/// COVER_DEPTHS on, is a mark for each COVER_DEPTH bytes of memory that the stack pointer has come
/// down to. The translation exports them.
enum {
    COVER_RAN = 1,
    COVER_TAKEN = 2,
    COVER_NOT_TAKEN = 4,
    COVER_MESSAGE = 8,
    COVER_TICK = 16,
    COVER_DEPTHS = 0x4000,
    COVER_DEPTH = 16,
    COVERAGE_BYTES = COVER_DEPTHS + 0x10000 / COVER_DEPTH
};

/// Notes that something has happened; for regions alone, as macros of translated/code.h.
#define COVER(at, what) translation_coverage[(at) / 2] |= COVER_##what;
#ifdef TRANSLATED_MARKED
#define NOTE_DEPTH (translation_coverage[COVER_DEPTHS + sp / COVER_DEPTH] = 1)
#else
#define NOTE_DEPTH (void)0
#endif

#endif
