#pragma once

#include <algorithm>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "core/hash.h"
#include "tests/support/hills_flight.h"

namespace terracast::test {

/// Hashes of the facts and the colour of some cameras at frame 1, and of the tiles to which their rays
/// come, a line each.
inline std::string frame_hashes(const TracedPlan& scene, std::initializer_list<int> cameras) {
  std::string lines;
  const auto add = [&](const char* name, const auto& values) {
    lines += fmt::format("{} {}\n", name, core::content_hash(std::as_bytes(std::span(values))));
  };
  for (const int camera : cameras) {
    world::RayTrail trail(scene.query.cut().size());
    sensors::TruthFrame truth;
    scene.renderer.truth(1, camera, truth, &trail);
    add("range", truth.range_m);
    add("points", truth.point_world);
    add("normals", truth.facts.normal_world.data());
    add("classes", truth.facts.semantic_id.data());
    add("triangles", truth.facts.primitive_id.data());
    add("flags", truth.facts.flags.data());
    const core::Image8 color = scene.renderer.color(1, camera, &trail);
    add("color", color.data());
    std::vector<double> passed_z_world;
    for (std::size_t tile = 0; tile < trail.num_tiles(); ++tile)
      passed_z_world.push_back(trail.is_touched(tile) ? 0.0 : trail.passed_z_world(tile));
    add("tiles", passed_z_world);
  }
  return lines;
}

/// Of everything that packet code has a part in: two cameras over hills.
inline std::string frame_hashes(const std::filesystem::path& folder) {
  return frame_hashes(TracedPlan(make_hills(folder / "world"), small_plan(3, 120, 90)), {0, 2});
}

}  // namespace terracast::test
