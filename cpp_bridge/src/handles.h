// What the opaque handles of the C ABI hold.
#pragma once

#include "bridge.h"
#include "segue/src/bridge/mod.rs.h"
#include "status.h"

#include <string>

struct segue_scene {
    rust::Box<segue::bridge::SceneHandle> rust;
    std::string info;
};

struct segue_render {
    rust::Box<segue::bridge::RenderHandle> rust;
    rust::Vec<std::uint8_t> exr;
    std::string stats;
};
