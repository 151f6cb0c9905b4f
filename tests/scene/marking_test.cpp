#include "scene/ground/marking.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "scene/ground/pattern.h"

namespace terracast::scene {
namespace {

using world::Marking;

world::PaintSample strip(Marking marking, double half_width_m, double whole_m, int num_lanes = 1) {
  world::PaintSample paint;
  paint.is_painted = true;
  paint.marking = marking;
  paint.num_lanes = static_cast<std::uint8_t>(num_lanes);
  paint.half_width_m = half_width_m;
  paint.whole_m = whole_m;
  return paint;
}

bool is_marked_at(world::PaintSample paint, double across_m, double along_m) {
  paint.across_m = across_m;
  paint.along_m = along_m;
  return is_marked(paint);
}

/// Share of marked places of a rectangle, by a grid of places at the middles of its cells.
double counted_share(const world::PaintSample& paint, double across_m, double along_m,
                     double width_m, int cells) {
  int marked = 0;
  for (int j = 0; j < cells; ++j)
    for (int i = 0; i < cells; ++i)
      marked += is_marked_at(paint, across_m + width_m * ((i + 0.5) / cells - 0.5),
                             along_m + width_m * ((j + 0.5) / cells - 0.5))
                    ? 1
                    : 0;
  return static_cast<double>(marked) / (cells * cells);
}

// A line of 0.12 m, 4 m of 12 painted.
TEST(Marking, ABrokenLineIsMarkedExactlyOnItsDashes) {
  world::PaintSample paint = strip(Marking::Center, 3.0, 100.0);
  paint.unmarked_start_m = 10.0;
  paint.unmarked_end_m = 5.0;
  for (const double side : {-1.0, 1.0}) {
    EXPECT_TRUE(is_marked_at(paint, side * 0.0599999, 12.0));
    EXPECT_FALSE(is_marked_at(paint, side * 0.0600001, 12.0));
  }
  EXPECT_FALSE(is_marked_at(paint, 0.0, 9.9999999));
  EXPECT_TRUE(is_marked_at(paint, 0.0, 10.0000001));
  EXPECT_TRUE(is_marked_at(paint, 0.0, 13.9999999));
  EXPECT_FALSE(is_marked_at(paint, 0.0, 14.0000001));
  EXPECT_FALSE(is_marked_at(paint, 0.0, 21.9999999));
  EXPECT_TRUE(is_marked_at(paint, 0.0, 22.0000001));
  EXPECT_TRUE(is_marked_at(paint, 0.0, 94.9999999));
  EXPECT_FALSE(is_marked_at(paint, 0.0, 95.0000001));
}

TEST(Marking, ClassesAreExactOnBothSidesOfALine) {
  world::PaintSample paint = strip(Marking::CenterSolid, 3.0, 100.0);
  paint.coating.semantic_class = core::SemanticClass::Road;
  paint.along_m = 50.0;
  for (const double side : {-1.0, 1.0}) {
    paint.across_m = side * std::nextafter(0.06, 0.0);
    EXPECT_EQ(class_of(paint), core::SemanticClass::RoadMarking);
    paint.across_m = side * std::nextafter(0.06, 1.0);
    EXPECT_EQ(class_of(paint), core::SemanticClass::Road);
  }
  // Rails are part of the railway, and what has no marks has none.
  world::PaintSample rails = strip(Marking::Rails, 2.0, 100.0);
  rails.coating.semantic_class = core::SemanticClass::Railway;
  rails.across_m = 0.7535;
  EXPECT_EQ(class_of(rails), core::SemanticClass::Railway);
}

// Share of a long piece in closed form.
TEST(Marking, SharesOfWholeStripsAreTheAreasOfTheirMarks) {
  const struct {
    Marking marking;
    double half_width_m;
    int num_lanes;
    double period_m;
    double marked_area_m2;  // of a period's length
  } cases[] = {
      {Marking::Center, 3.0, 2, 12.0, 0.12 * 4.0},
      {Marking::CenterSolid, 3.0, 2, 12.0, 0.12 * 12.0},
      {Marking::Lanes, 7.0, 4, 12.0, 2.0 * 0.12 * 12.0 + 3.0 * 0.12 * 4.0},
      {Marking::Motorway, 5.5, 2, 18.0, (0.15 + 0.30) * 18.0 + 0.15 * 6.0},
      {Marking::Taxiway, 9.0, 1, 10.0, 0.15 * 10.0},
      {Marking::Crossing, 2.0, 1, 10.0, 4.0 * 5.0},
      {Marking::Stands, 2.5, 1, 10.0, 4.0 * 0.12 * 5.0},
      {Marking::Stands, 8.0, 1, 10.0, 4.0 * 2.0 * 0.12 * 5.0},
  };
  for (const auto& c : cases) {
    world::PaintSample paint = strip(c.marking, c.half_width_m, 1e4, c.num_lanes);
    const double width_m = 36.0 * 50.0;  // whole periods, and all of the strip's width
    paint.along_m = 5000.3;
    const double share = marks_within(paint, width_m).share();
    EXPECT_NEAR(share * width_m * width_m, c.marked_area_m2 * width_m / c.period_m,
                1e-9 * width_m * width_m)
        << static_cast<int>(c.marking);
  }
}

TEST(Marking, SharesOfSquaresAreThoseOfTheirMarkedPlaces) {
  world::PaintSample paints[] = {
      strip(Marking::Center, 3.0, 200.0),      strip(Marking::Lanes, 7.0, 200.0, 3),
      strip(Marking::Motorway, 6.0, 200.0, 2), strip(Marking::Crossing, 2.0, 200.0),
      strip(Marking::Stands, 9.0, 200.0),
  };
  std::uint64_t index = 0;
  double marked = 0.0;
  for (world::PaintSample& paint : paints) {
    for (int k = 0; k < 12; ++k, ++index) {
      paint.across_m = core::random_between(-paint.half_width_m, paint.half_width_m, 1, 0, index);
      paint.along_m = core::random_between(20.0, 180.0, 1, 1, index);
      const double width_m = core::random_between(0.2, 6.0, 1, 2, index);
      const double share = marks_within(paint, width_m).share();
      // Each border of a mark errs by half a cell of 1 / 300; a square holds at most 14.
      EXPECT_NEAR(share, counted_share(paint, paint.across_m, paint.along_m, width_m, 300), 0.025);
      marked += share;
    }
  }
  EXPECT_GT(marked, 3.0);
}

// ICAO Annex 14, 5.2.4: stripes of 30 m at 6 m from the threshold; as many as the width asks for, to
// 3 m from the edges or 27 m from the middle, so that stripes and gaps are up to 1.8 m wide.
TEST(RunwayMarking, ThresholdsHaveTheStripesThatTheirWidthAsksFor) {
  const struct {
    double width_m;
    int num_stripes;
    double stripe_m;
  } cases[] = {{18.0, 4, 6.0 / 4},
               {23.0, 6, 8.5 / 6},
               {30.0, 8, 12.0 / 8},
               {45.0, 12, 19.5 / 12},
               {60.0, 16, 27.0 / 16}};
  for (const auto& c : cases) {
    const world::PaintSample paint = strip(Marking::Runway, 0.5 * c.width_m, 3000.0, 8);
    for (const double along_m : {20.0, 2980.0}) {
      int num_stripes = 0;
      double painted_m = 0.0;
      bool was_marked = false;
      const double step_m = 0.001;
      for (double across_m = -0.5 * c.width_m + 1.0; across_m < 0.5 * c.width_m - 1.0;
           across_m += step_m) {
        const bool is = is_marked_at(paint, across_m, along_m);
        num_stripes += is && !was_marked ? 1 : 0;
        painted_m += is ? step_m : 0.0;
        was_marked = is;
      }
      EXPECT_EQ(num_stripes, c.num_stripes) << c.width_m;
      EXPECT_NEAR(painted_m, c.num_stripes * c.stripe_m, c.num_stripes * step_m) << c.width_m;
    }
    EXPECT_FALSE(is_marked_at(paint, 1.5 * c.stripe_m, 5.999999));
    EXPECT_TRUE(is_marked_at(paint, 1.5 * c.stripe_m, 6.000001));
    EXPECT_TRUE(is_marked_at(paint, 1.5 * c.stripe_m, 35.999999));
    EXPECT_FALSE(is_marked_at(paint, 1.5 * c.stripe_m, 36.000001));
  }
}

// Annex 14, table 5-1 and 5.2.6: 3000 m long: the aiming point at 400 m, pairs of touchdown marks every
// 150 m to 900 m but the one within 50 m of it (450 m); the inner sides 18 m apart.
TEST(RunwayMarking, AimingPointAndTouchdownZoneFollowTheLength) {
  const world::PaintSample paint = strip(Marking::Runway, 22.5, 3000.0, 8);
  const auto lengths_of_marks = [&](double across_m, double from_m, double to_m) {
    std::vector<std::pair<double, double>> marks;
    bool was_marked = false;
    for (double s = from_m; s < to_m; s += 0.1) {
      const bool is = is_marked_at(paint, across_m, s);
      if (is && !was_marked) marks.emplace_back(s, s);
      if (is) marks.back().second = s;
      was_marked = is;
    }
    return marks;
  };
  for (const double side : {-1.0, 1.0}) {
    const auto marks = lengths_of_marks(side * 9.5, 100.0, 1500.0);
    ASSERT_EQ(marks.size(), 6u);
    const double expected[][2] = {{150.0, 172.5}, {300.0, 322.5}, {400.0, 445.0},
                                  {600.0, 622.5}, {750.0, 772.5}, {900.0, 922.5}};
    for (std::size_t i = 0; i < marks.size(); ++i) {
      EXPECT_NEAR(marks[i].first, expected[i][0], 0.11);
      EXPECT_NEAR(marks[i].second, expected[i][1], 0.11);
    }
    EXPECT_FALSE(is_marked_at(paint, side * 8.999, 420.0));
    EXPECT_TRUE(is_marked_at(paint, side * 14.999, 420.0));
    EXPECT_FALSE(is_marked_at(paint, side * 15.001, 420.0));
    EXPECT_FALSE(is_marked_at(paint, side * 12.001, 610.0));
  }
}

// 5.2.3: the centre line's stripes are 30 m long, stripe and gap 50 to 75 m, the same from both ends.
TEST(RunwayMarking, CentreLinesAreTheSameFromBothEnds) {
  for (const double length_m : {620.0, 1234.5, 2718.0, 4000.0}) {
    const world::PaintSample paint = strip(Marking::Runway, 22.5, length_m, 17);
    std::vector<double> starts;
    bool was_marked = false;
    for (double s = 69.0; s < length_m - 69.0; s += 0.05) {
      const bool is = is_marked_at(paint, 0.0, s + 0.01);
      if (is && !was_marked) starts.push_back(s);
      was_marked = is;
    }
    for (double s = 0.0137; s < length_m; s += 0.5)
      EXPECT_EQ(is_marked_at(paint, 0.0, s), is_marked_at(paint, 0.0, length_m - s)) << s;
    ASSERT_GE(starts.size(), 2u);
    for (std::size_t i = 1; i < starts.size(); ++i) {
      EXPECT_GE(starts[i] - starts[i - 1], 49.9);
      EXPECT_LE(starts[i] - starts[i - 1], 75.1);
    }
    EXPECT_NEAR(starts.front(), 69.0, 0.06);
    EXPECT_NEAR(starts.back(), length_m - 69.0 - 30.0, 0.11);
  }
}

/// A runway's number as a picture: rows from its top, columns to the right, as who lands sees it.
std::vector<std::string> number_seen(int number, bool from_start, double whole_m) {
  const world::PaintSample paint = strip(Marking::Runway, 22.5, whole_m, number);
  std::vector<std::string> rows;
  for (int row = 0; row < 6; ++row) {
    const double ahead_m = 57.0 - 1.5 * row - 0.75;
    std::string line;
    for (double right_m = -4.15 + 0.375; right_m < 4.15; right_m += 0.75) {
      const bool is = from_start ? is_marked_at(paint, -right_m, ahead_m)
                                 : is_marked_at(paint, right_m, whole_m - ahead_m);
      line += is ? '#' : '.';
    }
    rows.push_back(line);
  }
  return rows;
}

TEST(RunwayMarking, NumbersStandUprightForWhoLandsThere) {
  // 7 leans, and its bar is on top; 1 is a bar on the right of its place.
  const std::vector<std::string> seen = number_seen(17, true, 3000.0);
  EXPECT_EQ(seen[0].substr(7, 4), "####") << seen[0];
  EXPECT_EQ(seen[5].substr(7, 4).find('#'), seen[5].substr(7, 4).rfind('#')) << seen[5];
  EXPECT_LT(seen[5].substr(7).find('#'), seen[1].substr(7).find('#'))
      << "the foot is left of the top";
  // The other end has the opposite number, seen from there.
  EXPECT_EQ(number_seen(17, false, 3000.0), number_seen(35, true, 3000.0));
  EXPECT_EQ(number_seen(30, false, 3000.0), number_seen(12, true, 3000.0));
  EXPECT_EQ(number_seen(18, false, 3000.0), number_seen(36, true, 3000.0));
}

// The strokes' shares, cut by the shoelace, against counting; and no two strokes lie over each other:
// a window over the whole number covers no more than its marked places.
TEST(RunwayMarking, NumbersCoverTheShareOfTheirPlaces) {
  for (int number = 1; number <= 36; ++number) {
    world::PaintSample paint = strip(Marking::Runway, 22.5, 3000.0, number);
    paint.along_m = 52.5;
    paint.across_m = 0.0;
    const double share = marks_within(paint, 10.0).white;
    // Cells of 2.5 cm; a number's border is under 120 m long: 3000 of 160,000 cells are on it, half
    // of which err, either way.
    EXPECT_NEAR(share, counted_share(paint, 0.0, 52.5, 10.0, 400), 0.004) << number;
    EXPECT_GT(share, 0.10) << number;
  }
}

TEST(Marking, TracksHaveTheirGaugeAndSleepers) {
  world::PaintSample paint = strip(Marking::Rails, 4.0, 1000.0, 2);
  for (const double track_m : {-2.0, 2.0}) {
    for (const double side : {-1.0, 1.0}) {
      for (const auto& [from_center_m, is_rail] :
           {std::pair{0.7174, false}, std::pair{0.7176, true}, std::pair{0.7894, true},
            std::pair{0.7896, false}}) {
        paint.across_m = track_m + side * from_center_m;
        paint.along_m = 100.0;
        EXPECT_EQ(tracks_within(paint, 0.0).rail > 0.0, is_rail);
      }
    }
  }
  paint.across_m = 0.0;
  const TrackCover cover = tracks_within(paint, 60.0);
  EXPECT_NEAR(cover.rail * 60.0, 4 * 0.072, 1e-9);
  EXPECT_NEAR(cover.sleeper * 60.0, 2 * 2.6 * 0.5, 1e-9);
  EXPECT_NEAR(cover.rail_side * 60.0, 4 * (0.150 - 0.072), 1e-9);
}

TEST(Pattern, SharesOfBarsAreTheirIntegral) {
  for (std::uint64_t i = 0; i < 200; ++i) {
    const double period_m = core::random_between(0.5, 3.0, 3, 0, i);
    const double bar_m = core::random_between(0.05, 0.9, 3, 1, i) * period_m;
    const double width_m = core::random_between(0.1, 9.0, 3, 2, i);
    const double at = core::random_between(-50.0, 50.0, 3, 3, i);
    constexpr int kSteps = 20000;
    int on_bar = 0;
    for (int k = 0; k < kSteps; ++k)
      on_bar +=
          share_of_bars(at + width_m * ((k + 0.5) / kSteps - 0.5), 0.0, bar_m, period_m) > 0.5;
    // Each of at most 40 borders errs by half a step.
    EXPECT_NEAR(share_of_bars(at, width_m, bar_m, period_m), on_bar / static_cast<double>(kSteps),
                20.0 / kSteps + 1e-9);
  }
}

}  // namespace
}  // namespace terracast::scene
