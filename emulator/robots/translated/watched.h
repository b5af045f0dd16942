/// Macros of a watched translation (TRANSLATED_WATCHED), for a trail (robots/trail.h) and for a
/// debugger (written_bytes.h): they report where the code stands before a store to SRAM that
/// changes a byte, and before a write that shows on a pin; the lowest byte that has been pushed;
/// and counters that go on by several passes at once. In other translations they are empty. For
/// regions alone, as macros of translated/code.h.
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
#define NOTE_PUSH(address) \
    ((address) < chip->pushed_from ? (void)(chip->pushed_from = (uint16_t)(address)) : (void)0)
#define NOTE_COUNTED(all)                                              \
    for (unsigned i_ = 0; i_ < (all)->count; i_++)                     \
        for (unsigned at_ = 0; at_ < (all)->counters[i_].bytes; at_++) \
    NOTE_BYTE((all)->counters[i_].address + at_)
#define NOTE_BYTE(address) chip->stores(chip, (uint16_t)(address), M[address])
#else
#define NOTE_PLACE(at, offset) (void)0
#define NOTE_JUMP(at) (void)0
#define NOTE_STORE(at, offset, address, r) (void)0
#define NOTE_PUSH(address) (void)0
#define NOTE_COUNTED(all) (void)0
#endif

#endif
