#pragma once

#include <fmt/core.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <tuple>

#include "core/plugin_rows.h"
#include "plugins/interface_hash.h"

/// The header that every plug-in includes beside the interfaces of its kinds. A plug-in is a shared object of the same build as the
/// program (compiler's ABI, libraries in the interfaces, and every header of the interfaces), which a text in the file
/// states; the program reads that text before it loads the file, so that nothing of another build is ever run.

#define TERRACAST_TEXT_OF(x) #x
#define TERRACAST_TEXT(x) TERRACAST_TEXT_OF(x)

#if defined(__clang__)
#define TERRACAST_BUILD_COMPILER "clang " TERRACAST_TEXT(__clang_major__)
#else
#define TERRACAST_BUILD_COMPILER "gcc " TERRACAST_TEXT(__GNUC__)
#endif
#if defined(__SANITIZE_ADDRESS__)
#define TERRACAST_BUILD_SANITIZER "address"
#elif defined(__SANITIZE_THREAD__)
#define TERRACAST_BUILD_SANITIZER "thread"
#else
#define TERRACAST_BUILD_SANITIZER "none"
#endif
#if defined(_GLIBCXX_DEBUG)
#define TERRACAST_BUILD_CONTAINERS "checked"
#else
#define TERRACAST_BUILD_CONTAINERS "plain"
#endif
// Eigen's objects are aligned, and so laid out, by the instruction set that is compiled for.
#if EIGEN_MAX_ALIGN_BYTES >= 64
#define TERRACAST_BUILD_ALIGN "64"
#elif EIGEN_MAX_ALIGN_BYTES >= 32
#define TERRACAST_BUILD_ALIGN "32"
#else
#define TERRACAST_BUILD_ALIGN "16"
#endif

/// "field value; field value": what a plug-in and the program must agree in.
#define TERRACAST_BUILD \
  "terracast " TERRACAST_INTERFACE_VERSION "; interfaces " TERRACAST_INTERFACE_HASH              \
  "; compiler " TERRACAST_BUILD_COMPILER "; C++ ABI " TERRACAST_TEXT(__GXX_ABI_VERSION)          \
  "; libstdc++ " TERRACAST_TEXT(_GLIBCXX_RELEASE) "; new strings " TERRACAST_TEXT(               \
      _GLIBCXX_USE_CXX11_ABI) "; containers " TERRACAST_BUILD_CONTAINERS "; Eigen "              \
  TERRACAST_TEXT(EIGEN_WORLD_VERSION) "." TERRACAST_TEXT(EIGEN_MAJOR_VERSION) "." TERRACAST_TEXT( \
      EIGEN_MINOR_VERSION) "; alignment " TERRACAST_BUILD_ALIGN "; fmt " TERRACAST_TEXT(          \
      FMT_VERSION) "; sanitizer " TERRACAST_BUILD_SANITIZER

/// The mark before that text in a plug-in's file; a zero byte ends it.
#define TERRACAST_BUILD_MARK "terracast-plugin-build: "

namespace terracast::plugins {

/// The table that a plug-in's only symbol returns. Plain data; it lives as long as the program.
struct PluginTable {
  std::uint64_t num_bytes;  ///< of this struct
  const char* name;         ///< the part before the dot of all its kinds' names
  const char* version;
  const char* licence;
  const core::PluginRow* rows;
  std::uint64_t num_rows;
};

template <class... Infos>
std::array<core::PluginRow, sizeof...(Infos)> list_rows(const std::tuple<Infos...>& infos) {
  return std::apply(
      [](const Infos&... info) {
        return std::array<core::PluginRow, sizeof...(Infos)>{
            core::PluginRow{.type = &typeid(Infos), .info = &info}...};
      },
      infos);
}

}  // namespace terracast::plugins

/// Once in a plug-in: TERRACAST_PLUGIN("mine", "1.2", "MIT", mine::laser_sensor(), mine::fisheye_camera()). The rows are of
/// the types of the program's own tables: sensors::SensorInfo, geo::CameraModelInfo, tiler::LayerKindInfo,
/// exporters::ExporterInfo, scene::MediumInfo, validate::CheckInfo. Their names begin with "mine.".
#define TERRACAST_PLUGIN(plugin_name, plugin_version, plugin_licence, ...)                        \
  extern "C" {                                                                                    \
  [[gnu::used, gnu::retain]] static const char terracast_plugin_build[] =                         \
      TERRACAST_BUILD_MARK TERRACAST_BUILD;                                                       \
  [[gnu::visibility("default")]] const ::terracast::plugins::PluginTable* terracast_plugin_v1() { \
    static const auto infos = std::make_tuple(__VA_ARGS__);                                       \
    static const auto rows = ::terracast::plugins::list_rows(infos);                              \
    static const ::terracast::plugins::PluginTable table{                                         \
        .num_bytes = sizeof(::terracast::plugins::PluginTable),                                   \
        .name = plugin_name,                                                                      \
        .version = plugin_version,                                                                \
        .licence = plugin_licence,                                                                \
        .rows = rows.data(),                                                                      \
        .num_rows = rows.size()};                                                                 \
    return &table;                                                                                \
  }                                                                                               \
  }
