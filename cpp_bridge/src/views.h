// Views of a caller's arrays for the Rust side, checked as far as C pointers can be.
#pragma once

#include "status.h"

#include "rust/cxx.h"

#include <cstdint>
#include <limits>
#include <string>

namespace segue {

// A slice of `count * width` values; null is allowed where there are none.
template <typename T>
rust::Slice<const T> slice(const T *data, std::size_t count, std::size_t width, const char *name) {
    if (count > std::numeric_limits<std::ptrdiff_t>::max() / sizeof(T) / width) {
        throw Failure(SEGUE_BAD_ARGUMENT, std::string(name) + ": absurd count " + std::to_string(count));
    }
    if (count != 0 && !data) {
        throw Failure(SEGUE_BAD_ARGUMENT, std::string(name) + " is null but has a count");
    }
    if (reinterpret_cast<std::uintptr_t>(data) % alignof(T) != 0) {
        throw Failure(SEGUE_BAD_ARGUMENT, std::string(name) + " is not aligned");
    }
    return count ? rust::Slice<const T>(data, count * width) : rust::Slice<const T>();
}

// A string view; text that is not UTF-8 is an error.
inline rust::Str text(const char *value, const char *name) {
    required(value, name);
    try {
        return rust::Str(value);
    } catch (const std::invalid_argument &) {
        throw Failure(SEGUE_BAD_ARGUMENT, std::string(name) + " is not UTF-8");
    }
}

// A string view where null means empty.
inline rust::Str optional_text(const char *value, const char *name) {
    return value ? text(value, name) : rust::Str("");
}

} // namespace segue
