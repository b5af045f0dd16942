/// Reads one table of the host's specification strictly: a key that is missing, and one that the
/// engine does not know, is an error that names it.
///
/// `.loss = medium["loss"]` takes the type from the field. There are no defaults here: the host's
/// schema has resolved all; a wrong specification is a mistake of the host, not of a user, who
/// never reads these errors. Only the types of the fields are checked here, not ranges.
///
/// Cost: a look-up in a dictionary for each key, once a run.
/// The schema: host_tools/kilotwin/experiment/schema.py. Needs the interpreter's lock.
#ifndef KILOTWIN_PYTHON_TABLE_H
#define KILOTWIN_PYTHON_TABLE_H

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <set>
#include <string>
#include <utility>

#include "base/errors.h"

namespace kilotwin {

/// Cheap to copy; copies count the keys that are read each for itself. Not kept beyond the call
/// that reads the specification.
class Table {
  public:
    /// Value of a key; EngineError if its type is another than the one that is asked for.
    class Value {
      public:
        Value(nanobind::handle held, std::string path) : held_(held), path_(std::move(path)) {}

        /// The value as a T; a whole number serves as a double.
        template <typename T> T as() const {
            try {
                return nanobind::cast<T>(held_);
            } catch (const nanobind::cast_error &) {
                throw EngineError("the run's specification has a wrong " + path_);
            }
        }
        /// The same, with the type of the field that is initialised by it.
        template <typename T> operator T() const { return as<T>(); }

        /// None stands for a thing that a run does not have.
        bool is_none() const { return held_.is_none(); }
        /// The Python object, for what is no plain value.
        nanobind::handle held() const { return held_; }
        /// The table under this key, which adds its name to the path.
        Table table() const { return Table(as<nanobind::dict>(), path_ + "."); }

      private:
        nanobind::handle held_;
        std::string path_;
    };

    /// `path` stands before the keys' names in errors: "" or "medium.".
    explicit Table(nanobind::dict values, std::string path = "")
        : values_(std::move(values)),
          path_(std::move(path)) {}

    /// Value of the key, to be converted at once. Marks the key as read.
    /// EngineError without the key.
    Value operator[](const char *key) {
        if (!values_.contains(key))
            throw EngineError("the run's specification lacks " + path_ + key);
        read_.insert(key);
        return {values_[key], path_ + key};
    }

    /// Puts what the key holds into a field. EngineError without the key.
    template <typename T> void read(const char *key, T &field) {
        field = (*this)[key].template as<T>();
    }

    /// Ends the reading: EngineError names a key that was not read, since it would have no effect.
    /// To be called when all keys have been read; nested tables are ended by themselves, each with
    /// its own path in the text of the error. Linear in the number of keys; keys that were not
    /// written are no error here, since reading them was one.
    void end() const {
        for (auto [key, value] : values_) {
            const auto name = nanobind::cast<std::string>(key);
            if (read_.count(name) == 0)
                throw EngineError("the run's specification has an unknown " + path_ + name);
        }
    }

  private:
    nanobind::dict values_;
    std::string path_;
    std::set<std::string> read_;  ///< keys that were asked for
};

}  // namespace kilotwin

#endif
