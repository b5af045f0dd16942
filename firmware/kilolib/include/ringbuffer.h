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
        RB_counter head, count;     \
        type elems[size];           \
    } name;                         \
    enum { name##_rbsize = (size) }
// NOLINTEND(bugprone-macro-parentheses)

#define RB_init(name) ((void)((name).head = 0, (name).count = 0))
#define RB_clear(name) RB_init(name)

#define RB_capacity(name) ((RB_counter)name##_rbsize)
#define RB_size(name) ((name).count)
#define RB_empty(name) ((name).count == 0)
#define RB_full(name) ((name).count == name##_rbsize)

/// The i-th element, 0 is the oldest.
#define RB_idx(name, i) ((name).elems[((name).head + (i)) % name##_rbsize])
#define RB_front(name) RB_idx(name, 0)
#define RB_back(name) RB_idx(name, (name).count)

/// Positions: for (i = RB_begin(b); i != RB_end(b); RB_next(b, i)) visits `elems[i]`.
#define RB_begin(name) ((name).head)
#define RB_end(name) (((name).head + (name).count) % name##_rbsize)
#define RB_next(name, i) ((i) = ((i) + 1) % name##_rbsize)

#define RB_pushback(name)                                    \
    do {                                                     \
        if (RB_full(name))                                   \
            (name).head = ((name).head + 1) % name##_rbsize; \
        else                                                 \
            (name).count++;                                  \
    } while (0)

/// Does nothing if the buffer is empty.
#define RB_popfront(name)                                    \
    do {                                                     \
        if (!RB_empty(name)) {                               \
            (name).head = ((name).head + 1) % name##_rbsize; \
            (name).count--;                                  \
        }                                                    \
    } while (0)

#endif
