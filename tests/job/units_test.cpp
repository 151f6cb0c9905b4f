#include <gtest/gtest.h>

#include <set>
#include <string>

#include "core/schema_writer.h"
#include "export/exporter.h"
#include "geo/fixes/fix_format.h"
#include "geo/trajectory.h"
#include "job/run_config.h"
#include "tiler/layer.h"

namespace terracast::job {
namespace {

/// Numbers that are counts, ratios or names of something, by the last word of their key's path.
const std::set<std::string> kPure = {"aircraft",
                                     "albedo",
                                     "ambient_rays",
                                     "amount",
                                     "anisotropy",
                                     "aridity_index",
                                     "bands",
                                     "bits",
                                     "black",
                                     "bloom",
                                     "boats",
                                     "coefficient",
                                     "color_samples",
                                     "containers",
                                     "cover",
                                     "dead_share",
                                     "depth_factor",
                                     "detail_roughness",
                                     "dirt_opacity",
                                     "dirt_size",
                                     "dirt_spots",
                                     "exposure",
                                     "field_share",
                                     "forest_share",
                                     "frames_apart",
                                     "full",
                                     "gain",
                                     "gains",
                                     "gamma",
                                     "hot_share",
                                     "instance",
                                     "lakes",
                                     "laps",
                                     "max_relative_depth_error",
                                     "meter_percentile",
                                     "min_disparity_share",
                                     "min_pixels",
                                     "most",
                                     "moving_share",
                                     "num_frames",
                                     "num_legs",
                                     "num_lines",
                                     "num_points",
                                     "num_rotors",
                                     "oracle_samples",
                                     "oswald",
                                     "overlap",
                                     "parasitic",
                                     "parked_cars",
                                     "part",
                                     "percentile",
                                     "pixel_aspect",
                                     "quaternion_wxyz",
                                     "reach_frames",
                                     "roundness",
                                     "samples_per_image",
                                     "saturation",
                                     "saturation_exposure",
                                     "scale",
                                     "seed",
                                     "sidelap",
                                     "slope",
                                     "smudge_haze",
                                     "smudge_size",
                                     "smudges",
                                     "speed",
                                     "stall_sharpness",
                                     "straighten_cells",
                                     "target",
                                     "traffic",
                                     "variant",
                                     "veiling_glare",
                                     "vignetting_exponent",
                                     "vignetting_polynomial",
                                     "white",
                                     "zero"};

void expect_units(const std::vector<core::KeyInfo>& keys, int& num_with_unit) {
  for (const core::KeyInfo& key : keys) {
    const bool is_number = key.type.find("number") != std::string::npos ||
                           key.type.find("integer") != std::string::npos;
    if (!is_number) continue;
    num_with_unit += key.unit.empty() ? 0 : 1;
    const std::string name = key.name.substr(key.name.rfind('.') + 1);
    EXPECT_EQ(key.unit.empty(), kPure.contains(name))
        << key.name << (key.unit.empty() ? " has no unit" : " has unit " + key.unit);
  }
}

TEST(Units, EveryNumberOfAConfigHasOneOrNeedsNone) {
  // speed_mps once stood in the manual without its m/s.
  int num_with_unit = 0;
  expect_units(core::list_keys<RunConfig>(), num_with_unit);
  const auto expect_units_of = [&](auto& options) {
    std::vector<core::KeyInfo> keys;
    options.describe(*core::make_key_lister(keys));
    expect_units(keys, num_with_unit);
  };
  for (const auto& kind : tiler::layer_kinds()) expect_units_of(*kind.make());
  for (const auto& kind : geo::trajectory_kinds()) expect_units_of(*kind.make());
  for (const auto& format : geo::fix_formats()) expect_units_of(*format.make());
  for (const auto& kind : labels::labels()) expect_units_of(*kind.make());
  for (const auto& format : exporters::exporters()) expect_units_of(*format.make());
  EXPECT_GT(num_with_unit, 50);
}

}  // namespace
}  // namespace terracast::job
