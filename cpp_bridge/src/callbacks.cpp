#include "bridge.h"

namespace segue {
namespace bridge {

bool Callbacks::progress(rust::Str json) noexcept {
    if (broken_) {
        return true;
    }
    if (!callbacks_.progress) {
        return false;
    }
    try {
        text_.assign(json.data(), json.size());
        return callbacks_.progress(callbacks_.user, text_.c_str()) != 0;
    } catch (...) {
        broken_ = true;
        return true;
    }
}

void Callbacks::tile(std::uint32_t x, std::uint32_t y, std::uint32_t width, std::uint32_t height) noexcept {
    if (broken_ || !callbacks_.tile) {
        return;
    }
    try {
        callbacks_.tile(callbacks_.user, x, y, width, height);
    } catch (...) {
        broken_ = true;
    }
}

} // namespace bridge
} // namespace segue
