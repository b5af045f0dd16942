/// Results of the engine as numpy arrays and Python texts, without a copy where they are large.
#ifndef KILOTWIN_PYTHON_ARRAYS_H
#define KILOTWIN_PYTHON_ARRAYS_H

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <utility>
#include <vector>

#include "base/events.h"

namespace kilotwin {

/// A numpy array of one dimension, or of two and `columns` wide. It takes `values` over, so this
/// costs the same however long they are. Needs the interpreter's lock.
template <typename T> nanobind::object array_of(std::vector<T> values, size_t columns = 0) {
    // The capsule deletes the vector once numpy has no more use for it.
    auto owned = new std::vector<T>(std::move(values));
    nanobind::capsule owner(owned,
                            [](void *p) noexcept { delete static_cast<std::vector<T> *>(p); });
    // Rows of `columns`; a length that is no multiple of it is a mistake of the caller.
    using Array = nanobind::ndarray<nanobind::numpy, T>;
    if (columns == 0) return nanobind::cast(Array(owned->data(), {owned->size()}, owner));
    return nanobind::cast(Array(owned->data(), {owned->size() / columns, columns}, owner));
}

/// The text of an event. A program may print any bytes: what is not UTF-8 is escaped, never an
/// error.
/// Needs the interpreter's lock too.
inline nanobind::object text_of(const Event &event) {
    return nanobind::steal(PyUnicode_DecodeUTF8(
        event.text.data(), static_cast<Py_ssize_t>(event.text.size()), "backslashreplace"));
}

/// Adds what every event of a program has to its row: `program`, `kind` and `text`, and `code`, a
/// list of addresses, where that is known.
///
/// `row` is what Python gets, a dict. Needs the interpreter's lock too.
inline void describe(nanobind::dict &row, const Event &event) {
    row["program"] = event.program;
    row["kind"] = name_of(event.kind);
    row["text"] = text_of(event);
    nanobind::list code;
    for (const uint32_t address : event.code) code.append(address);
    if (!event.code.empty()) row["code"] = code;
}

}  // namespace kilotwin

#endif
