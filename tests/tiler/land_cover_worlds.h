#pragma once

#include <Eigen/Core>
#include <string>

#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tiler/layer_stack.h"

/// Layers of land cover, and what they make of a place.
namespace terracast::test {

inline tiler::LayerOptions land_cover_layer(const std::string& toml) {
  tiler::LayerOptions layer;
  core::TomlDocument::parse("kind = \"land_cover\"\n" + toml, "layer.toml").read(layer);
  return layer;
}

inline world::Cover cover_at(const tiler::WorldSurface& surface,
                             const Eigen::Vector2d& place_world) {
  return surface.sample(place_world.x(), place_world.y()).cover;
}

}  // namespace terracast::test
