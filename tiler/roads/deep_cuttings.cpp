#include "tiler/roads/deep_cuttings.h"

#include <algorithm>

namespace terracast::tiler {
namespace {

constexpr double kDeepest_m = 20.0;
constexpr double kPortal_m = 8.0;

bool may_go_below(const WayStyle& style) {
  return (style.is_shaped || style.is_bridge) && !style.is_tunnel && style.use != WayUse::Airfield;
}

}  // namespace

std::vector<Stretch> deep_cuttings(const RoadNetwork& network, const RoadHeights& heights) {
  std::vector<Stretch> deep;
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    std::vector<Stretch> run;  // a part in each span, from portal to portal
    double deepest_m = 0.0;
    const auto close = [&] {
      if (deepest_m > kDeepest_m) deep.insert(deep.end(), run.begin(), run.end());
      run.clear();
      deepest_m = 0.0;
    };
    for (std::uint32_t s = 0; s < line.spans.size(); ++s) {
      const Span& span = line.spans[s];
      if (!may_go_below(network.style(span))) {
        close();
        continue;
      }
      bool goes_on = false;  // within this span
      for (std::uint32_t p = span.first_point; p <= span.last_point; ++p) {
        const Line::Point& point = line.points[p];
        if (!point.is_at_station()) continue;
        const double depth_m = heights.ground_m(point) - heights.level_m(point);
        if (depth_m <= kPortal_m) {
          close();
          goes_on = false;
          continue;
        }
        deepest_m = std::max(deepest_m, depth_m);
        if (goes_on)
          run.back().last_point = p;
        else
          run.push_back({.line = l, .span = s, .first_point = p, .last_point = p});
        goes_on = true;
      }
    }
    close();
  }
  std::erase_if(deep, [](const Stretch& part) { return part.first_point == part.last_point; });
  return deep;
}

}  // namespace terracast::tiler
