#include <cmath>

#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_camera_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list);
  add(
      "HalfPixel", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.centre_px = {0.5, 0.5}});
      },
      says({"principal point off by (0.5, 0.5) px", "half a pixel"}, std::sqrt(0.5), 1e-6));
  add(
      "HalfPixelOfFlow", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 1, -0.5); },
            [&](std::size_t f) { return flow_between(d, f + 1, f, -0.5); });
      },
      says({"principal point off by (-0.50, -0.50) px", "flow"}, std::sqrt(0.5), 0.01));
  add(
      "FocalLength", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 1.01});
      },
      says({"focal length off by +1.000 %"}, 1.0, 1e-6));
  add(
      "CalibrationOfOtherSize", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.size_factor = 2.0});
      },
      says({"stale", "320 x 256 px"}, 2.0, 1e-6));
  add(
      "CalibrationBeforeChange", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 0.996, .centre_px = {1.3, -0.7}});
      },
      says({"stale", "focal length off by -0.400 %", "(1.30, -0.70) px"}, -0.4, 1e-6));
}

}  // namespace terracast::test
