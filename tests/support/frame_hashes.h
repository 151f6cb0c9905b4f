#pragma once

#include <algorithm>
#include <span>
#include <string>

#include "core/hash.h"
#include "tests/render/scene.h"

namespace terracast::test {

/// Hashes of everything that packet code has a part in: rays, facts and colour of two cameras over
/// hills, a line each.
inline std::string frame_hashes(const std::filesystem::path& folder) {
  const Scene scene(make_hills(folder / "world"), small_plan(3, 120, 90));
  std::string lines;
  const auto add = [&](const char* name, const auto& values) {
    lines += fmt::format("{} {}\n", name, core::content_hash(std::as_bytes(std::span(values))));
  };
  for (const int camera : {0, 2}) {
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

}  // namespace terracast::test
