#include "geo/paths/spline_path.h"

#include <algorithm>
#include <utility>

#include "core/error.h"
#include "geo/paths/flattened.h"
#include "geo/paths/interpolating_spline.h"

namespace terracast::geo {
namespace {

class SplinePath final : public Path {
 public:
  SplinePath(InterpolatingSpline spline, const Flattened& flattened)
      : spline_(std::move(spline)), flattened_(flattened) {}

  PathPoint at(double u) const override {
    const InterpolatingSpline::Value value = spline_.at(u);
    return flattened_.world_from_flattened({value.value, value.first, value.second, value.third});
  }
  double end() const override { return spline_.parameters().back(); }
  bool is_closed() const override { return spline_.is_closed(); }
  std::vector<double> joints() const override { return spline_.parameters(); }

 private:
  InterpolatingSpline spline_;
  Flattened flattened_;
};

}  // namespace

SplineThroughPlaces spline_through(const std::vector<Place>& places, bool is_closed,
                                   Continuity continuity, const TrajectoryContext& context) {
  const Flattened flattened(context.frame.origin());
  std::vector<Eigen::Vector3d> points;
  std::vector<double> parameters;
  const std::size_t num_places = places.size() + (is_closed ? 1 : 0);
  for (std::size_t i = 0; i < num_places; ++i) {
    const std::size_t index = i % places.size();
    const std::string what = fmt::format("waypoint {} (counted from 0)", index);
    const Eigen::Vector3d point =
        index < i ? points[index]
                  : flattened.flattened_from_world(resolve_place(places[index], context, what));
    const double chord_m = points.empty() ? 0.0 : (point - points.back()).norm();
    constexpr double kLeastChord_m = 0.01;
    if (!points.empty() && chord_m < kLeastChord_m) {
      core::fail(core::ErrorKind::Config, "{} is where the one before it is ({:.3f} m away){}",
                 what, chord_m, index < i ? "; a closed path returns to the first by itself" : "");
    }
    parameters.push_back(points.empty() ? 0.0 : parameters.back() + chord_m);
    points.push_back(point);
  }
  auto how_to_raise = [parameters, count = places.size()](double u) {
    const auto after = std::lower_bound(parameters.begin() + 1, parameters.end() - 1, u);
    const auto i = static_cast<std::size_t>(after - parameters.begin());
    const double fraction = (u - parameters[i - 1]) / (parameters[i] - parameters[i - 1]);
    if (fraction < 0.1 || fraction > 0.9)
      return fmt::format("raise waypoint {} (counted from 0)",
                         (fraction < 0.5 ? i - 1 : i) % count);
    return fmt::format("raise waypoint {} or {} (counted from 0), or add one between", i - 1,
                       i % count);
  };
  auto path = std::make_shared<SplinePath>(
      InterpolatingSpline(parameters, points, is_closed, continuity), flattened);
  return {std::move(path), std::move(parameters), std::move(how_to_raise)};
}

}  // namespace terracast::geo
