#pragma once

#include <filesystem>
#include <string>

namespace terracast::test {

/// A job of a few frames whose datasets have all files that terracast writes: rigs with errors and clocks, rolling
/// shutters, a sensor, imaging, things that move, and all formats. Made once; readers copy what they change.
/// returns   its folder, with `world` and `export/<format>`
std::filesystem::path every_file_job();

}  // namespace terracast::test
