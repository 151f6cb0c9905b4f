#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "batch/dataset/histogram.h"
#include "batch/dataset/plot_style.h"
#include "batch/dataset/sequence_map.h"
#include "core/random.h"

namespace terracast::batch {
namespace {

using testing::ElementsAre;

bool is_colour(const core::Image8& image, int x, int y, const tiler::Colour& colour) {
  return image(x, y, 0) == colour[0] && image(x, y, 1) == colour[1] && image(x, y, 2) == colour[2];
}

/// Bounds of the pixels of a colour.
struct Area {
  int left = 1 << 30, top = 1 << 30, right = -1, bottom = -1;
  std::int64_t count = 0;
  Eigen::Vector2d middle() const { return {0.5 * (left + right), 0.5 * (top + bottom)}; }
};
Area area_of(const core::Image8& image, const tiler::Colour& colour, int from_y = 0) {
  Area area;
  for (int y = from_y; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      if (is_colour(image, x, y, colour)) {
        area.left = std::min(area.left, x);
        area.right = std::max(area.right, x);
        area.top = std::min(area.top, y);
        area.bottom = std::max(area.bottom, y);
        ++area.count;
      }
  return area;
}

constexpr int kLegend_px = 44;

/// A track that stays where it is: a disc on the map.
MapTrack place(Split split, double lat_deg, double lon_deg, const std::string& world = "here") {
  return {.world = world, .split = split, .places = {{lat_deg, lon_deg, 0.0}}};
}

TEST(SequenceMap, IsTrueToAnglesAndLengths) {
  // 10 km to the east, and as much to the north, at 60 degrees.
  const double north_deg = 10000.0 / 111412.0;
  const double east_deg = 10000.0 / 55800.0;
  const core::Image8 map = draw_sequence_map(
      {place(Split::Train, 60.0, 179.95), place(Split::Val, 60.0, 179.95 + east_deg - 360.0),
       place(Split::Test, 60.0 + north_deg, 179.95)},
      1000.0);
  const Eigen::Vector2d origin = area_of(map, plot::colour_of(Split::Train), kLegend_px).middle();
  const Eigen::Vector2d east = area_of(map, plot::colour_of(Split::Val), kLegend_px).middle();
  const Eigen::Vector2d north = area_of(map, plot::colour_of(Split::Test), kLegend_px).middle();
  EXPECT_NEAR(east.y(), origin.y(), 1.0);
  EXPECT_NEAR(north.x(), origin.x(), 1.0);
  const double east_px = east.x() - origin.x();
  const double north_px = origin.y() - north.y();
  EXPECT_GT(north_px, 300.0);
  EXPECT_NEAR(east_px / north_px, 1.0, 0.01);  // a pixel of either, and a sphere for the ellipsoid
  // The bar of the margin is a tenth as long.
  const Area margin = area_of(map, plot::kMargin);
  EXPECT_NEAR(margin.right - margin.left + 1, 0.1 * north_px, 1.5);
}

TEST(SequenceMap, ShowsGroundAsATintBelowTheTracks) {
  GroundSeen ground;
  const GroundCell middle = ground_cell_at(45.0, 7.0);
  for (int k = -10; k < 10; ++k)
    ground.runs.push_back({middle.band + k, column_at(middle.band + k, 7.0) - 10, 20});
  MapTrack track = place(Split::Val, 45.0, 7.0);
  track.ground = &ground;
  const core::Image8 map = draw_sequence_map({track}, 1000.0);
  const Area tint = area_of(map, plot::tint_of(Split::Val));
  const Area disc = area_of(map, plot::colour_of(Split::Val), kLegend_px);
  // 2 km by 2 km, with the track at its middle, to a cell: columns of bands are shifted by parts of one.
  const double cell_px = (tint.bottom - tint.top + 1) / 20.0;
  EXPECT_NEAR(tint.right - tint.left, tint.bottom - tint.top, cell_px);
  EXPECT_NEAR(disc.middle().x(), tint.middle().x(), cell_px);
  EXPECT_NEAR(disc.middle().y(), tint.middle().y(), cell_px);
}

TEST(SequenceMap, HasAPanelForEachWorld) {
  const core::Image8 one = draw_sequence_map({place(Split::Train, 45.0, 7.0)}, 1000.0);
  std::vector<MapTrack> tracks;
  for (int i = 0; i < 30; ++i)
    tracks.push_back(place(Split::Test, 45.0, 7.0, "world " + std::to_string(i)));
  const core::Image8 many = draw_sequence_map(tracks, 1000.0);
  // Discs of 12 panels: the most that are shown.
  const double disc = static_cast<double>(
      area_of(draw_sequence_map({tracks[0]}, 1000.0), plot::colour_of(Split::Test), kLegend_px)
          .count);
  EXPECT_NEAR(
      static_cast<double>(area_of(many, plot::colour_of(Split::Test), kLegend_px).count) / disc,
      12.0, 0.01);
  EXPECT_GT(many.width(), one.width());
}

TEST(SequenceMap, CanBeDrawnOfNothing) {
  EXPECT_GT(draw_sequence_map({}, 1000.0).width(), 0);
  EXPECT_GT(draw_sequence_map({MapTrack{}}, 1000.0).width(), 0);
}

TEST(HistogramTest, CountsWhatLiesBetweenItsEdges) {
  Histogram linear(
      {.title = "height", .unit = "m", .least = 0.0, .greatest = 100.0, .num_bins = 10});
  Histogram logarithmic({.title = "depth",
                         .unit = "m",
                         .least = 1.0,
                         .greatest = 1000.0,
                         .num_bins = 6,
                         .is_logarithmic = true});
  std::array<double, 10> of_linear{};
  std::array<double, 6> of_logarithmic{};
  double outside = 0.0;
  for (std::uint64_t i = 0; i < 5000; ++i) {
    const double value = core::random_between(-10.0, 120.0, 1, 1, i);
    linear.add(value, Split::Val, 2.0);
    if (value < 0.0 || value > 100.0)
      outside += 2.0;
    else
      of_linear[static_cast<std::size_t>(value / 10.0)] += 2.0;
    const double depth = std::exp(core::random_between(0.0, std::log(1000.0), 2, 1, i));
    logarithmic.add(depth, Split::Train);
    const double edges[] = {3.1622776601683795, 10.0, 31.622776601683793, 100.0,
                            316.22776601683796};
    std::size_t bin = 0;
    while (bin < 5 && depth >= edges[bin]) ++bin;
    of_logarithmic[bin] += 1.0;
  }
  for (int bin = 0; bin < 10; ++bin)
    EXPECT_EQ(linear.weight(bin, Split::Val), of_linear[static_cast<std::size_t>(bin)]);
  EXPECT_EQ(linear.weight_outside(Split::Val), outside);
  EXPECT_EQ(linear.weight_outside(Split::Train), 0.0);
  for (int bin = 0; bin < 6; ++bin)
    EXPECT_EQ(logarithmic.weight(bin, Split::Train), of_logarithmic[static_cast<std::size_t>(bin)]);
  EXPECT_EQ(linear.edge(3), 30.0);
  EXPECT_NEAR(logarithmic.edge(2), 10.0, 1e-12);
  linear.add(100.0, Split::Test);  // the last edge is of the last bin
  EXPECT_EQ(linear.weight(9, Split::Test), 1.0);
  linear.add(std::nan(""), Split::Test);
  logarithmic.add(-1.0, Split::Test);
  EXPECT_EQ(linear.weight_outside(Split::Test), 1.0);
  EXPECT_EQ(logarithmic.weight_outside(Split::Test), 1.0);
}

TEST(HistogramTest, IsKeptAsJson) {
  Histogram histogram(
      {.title = "height", .unit = "m", .least = 0.0, .greatest = 2.0, .num_bins = 2});
  histogram.add(0.5, Split::Train);
  histogram.add(1.5, Split::Test, 3.0);
  histogram.add(5.0, Split::Test);
  EXPECT_EQ(histogram.json().text(-1),
            R"({"title":"height","unit":"m","logarithmic":false,"edges":[0.0,1.0,2.0],)"
            R"("train":[1.0,0.0],"val":[0.0,0.0],"test":[0.0,3.0],)"
            R"("outside":{"train":0.0,"val":0.0,"test":1.0}})");
}

TEST(HistogramTest, BarsAreAsHighAsTheirShares) {
  Histogram histogram(
      {.title = "height", .unit = "m", .least = 0.0, .greatest = 4.0, .num_bins = 4});
  histogram.add(0.5, Split::Train, 400.0);
  histogram.add(1.5, Split::Val, 200.0);
  histogram.add(2.5, Split::Test, 100.0);
  const core::Image8 image = histogram.draw();
  // Below the legend.
  const double train =
      static_cast<double>(area_of(image, plot::colour_of(Split::Train), kLegend_px).count);
  const double val =
      static_cast<double>(area_of(image, plot::colour_of(Split::Val), kLegend_px).count);
  const double test =
      static_cast<double>(area_of(image, plot::colour_of(Split::Test), kLegend_px).count);
  EXPECT_GT(test, 5000.0);
  // Half a row of pixels each, of more than 60.
  EXPECT_NEAR(train / val, 2.0, 0.03);
  EXPECT_NEAR(val / test, 2.0, 0.03);
}

TEST(HistogramTest, CanBeDrawnOfNothing) {
  const Histogram histogram({.title = "height", .unit = "m"});
  EXPECT_GT(histogram.draw().width(), 0);
}

}  // namespace
}  // namespace terracast::batch
