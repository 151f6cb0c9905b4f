#include "tiler/roads/water_gaps.h"

#include <cmath>

#include "core/parallel.h"

namespace terracast::tiler {
namespace {

/// Water that is no wider passes below a way in a culvert.
constexpr double kCulvert_m = 14.0;
constexpr double kLook_m = 4.0;
/// So exactly is a shore known: less than a terrain sample.
constexpr double kShore_m = 0.1;

}  // namespace

std::vector<std::vector<std::pair<double, double>>> water_gaps(const RoadNetwork& network,
                                                               const IsWater& is_water,
                                                               const IsWater& is_sea) {
  std::vector<std::vector<std::pair<double, double>>> gaps(network.lines().size());
  core::parallel_for(static_cast<std::int64_t>(gaps.size()), [&](std::int64_t l) {
    const Line& line = network.lines()[static_cast<std::size_t>(l)];
    double wet_from_m = -1.0;
    double before_m = 0.0;
    bool is_cut = false;       // it begins or ends in water
    bool has_culvert = false;  // not below what is only painted, nor in the sea
    const auto close = [&](double to_m, bool ends_wet) {
      if (wet_from_m < 0.0) return;
      if (to_m - wet_from_m > kCulvert_m || is_cut || ends_wet || !has_culvert)
        gaps[static_cast<std::size_t>(l)].emplace_back(wet_from_m, to_m);
      wet_from_m = -1.0;
    };
    for (const Span& span : line.spans) {
      const WayStyle& style = network.style(span);
      const double begin_m = line.points[span.first_point].along_m;
      if (style.is_bridge || style.is_tunnel) {
        close(begin_m, false);
        before_m = line.points[span.last_point].along_m;
        continue;
      }
      for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
        const Line::Point& a = line.points[p];
        const Line::Point& b = line.points[p + 1];
        const double length_m = b.along_m - a.along_m;
        const auto place_at = [&](double along_m) -> Eigen::Vector2d {
          return a.at_world + (along_m - a.along_m) / length_m * (b.at_world - a.at_world);
        };
        /// The dry end of what the shore lies between.
        const auto shore_m = [&](double dry_m, double wet_m) {
          while (std::abs(wet_m - dry_m) > kShore_m) {
            const double middle_m = 0.5 * (dry_m + wet_m);
            (is_water(place_at(middle_m)) ? wet_m : dry_m) = middle_m;
          }
          return dry_m;
        };
        const int num = std::max(1, static_cast<int>(std::ceil(length_m / kLook_m)));
        for (int k = p == span.first_point ? 0 : 1; k <= num; ++k) {
          const double at_m = a.along_m + length_m * k / num;
          const bool is_wet = is_water(place_at(at_m));
          if (is_wet && wet_from_m < 0.0) {
            is_cut = at_m == 0.0;
            has_culvert = style.is_shaped && !is_sea(place_at(at_m));
            wet_from_m = shore_m(before_m, at_m);
          }
          if (!is_wet && wet_from_m >= 0.0) close(shore_m(at_m, before_m), false);
          before_m = at_m;
        }
      }
    }
    close(line.length_m(), true);
  });
  return gaps;
}

}  // namespace terracast::tiler
