/// Ring buffers of any type, as macros: `name` is a variable made by RB_create().
///
/// RB_pushback() makes room for one element; RB_back() is the place behind the last one, to be
/// filled before the push. A full buffer loses its oldest element to a push.
#ifndef __RINGBUFFER_H__
#define __RINGBUFFER_H__  // NOLINT(bugprone-reserved-identifier): programs know it

/// Type of indices and counts; a program may define a smaller one before.
#ifndef RB_counter
#define RB_counter unsigned int
#endif

/// Defines the variable `name` with places for `size` elements of `type`. RB_init() before use.
// NOLINTBEGIN(bugprone-macro-parentheses): the arguments are names and types
#define RB_create(name, type, size) \
    struct {                        \
        RB_counter first, used;     \
        type places[size];          \
    } name;                         \
    enum { name##_places = (size) }
// NOLINTEND(bugprone-macro-parentheses)

#define RB_init(name) ((void)((name).first = 0, (name).used = 0))
#define RB_clear(name) RB_init(name)

#define RB_capacity(name) ((RB_counter)name##_places)
#define RB_size(name) ((name).used)
#define RB_empty(name) ((name).used == 0)
#define RB_full(name) ((name).used == name##_places)

/// The i-th element, 0 is the oldest.
#define RB_idx(name, i) ((name).places[((name).first + (i)) % name##_places])
#define RB_front(name) RB_idx(name, 0)
#define RB_back(name) RB_idx(name, (name).used)

/// Positions: for (i = RB_begin(b); i != RB_end(b); RB_next(b, i)) visits `places[i]`.
#define RB_begin(name) ((name).first)
#define RB_end(name) (((name).first + (name).used) % name##_places)
#define RB_next(name, i) ((i) = ((i) + 1) % name##_places)

#define RB_pushback(name)                                      \
    do {                                                       \
        if (RB_full(name))                                     \
            (name).first = ((name).first + 1) % name##_places; \
        else                                                   \
            (name).used++;                                     \
    } while (0)

/// Does nothing if the buffer is empty.
#define RB_popfront(name)                                      \
    do {                                                       \
        if (!RB_empty(name)) {                                 \
            (name).first = ((name).first + 1) % name##_places; \
            (name).used--;                                     \
        }                                                      \
    } while (0)

#endif
