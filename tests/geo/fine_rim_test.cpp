#include "geo/fine_rim.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geo/units.h"

namespace terracast::geo {
namespace {

CameraIntrinsics pinhole_of_view(double across_deg) {
  constexpr int kSide_px = 1024;
  const double focal_px = 0.5 * kSide_px / std::tan(0.5 * radians_from_degrees(across_deg));
  return {"pinhole", kSide_px, 16, {focal_px, focal_px, 0.5 * kSide_px, 8.0}};
}

// At an angle a from the axis a pinhole has f / cos(a)^2 pixels a radian: at the ends of a row of 1024 those of
// a = half the view, for half of it those of tan(a) = half as much.
/// At an angle a from its axis a pinhole has f / cos(a)^2 pixels a radian: at the ends of a row those of half the view,
/// for half of the row fewer than where tan(a) is half as much.
FineRim rim_of_pinhole(double across_deg) {
  const double tan_end = std::tan(0.5 * radians_from_degrees(across_deg));
  const double focal_px = 512.0 / tan_end;
  return {.finest_pixels_per_radian = focal_px * (1.0 + tan_end * tan_end),
          .usual_pixels_per_radian = focal_px * (1.0 + 0.25 * tan_end * tan_end)};
}

// The ratio tends to 4 for ever wider views: of a row of a pinhole the ends are never far finer than the rest.
TEST(FineRim, IsNoneOfPinholes) {
  for (const double across_deg : {20.0, 90.0, 150.0, 179.0}) {
    SCOPED_TRACE(across_deg);
    const FineRim rim = rim_of_pinhole(across_deg);
    EXPECT_LT(rim.finest_pixels_per_radian, 4.0 * rim.usual_pixels_per_radian);
    EXPECT_FALSE(find_fine_rim(*make_camera(pinhole_of_view(across_deg))));
  }
}

// An equidistant fisheye has f pixels a radian along its radii, and f a / sin(a) around them at an angle a from its axis:
// without an end straight backwards. Its usual pixels, of the side that has more, are those of the median angle.
TEST(FineRim, IsWhereAFisheyeLooksStraightBackwards) {
  constexpr int kSide_px = 400;
  constexpr double kMiddle_px = 0.5 * kSide_px;
  const double corner_px = kMiddle_px * std::sqrt(2.0);
  for (const double corner_rad : {1.5, 2.3, 2.9, 3.1, 3.14}) {
    SCOPED_TRACE(corner_rad);
    const double focal_px = corner_px / corner_rad;
    const auto rim =
        find_fine_rim(*make_camera({"opencv_fisheye",
                                    kSide_px,
                                    kSide_px,
                                    {focal_px, focal_px, kMiddle_px, kMiddle_px, 0, 0, 0, 0}}));
    const double finest = focal_px * corner_rad / std::sin(corner_rad);
    // Half of a square's area is nearer to its middle than 0.399 of its side (pi r^2 = 1/2).
    const double median_rad = kSide_px * std::sqrt(0.5 / std::numbers::pi) / focal_px;
    const double usual = focal_px * median_rad / std::sin(median_rad);
    ASSERT_EQ(rim.has_value(), finest > 30.0 * usual) << finest / usual;
    if (!rim) continue;
    EXPECT_NEAR(rim->finest_pixels_per_radian, finest, 1e-3 * finest);
    // Of 32 x 32 places, between neighbouring pixels: half a place's side is 1.6 % of the image's.
    EXPECT_NEAR(rim->usual_pixels_per_radian, usual, 0.05 * usual);
  }
}

// What spans as many pixels from near and from far spans no angle.
TEST(FineRim, IsNoneOfCamerasWhosePixelsSpanNoAngle) {
  EXPECT_FALSE(find_fine_rim(*make_camera({"orthographic", 64, 48, {2.0, 2.0, 32.0, 24.0}})));
}

}  // namespace
}  // namespace terracast::geo
