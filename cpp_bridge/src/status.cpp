#include "status.h"

#include "rust/cxx.h"

#include <new>

namespace segue {

std::string &last_error() {
    thread_local std::string text;
    return text;
}

namespace {

// Rust failures arrive as "status:text".
segue_status take_apart(const char *what) {
    std::string text(what);
    const std::size_t colon = text.find(':');
    if (colon == 1 && text[0] >= '1' && text[0] <= '5') {
        last_error() = text.substr(2);
        return static_cast<segue_status>(text[0] - '0');
    }
    last_error() = text;
    return SEGUE_INTERNAL;
}

} // namespace

segue_status translate_exception() noexcept {
    try {
        try {
            throw;
        } catch (const Failure &e) {
            last_error() = e.what();
            return e.status;
        } catch (const rust::Error &e) {
            return take_apart(e.what());
        } catch (const std::bad_alloc &) {
            last_error() = "out of memory";
            return SEGUE_INTERNAL;
        } catch (const std::exception &e) {
            last_error() = e.what();
            return SEGUE_INTERNAL;
        } catch (...) {
            last_error() = "an unknown exception";
            return SEGUE_INTERNAL;
        }
    } catch (...) {
        // keeping the text failed for lack of memory: the status must do
        return SEGUE_INTERNAL;
    }
}

} // namespace segue
