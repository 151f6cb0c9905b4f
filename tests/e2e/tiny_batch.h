#pragma once

#include <string>

#include "tests/e2e/tiny_job.h"

namespace terracast::test {

/// Two runs of the tiny job over coarse ground: two worlds, exposures that are drawn; in COLMAP and
/// KITTI.
inline std::string tiny_batch_text() {
  return replaced(tiny_job_text(), "finest_spacing_m = 4.0", "finest_spacing_m = 16.0") + R"(
[[exports]]
format = "kitti"
rig = "pair"
left = "left"
right = "right"

[[sweep.list]]
keys = ["world.origin_lat_deg", "world.name"]
rows = [[46.0, "a"], [47.0, "b"]]

[[sweep.draw]]
key = "conditions.exposure"
between = [0.5, 2.0]
)";
}

}  // namespace terracast::test
