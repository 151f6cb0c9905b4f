#include <algorithm>
#include <bit>
#include <cmath>

#include "tests/validate/mutations/edits.h"

namespace terracast::test {

void add_depth_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list), add_in_one(list, true);
  add(
      "DepthIsRange", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d& ray) { return m * ray.norm(); });
      },
      says({"depth is range along the ray"}));
  struct Unit {
    const char* name;
    const char* words;
    double factor;
  };
  for (const Unit& unit : {Unit{"DepthInMillimetres", "depth is in millimetres", 1000.0},
                           Unit{"DepthInCentimetres", "depth is in centimetres", 100.0},
                           Unit{"DepthInKilometres", "depth is in kilometres", 1e-3},
                           Unit{"DepthInFeet", "depth is in feet", 1.0 / 0.3048}})
    add(
        unit.name, kAll,
        [unit](const RightDataset& d, const fs::path& folder) {
          edit_depths(d, folder, [&](double m, const Vector3d&) { return unit.factor * m; });
        },
        says({unit.words}, unit.factor, 1e-9));
  add(
      "DepthInverse", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder,
                    [](double m, const Vector3d&) { return std::isfinite(m) ? 1.0 / m : m; });
      },
      says({"depth is inverse depth (1/m)"}));
  for (const bool is_left_right : {true, false})
    add(
        is_left_right ? "DepthMirrored" : "DepthUpsideDown", kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          write_depths(d, folder, [&](std::size_t c, std::size_t f, int x, int y) {
            const auto& depth = d.recording.depth[c][f];
            return is_left_right ? depth(depth.width() - 1 - x, y)
                                 : depth(x, depth.height() - 1 - y);
          });
        },
        says({is_left_right ? "depth is mirrored left to right" : "depth stands upside down"}));
  add(
      "DepthClipped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) {
          return std::isfinite(m) ? std::min(m, 120.0) : m;
        });
      },
      says({"depth is clipped at 120 m"}, 120.0, 1e-6));
  add(
      "DepthOf8Bits", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) {
          return std::round(m / 256.0 * 255.0) / 255.0 * 256.0;
        });
      },
      says({"depth is quantised to 8 bits"}, 256.0 / 255.0, 1e-3));
  add(
      "DepthInSteps", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return std::round(4.0 * m) / 4.0; });
      },
      says({"depth is quantised: ", "in steps of 0.25 m"}, 0.25, 1e-6));
  for (const bool is_fine : {false, true})
    add_in_one(
        is_fine ? "DepthInMillimetreSteps" : "DepthInCentimetreSteps", kAll,
        [is_fine](const RightDataset& d, const fs::path& folder) {
          const double steps_per_m = is_fine ? 1000.0 : 100.0;
          edit_depths(d, folder, [&](double m, const Vector3d&) {
            return std::round(steps_per_m * m) / steps_per_m;
          });
        },
        says({"depth is quantised: ", is_fine ? "steps of 0.001 m" : "steps of 0.01 m"},
             is_fine ? 1e-3 : 1e-2, 1e-9));
  add_in_one(
      "DepthOfFloat16", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) {
          if (!std::isfinite(m)) return m;
          int exponent = 0;
          const double mantissa = std::frexp(m, &exponent);
          return std::ldexp(std::nearbyint(std::ldexp(mantissa, 11)), exponent - 11);
        });
      },
      says({"depth is rounded to 16-bit floats"}, 11.0, 0.0));
  add(
      "DepthOffset", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return m + 0.8; });
      },
      says({"depth is 0.", "m too large everywhere"}, 0.8, 0.02));
  add(
      "DepthScaled", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return 1.005 * m; });
      },
      says({"depth is +0."}, 0.5, 0.01));
  add(
      "SkyIsDepth", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder,
                    [](double m, const Vector3d&) { return std::isfinite(m) ? m : 1000.0; });
      },
      says({"sky is written as a depth of 1000 m"}, 1000.0, 1e-6));
  add(
      "ByteOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
            if (depth_file(d, c, f).empty()) continue;
            const SceneCamera& camera = d.recording.cameras[c];
            std::vector<float> values;
            for (int y = 0; y < camera.height; ++y)
              for (int x = 0; x < camera.width; ++x) {
                const double m = d.recording.depth[c][f](x, y);
                const float value = std::isfinite(m) ? static_cast<float>(m) : sky_of(d);
                const auto bits = std::bit_cast<std::uint32_t>(value);
                // Of TartanAir's PNG the first and third byte change places.
                values.push_back(std::bit_cast<float>(
                    d.format == "tartanair"
                        ? (bits & 0xff00ff00U) | (bits & 0xffU) << 16 | (bits >> 16 & 0xffU)
                        : __builtin_bswap32(bits)));
              }
            write_depth(d, folder, c, f, values);
          }
      },
      [](const RightDataset& d) {
        return Expected{
            {"byte order", d.format == "tartanair" ? "R G B A" : "big-endian"}, std::nullopt, 0.0};
      });
  add(
      "DepthShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 1; f < d.recording.body_world.size(); ++f)
            if (!depth_file(d, c, f).empty())
              copy_over(d.folder / depth_file(d, c, f - 1), folder / depth_file(d, c, f));
      },
      says({"depths are shifted by 1 frame", "frame before"}, -1.0, 0.0));
  add(
      "DepthShiftedBack", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 0; f + 1 < d.recording.body_world.size(); ++f)
            if (!depth_file(d, c, f).empty())
              copy_over(d.folder / depth_file(d, c, f + 1), folder / depth_file(d, c, f));
      },
      says({"depths are shifted by 1 frame", "frame after"}, 1.0, 0.0));
  for (const bool is_first : {false, true})
    add(
        is_first ? "FirstDepthOfOtherSequence" : "DepthOfOtherSequence", kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          // As with colours: after half a turn it looks like none of these.
          write_depths(d, folder, [&](std::size_t c, std::size_t f, int x, int y) {
            const auto& depth = d.recording.depth[c][f];
            return c == 0 && f == (is_first ? 0 : 1)
                       ? depth(depth.width() - 1 - x, depth.height() - 1 - y)
                       : depth(x, y);
          });
        },
        says({"depth of",
              is_first ? "frame 0 does not belong there" : "frame 1 does not belong there"}));
  for (const bool is_first : {false, true})
    add(
        is_first ? "FirstDepthInKilometres" : "DepthInCentimetresInOneFrame", kAll,
        [=](const RightDataset& d, const fs::path& folder) {
          write_depths(d, folder, [&](std::size_t c, std::size_t f, int x, int y) {
            return d.recording.depth[c][f](x, y) * (c > 0 || f != (is_first ? 0 : 1) ? 1.0
                                                    : is_first                       ? 1e-3
                                                                                     : 100.0);
          });
        },
        says({"depth of", is_first ? "frame 0" : "frame 1"}));
  add(
      "DepthTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        copy_over(d.folder / depth_file(d, 0, 1), folder / depth_file(d, 0, 2));
      },
      says({"depth of", "frame 2 is duplicated", "that of frame 1"}));
}

void add_far_depth_mutations(std::vector<Mutation>& list) {
  const Catalogue add(list, true);
  add(
      "DepthOfOneCameraScaled", kPosed,
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.cameras.size() - 1;
        write_depths(d, folder, [&](std::size_t c, std::size_t f, int x, int y) {
          return (c == last ? 1.15 : 1.0) * static_cast<double>(d.recording.depth[c][f](x, y));
        });
      },
      says({"depth is +15.", "% off against the poses"}, 15.0, 0.01));
}

}  // namespace terracast::test
