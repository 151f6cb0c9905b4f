// World points: where what a pixel shows is, when the pixel's line is exposed. From where the pixel's own ray starts, so
// of rolling shutters, orthographic and pushbroom cameras too.
//
// A NumPy file an image: float64 of shape (height, width, 3), m, in the world's frame, whose origin points.json names;
// NaN of the sky and of pixels without a ray. As doubles, since places 25 km from the origin as floats are steps of 2 mm
// apart; ranges are floats in the capture, and a point is good to 6e-8 of its range along the ray (0.3 mm at 5 km).

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/npy.h"
#include "labels/facts_images.h"

namespace terracast::labels {
namespace {

std::vector<std::byte> points_npy(const FactsImage& image) {
  const core::ImageF& range_m = image.facts.range_m;
  std::vector<double> coordinates(3 * range_m.num_pixels(),
                                  std::numeric_limits<double>::quiet_NaN());
  auto place = coordinates.begin();
  for (int y = 0; y < range_m.height(); ++y)
    for (int x = 0; x < range_m.width(); ++x, place += 3) {
      if (!std::isfinite(range_m(x, y))) continue;
      const Eigen::Vector3d point_world = capture::point_world(
          image.view, capture::pixel_center(x, y), static_cast<double>(range_m(x, y)));
      std::copy(point_world.begin(), point_world.end(), place);
    }
  return core::npy_bytes(std::span<const double>(coordinates),
                         {range_m.height(), range_m.width(), 3});
}

LabelFiles make_points(const LabelInputs& inputs) {
  return make_facts_images(
      inputs,
      {.kind = "points",
       .extension = ".npy",
       .channels = {{"x, y, z",
                     "float64, m in the world's frame: east, north and up of WGS84 at "
                     "world_origin; NaN sky and no ray"}},
       .encode = points_npy},
      [&](core::Json& index) {
        const geo::Geodetic& origin = inputs.sequence.info().origin;
        index.set("world_origin", core::Json::object()
                                      .set("lat_deg", origin.lat_deg)
                                      .set("lon_deg", origin.lon_deg)
                                      .set("height_m", origin.height_m));
      });
}

}  // namespace

LabelInfo points_label() {
  return {.name = "points",
          .summary = "Point of the world that every pixel shows, as doubles.",
          .make = []() -> std::unique_ptr<LabelMaker> {
            return std::make_unique<PlainLabel>(make_points);
          }};
}

}  // namespace terracast::labels
