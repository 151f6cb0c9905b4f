#pragma once

#include <algorithm>
#include <initializer_list>
#include <span>
#include <string>

#include "core/hash.h"
#include "tests/render/scene.h"

namespace terracast::test {

/// Hashes of the facts and the colour of some cameras at frame 1, a line each.
inline std::string frame_hashes(const Scene& scene, std::initializer_list<int> cameras) {
  std::string lines;
  const auto add = [&](const char* name, const auto& values) {
    lines += fmt::format("{} {}\n", name, core::content_hash(std::as_bytes(std::span(values))));
  };
  for (const int camera : cameras) {
    const render::TruthFrame truth = scene.renderer.truth(1, camera);
    add("range", truth.range_m);
    add("points", truth.point_world);
    add("normals", truth.facts.normal_world.data());
    add("classes", truth.facts.semantic_id.data());
    add("triangles", truth.facts.primitive_id.data());
    add("flags", truth.facts.flags.data());
    add("color", scene.renderer.color(1, camera).data());
  }
  return lines;
}

/// Of everything that packet code has a part in: two cameras over hills.
inline std::string frame_hashes(const std::filesystem::path& folder) {
  return frame_hashes(Scene(make_hills(folder / "world"), small_plan(3, 120, 90)), {0, 2});
}

}  // namespace terracast::test
