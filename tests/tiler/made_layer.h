#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/log.h"
#include "tiler/instance_ids.h"
#include "tiler/layer_stack.h"
#include "tiler/surface.h"

namespace terracast::test {

/// A layer of a world whose ground is prepared, without a country from a seed.
/// earlier   the layers before it, which live as long
inline std::unique_ptr<tiler::Layer> made_layer(
    const tiler::LayerOptions& options, const tiler::WorldSurface& surface, std::uint64_t seed,
    std::span<const std::unique_ptr<tiler::Layer>> earlier = {},
    core::LogLevel level = core::LogLevel::Off) {
  const core::Log log("tile", level);
  tiler::InstanceIds ids;
  return options.kind_options().make(
      {.frame = surface.frame(),
       .size_m = surface.options().size_m,
       .seed = seed,
       .surface = surface,
       .earlier = earlier,
       .ids = ids,
       .country = {},
       .licence = {},
       .accuracy = {},
       .context = {.log = log, .num_threads = 0, .events_file = {}}});
}

}  // namespace terracast::test
