#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "plugins/laws/laws.h"

namespace terracast::plugins {

/// The small job on which laws are tried: tiled, rendered and exported in some formats.
struct LawGround {
  std::filesystem::path folder;

  std::filesystem::path world() const;
  std::filesystem::path captures() const;
  std::vector<std::filesystem::path> datasets() const;
};

/// Makes it in an empty folder: some seconds of CPU.
LawGround make_law_ground(const std::filesystem::path& folder);

/// Calls `work` with the ground's world as a scene, and the motion of a body that turns and climbs over it.
void in_law_scene(const LawGround& ground, const std::function<void(const LawScene&)>& work);

}  // namespace terracast::plugins
