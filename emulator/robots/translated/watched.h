/// Macros of a watched translation (TRANSLATED_WATCHED), for a trail (robots/trail.h): they report
/// where the code stands before a store to SRAM that changes a byte, and before a write that shows
/// on a pin. In other translations they are empty. For regions alone, as macros of
/// translated/code.h.
#ifndef KILOTWIN_ROBOTS_TRANSLATED_WATCHED_H
#define KILOTWIN_ROBOTS_TRANSLATED_WATCHED_H

#ifdef TRANSLATED_WATCHED
#define NOTE_PLACE(at, offset)                                             \
    (M[0x5D] = (uint8_t)sp, M[0x5E] = (uint8_t)(sp >> 8), chip->pc = (at), \
     chip->left = left - (offset))
#define NOTE_STORE(at, offset, address, r)                                                 \
    do {                                                                                   \
        if (M[address] != (r))                                                             \
            NOTE_PLACE(at, offset), chip->stores(chip, (uint16_t)(address), (uint8_t)(r)); \
    } while (0)
#define NOTE_JUMP(at) (chip->jumped = (at))
#else
#define NOTE_PLACE(at, offset) (void)0
#define NOTE_JUMP(at) (void)0
#define NOTE_STORE(at, offset, address, r) (void)0
#endif

#endif
