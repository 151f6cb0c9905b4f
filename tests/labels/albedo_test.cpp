#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "tests/labels/boxes_world.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

const std::vector<WorldBox> kBoxes = {
    {.instance_id = 11, .low = {100, -30, 0}, .high = {110, -5, 60}, .color_srgb = {230, 30, 90}},
    {.instance_id = 12, .low = {100, 0, 0}, .high = {110, 20, 60}, .color_srgb = {40, 200, 25}},
    {.instance_id = 13, .low = {150, -60, 0}, .high = {160, 60, 80}, .color_srgb = {128, 128, 128}},
};

/// The transfer function of sRGB, IEC 61966-2-1.
double linear(std::uint8_t level) {
  const double share = level / 255.0;
  return share <= 0.04045 ? share / 12.92 : std::pow((share + 0.055) / 1.055, 2.4);
}

struct Albedo {
  fs::path file;
  core::ExrImage image;
};

Albedo albedo_by_sun(const fs::path& folder, const world::TileStore& store, double elevation_deg,
                     double azimuth_deg, int num_threads) {
  render::SequencePlan plan = level_plan();
  plan.conditions.sun_elevation_deg = elevation_deg;
  plan.conditions.sun_azimuth_deg = azimuth_deg;
  const auto sequence = render_plan(store, plan, folder);
  make_labels(sequence, store, "albedo", num_threads);
  const fs::path file = folder / "labels/albedo/mcs4/cam0/000000.exr";
  return {file, core::decode_exr(core::read_file(file), file.string()).at(0)};
}

TEST(Albedo, IsTheColourOfSurfacesWhateverTheLight) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const Albedo noon = albedo_by_sun(folder / "noon" / "boxes", store, 60.0, 180.0, 1);
  const Albedo evening = albedo_by_sun(folder / "evening" / "boxes", store, 3.0, 280.0, 2);
  const auto facts = capture::SequenceReader::open(folder / "noon" / "boxes")
                         .read_camera(0, 0, capture::SequenceReader::kFacts);
  std::map<std::uint32_t, int> num_of;
  int num_sky = 0;
  for (int y = 0; y < 160; ++y)
    for (int x = 0; x < 200; ++x) {
      const std::uint32_t instance = facts.instance_id(x, y);
      for (int c = 0; c < 3; ++c) {
        const std::string channel = fmt::format("albedo.{}", "RGB"[c]);
        const float value = noon.image.float_channels.at(channel)(x, y);
        const float later = evening.image.float_channels.at(channel)(x, y);
        if (std::isinf(facts.range_m(x, y))) {
          ++num_sky;
          ASSERT_TRUE(std::isnan(value) && std::isnan(later));
          continue;
        }
        ASSERT_EQ(value, later) << x << " " << y;
        ++num_of[instance];
        if (instance == 0) {
          // Land: darker than snow, brighter than nothing.
          ASSERT_GT(value, 0.0f);
          ASSERT_LT(value, 0.9f);
          continue;
        }
        // A float's steps.
        ASSERT_NEAR(double{value},
                    linear(kBoxes[instance - 11].color_srgb[static_cast<std::size_t>(c)]), 1e-6);
      }
    }
  EXPECT_GT(num_sky, 1000);
  for (const std::uint32_t instance : {0U, 11U, 12U, 13U}) EXPECT_GT(num_of[instance], 300);
}

TEST(Albedo, IsMadeOnceAndAgainWhereItIsDamaged) {
  const ScratchFolder folder;
  const auto store = make_boxes_world(folder / "world", kBoxes);
  const Albedo first = albedo_by_sun(folder / "boxes", store, 40.0, 180.0, 2);
  const auto time = fs::last_write_time(first.file);
  const std::string whole = core::content_hash_of_file(first.file);
  const auto sequence = capture::SequenceReader::open(folder / "boxes");
  make_labels(sequence, store, "albedo", 1);
  EXPECT_EQ(fs::last_write_time(first.file), time);
  fs::resize_file(first.file, 3000);
  make_labels(sequence, store, "albedo", 1);
  EXPECT_EQ(core::content_hash_of_file(first.file), whole);
}

}  // namespace
}  // namespace terracast::test
