// Errors on their way out: exceptions become a status and a text kept for the calling thread.
#pragma once

#include "segue.h"

#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

namespace segue {

// A failure with its status.
class Failure : public std::runtime_error {
  public:
    Failure(segue_status status, const std::string &text) : std::runtime_error(text), status(status) {}
    segue_status status;
};

// The text of the last failure on this thread.
std::string &last_error();

// Translates the exception being handled; never throws.
segue_status translate_exception() noexcept;

// Runs `body`; whatever it throws becomes a status.
template <typename Body> segue_status guard(Body &&body) noexcept {
    try {
        last_error().clear();
        return body();
    } catch (...) {
        return translate_exception();
    }
}

// The pointer, or a failure that names the argument.
template <typename T> T *required(T *pointer, const char *name) {
    if (!pointer) {
        throw Failure(SEGUE_BAD_ARGUMENT, std::string(name) + " is null");
    }
    return pointer;
}

} // namespace segue
