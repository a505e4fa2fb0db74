// What the Rust side of the bridge needs of C++: the callbacks of a running render.
#pragma once

#include "rust/cxx.h"
#include "segue.h"

#include <cstdint>
#include <exception>
#include <string>

// Called by cxx around C++ functions that return a Result to Rust. Its own version lets anything that is
// not a std::exception terminate the process.
namespace rust {
namespace behavior {
template <typename Try, typename Fail>
static void trycatch(Try &&func, Fail &&fail) noexcept {
    try {
        func();
    } catch (const std::exception &e) {
        fail(e.what());
    } catch (...) {
        fail("an exception that is not a std::exception");
    }
}
} // namespace behavior
} // namespace rust

namespace segue {
namespace bridge {

// The callbacks of one call of segue_render_run. What they throw must not cross Rust: it cancels.
class Callbacks {
  public:
    explicit Callbacks(const segue_callbacks *callbacks) : callbacks_(callbacks ? *callbacks : segue_callbacks{}) {}

    // True: cancel.
    bool progress(rust::Str json) noexcept;
    void tile(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height) noexcept;

  private:
    segue_callbacks callbacks_;
    std::string text_;
    bool broken_ = false;
};

} // namespace bridge
} // namespace segue
