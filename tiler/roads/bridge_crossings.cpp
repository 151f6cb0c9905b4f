#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "tiler/roads/road_heights.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kCell_m = 32.0;
/// Ways that meet so near to a bridge's end do not cross it.
constexpr double kEnd_m = 0.5;
/// What a deck's fall over the width of the way below may take, and rounding off.
constexpr double kDeckGrade = 0.025;
constexpr double kSpare_m = 0.2;

/// A piece of a line, from a point to the next.
struct Piece {
  std::uint32_t line;
  std::uint32_t point;
  std::uint32_t way;
};
auto order_of(const Piece& piece) { return std::pair(piece.line, piece.point); }

/// Pieces of all ways on and above the ground, by squares of the plane.
class PieceIndex {
 public:
  explicit PieceIndex(const RoadNetwork& network) {
    for (std::uint32_t l = 0; l < network.lines().size(); ++l)
      for (const Span& span : network.lines()[l].spans) {
        if (network.style(span).is_tunnel) continue;
        const auto& points = network.lines()[l].points;
        for (std::uint32_t p = span.first_point; p < span.last_point; ++p)
          visit_cells(points[p].at_world, points[p + 1].at_world, [&](std::int64_t key) {
            cells_[key].push_back({l, p, span.way});
          });
      }
  }
  /// Each once, by line and point.
  std::vector<Piece> near(const Vector2d& a, const Vector2d& b) const {
    std::vector<Piece> near;
    visit_cells(a, b, [&](std::int64_t key) {
      if (const auto there = cells_.find(key); there != cells_.end())
        near.insert(near.end(), there->second.begin(), there->second.end());
    });
    std::sort(near.begin(), near.end(),
              [](const Piece& x, const Piece& y) { return order_of(x) < order_of(y); });
    near.erase(
        std::unique(near.begin(), near.end(),
                    [](const Piece& x, const Piece& y) { return order_of(x) == order_of(y); }),
        near.end());
    return near;
  }

 private:
  template <class Visit>
  static void visit_cells(const Vector2d& a, const Vector2d& b, const Visit& visit) {
    const auto cell = [](double at) { return static_cast<std::int64_t>(std::floor(at / kCell_m)); };
    const Vector2d low = a.cwiseMin(b);
    const Vector2d high = a.cwiseMax(b);
    for (std::int64_t j = cell(low.y()); j <= cell(high.y()); ++j)
      for (std::int64_t i = cell(low.x()); i <= cell(high.x()); ++i) visit(i * 0x100000000LL + j);
  }
  std::unordered_map<std::int64_t, std::vector<Piece>> cells_;
};

}  // namespace

std::vector<BridgeCrossing> bridge_crossings(const RoadNetwork& network) {
  std::vector<BridgeCrossing> crossings;
  const PieceIndex index(network);
  for (std::uint32_t l = 0; l < network.lines().size(); ++l) {
    const Line& line = network.lines()[l];
    for (std::uint32_t k = 0; k < line.spans.size(); ++k) {
      const Span& span = line.spans[k];
      const WayStyle& style = network.style(span);
      if (!style.is_bridge) continue;
      for (std::uint32_t p = span.first_point; p < span.last_point; ++p) {
        const Line::Point& a = line.points[p];
        const Line::Point& b = line.points[p + 1];
        for (const Piece& piece : index.near(a.at_world, b.at_world)) {
          const WayStyle& other = network.ways()[piece.way].style;
          if (other.is_bridge && other.level >= style.level) continue;
          const Line::Point& c = network.lines()[piece.line].points[piece.point];
          const Line::Point& d = network.lines()[piece.line].points[piece.point + 1];
          const Vector2d u = b.at_world - a.at_world;
          const Vector2d v = d.at_world - c.at_world;
          const double cross = u.x() * v.y() - u.y() * v.x();
          if (cross == 0.0) continue;
          const Vector2d w = c.at_world - a.at_world;
          const double t = (w.x() * v.y() - w.y() * v.x()) / cross;
          const double s = (w.x() * u.y() - w.y() * u.x()) / cross;
          if (t < 0.0 || t > 1.0 || s < 0.0 || s > 1.0) continue;
          const double along_m = a.along_m + t * (b.along_m - a.along_m);
          if (along_m - line.points[span.first_point].along_m < kEnd_m ||
              line.points[span.last_point].along_m - along_m < kEnd_m)
            continue;
          // The lower way is as wide as it is.
          const double sine = std::abs(cross) / (u.norm() * v.norm());
          const double wide_m = kDeckGrade * other.half_width_m / std::max(sine, 0.3);
          crossings.push_back(
              {.at_world = a.at_world + t * u,
               .line_above = l,
               .span_above = k,
               .point_above = p,
               .share_above = t,
               .along_above_m = along_m,
               .line_below = piece.line,
               .point_below = piece.point,
               .share_below = s,
               .along_below_m = c.along_m + s * (d.along_m - c.along_m),
               .wanted_m = other.clearance_m + RoadHeights::deck_m(style) + kSpare_m + wide_m});
        }
      }
    }
  }
  return crossings;
}

}  // namespace terracast::tiler
