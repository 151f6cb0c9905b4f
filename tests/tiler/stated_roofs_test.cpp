#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"

// Roofs of a shape that the source states, where it cannot be built.
namespace terracast::test {
namespace {

constexpr const char* kCount = "roofs of a stated shape that does not fit, built with another";

/// A U open to the north, 30 m by 30 m with arms of 10 m: no place in it is seen from both arms' ends.
std::string horseshoe(double x, double y) {
  const Eigen::Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg) + Eigen::Vector2d(x, y);
  std::string text = "POLYGON((";
  for (const auto& [east, north] : {std::pair(0, 0),
                                    {30, 0},
                                    {30, 30},
                                    {20, 30},
                                    {20, 10},
                                    {10, 10},
                                    {10, 30},
                                    {0, 30},
                                    {0, 0}})
    text += fmt::format("{}{:.3f} {:.3f}", text.back() == '(' ? "" : ",", at.x() + east,
                        at.y() + north);
  return text + "))";
}

using Fields = std::vector<std::pair<std::string, std::string>>;

std::int64_t num_that_do_not_fit(const std::string& outline, const Fields& fields) {
  const ScratchFolder folder;
  write_vectors(folder / "a.gpkg", "GPKG", {{outline, fields}}, "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("buildings"), 1);
  return built.count(kCount);
}

TEST(StatedRoofs, ThatFitAreNotCounted) {
  for (const char* shape : {"flat", "gabled", "hipped", "half-hipped", "pyramidal", "skillion",
                            "gambrel", "mansard", "round", "dome"})
    EXPECT_EQ(num_that_do_not_fit(wkt(0, 0, 14, 8),
                                  {{"building", "house"}, {"height", "8"}, {"roof:shape", shape}}),
              0)
        << shape;
  EXPECT_EQ(num_that_do_not_fit(horseshoe(0, 0),
                                {{"building", "yes"}, {"height", "9"}, {"roof:shape", "hipped"}}),
            0);
}

TEST(StatedRoofs, ThatGiveWayAreCounted) {
  // A pyramid's tip has to see all eaves.
  EXPECT_EQ(
      num_that_do_not_fit(horseshoe(0, 0),
                          {{"building", "yes"}, {"height", "9"}, {"roof:shape", "pyramidal"}}),
      1);
  // A roof on posts is a slab.
  EXPECT_EQ(num_that_do_not_fit(wkt(0, 0, 14, 8),
                                {{"building", "roof"}, {"height", "5"}, {"roof:shape", "gabled"}}),
            1);
}

TEST(StatedRoofs, ThatNobodyStatesAreNotCounted) {
  EXPECT_EQ(num_that_do_not_fit(horseshoe(0, 0), {{"building", "house"}, {"height", "9"}}), 0);
}

}  // namespace
}  // namespace terracast::test
