#include "tiler/country/industry.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace terracast::tiler::country {
namespace {

using core::random_unit;

constexpr double kBesideRoads_m = 4.5;  ///< from the carriageway: a pavement and a strip of green
constexpr double kFence_m = 1.2;        ///< half of what is left between plots
constexpr double kLeastPlot_m2 = 500.0;
constexpr double kNarrowestPlot_m = 18.0;
constexpr double kSteepestPlot = 0.045;  ///< yards are nearly level
constexpr double kLogistics_m2 = 9000.0;
constexpr double kWorkshops_m2 = 2600.0;

double area_m2(const Rectangle& box) { return 4.0 * box.half_along_m * box.half_across_m; }

/// A part of a rectangle, by distances from its middle.
Rectangle part(const Rectangle& of, double along_from, double along_to, double across_from,
               double across_to) {
  return {of.center + 0.5 * (along_from + along_to) * of.along +
              0.5 * (across_from + across_to) * left_of(of.along),
          of.along, 0.5 * (along_to - along_from), 0.5 * (across_to - across_from)};
}

class PlotBuilder {
 public:
  /// streets   to which drives lead: a ring, whose last point is joined to its first, or a line
  PlotBuilder(const PointsWorld& streets, bool is_ring, int palette, Builder& builder)
      : streets_(streets), is_ring_(is_ring), palette_(palette), builder_(builder) {}

  void fill(const Point& along) {
    const Point across = left_of(along);
    Point low = Point::Constant(1e9), high = Point::Constant(-1e9);
    for (const Point& corner : streets_) {
      const Point own(corner.dot(along), corner.dot(across));
      low = low.cwiseMin(own), high = high.cwiseMax(own);
    }
    const Point middle = 0.5 * (low + high);
    split({middle.x() * along + middle.y() * across, along, 0.5 * (high.x() - low.x()),
           0.5 * (high.y() - low.y())},
          0);
  }

  /// returns   whether the lot is clear, so that it became a plot
  bool lay(const Rectangle& lot, std::uint64_t draw) {
    // Its first side is the longer one.
    Rectangle plot =
        lot.half_along_m >= lot.half_across_m
            ? lot
            : Rectangle{lot.center, left_of(lot.along), lot.half_across_m, lot.half_along_m};
    plot.half_along_m -= kFence_m;
    plot.half_across_m -= kFence_m;
    const PointsWorld ring = plot.ring();
    const Occupancy& occupancy = builder_.occupancy();
    if (!builder_.ground().is_dry(ring) ||
        builder_.ground().rise_m(ring) > kSteepestPlot * (ring[2] - ring[0]).norm() ||
        !occupancy.is_free(ring, 0.5) ||
        !occupancy.is_free(ring, kBesideRoads_m, kRoad | kRail | kWater))
      return false;
    build_on(plot, draw);
    builder_.occupancy().add_ring(ring, kReserved);
    return true;
  }

 private:
  void split(const Rectangle& lot, int depth) {
    const double area = area_m2(lot);
    if (depth > 11 || area < kLeastPlot_m2 ||
        2.0 * std::min(lot.half_along_m, lot.half_across_m) < kNarrowestPlot_m)
      return;
    // Many firms are small, few large; plots are not much longer than wide.
    const std::uint64_t draw = builder_.draw();
    const double u = random_unit(draw, 1, 0);
    const double wanted_m2 = 1300.0 + 50000.0 * u * u * u;
    const double longer = std::max(lot.half_along_m, lot.half_across_m),
                 shorter = std::min(lot.half_along_m, lot.half_across_m);
    if (area <= wanted_m2 && longer < 3.2 * shorter && is_within(lot.ring(), streets_) &&
        lay(lot, draw))
      return;
    const double share = 0.28 + 0.44 * random_unit(draw, 2, 0);
    const double a = lot.half_along_m, b = lot.half_across_m;
    if (a > b) {
      const double cut = (2.0 * share - 1.0) * a;
      split(part(lot, -a, cut, -b, b), depth + 1);
      split(part(lot, cut, a, -b, b), depth + 1);
    } else {
      const double cut = (2.0 * share - 1.0) * b;
      split(part(lot, -a, a, -b, cut), depth + 1);
      split(part(lot, -a, a, cut, b), depth + 1);
    }
  }

  void build_on(const Rectangle& plot, std::uint64_t draw) {
    const double area = area_m2(plot);
    const double u = random_unit(draw, 3, 0);
    if (u < 0.05 && area < kLogistics_m2) return;  // nobody has built there yet
    pave(plot, draw);
    if (u < 0.13) return park(part_within(plot, 1.5));
    if (area > kLogistics_m2) {
      if (u < 0.24) return store_containers(plot);
      if (u < 0.32) return build_tanks(plot, draw);
      if (u < 0.5) return build_works(plot, draw);
      return build_hall(plot, 31.0, HouseKind::Warehouse, draw);
    }
    if (u < 0.2) return store_containers(plot);
    if (area < kWorkshops_m2 || u < 0.4) return build_works(plot, draw);
    build_hall(plot, 19.0, u < 0.7 ? HouseKind::Industrial : HouseKind::Warehouse, draw);
  }

  static Rectangle part_within(const Rectangle& plot, double margin_m) {
    return {plot.center, plot.along, plot.half_along_m - margin_m, plot.half_across_m - margin_m};
  }

  /// The yard, and a drive from it to the nearest street.
  void pave(const Rectangle& plot, std::uint64_t draw) {
    const double u = random_unit(draw, 5, 0);
    const char* surface = u < 0.5 ? "asphalt" : u < 0.88 ? "concrete" : "gravel";
    add_yard(plot, surface);
    constexpr double kFarthest_m = 16.0;
    std::optional<Rectangle> drive;
    for (const auto& [x, y] : {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}) {
      const Point from = plot.at(x, y);
      const Point out = x * plot.along + y * left_of(plot.along);
      for (std::size_t e = is_ring_ ? 0 : 1; e < streets_.size(); ++e) {
        const auto share = crossing(from, from + kFarthest_m * out,
                                    streets_[e > 0 ? e - 1 : streets_.size() - 1], streets_[e]);
        const double half_m = share ? 0.5 * *share * kFarthest_m : 0.0;
        if (share && (!drive || half_m < drive->half_along_m))
          drive = Rectangle{from + half_m * out, out, half_m, 4.0};
      }
    }
    if (drive) add_yard(*drive, "asphalt");
  }

  void add_yard(const Rectangle& yard, const char* surface) {
    builder_.survey().add_area(Theme::Road, yard.ring(),
                               {{"highway", "service"}, {"area", "yes"}, {"surface", surface}});
  }

  void park(const Rectangle& place) {
    if (place.half_along_m < 6.0 || place.half_across_m < 2.6) return;
    builder_.survey().add_area(Theme::Road, place.ring(),
                               {{"amenity", "parking"}, {"surface", "asphalt"}});
  }

  /// One hall: docks along one of its sides, cars before one of its ends.
  void build_hall(const Rectangle& plot, double docks_m, HouseKind kind, std::uint64_t draw) {
    constexpr double kAside_m = 4.0;
    const double side = random_unit(draw, 6, 0) < 0.5 ? 1.0 : -1.0;
    const double end = random_unit(draw, 7, 0) < 0.5 ? 1.0 : -1.0;
    const double a = plot.half_along_m, b = plot.half_across_m;
    const double cars_m = a > 32.0 ? 18.0 : kAside_m;
    if (b < 0.5 * (docks_m + kAside_m) + 5.0) return build_works(plot, draw);
    const Rectangle turned_plot{plot.center, end * plot.along, a, b};
    // In the plot's frame turned so that cars stand at its front: across, docks lie to `to_docks`.
    const double to_docks = side * end;
    const double near = b - docks_m, far = -b + kAside_m;
    const Rectangle hall = part(turned_plot, -a + kAside_m, a - cars_m,
                                to_docks > 0.0 ? far : -near, to_docks > 0.0 ? near : -far);
    const bool has_offices = cars_m > 10.0 && random_unit(draw, 8, 0) < 0.6;
    if (!builder_.build(hall.ring(), kind, palette_, 2.0 * hall.half_across_m, 0.0)) return;
    const double face = to_docks > 0.0 ? hall.half_across_m : -hall.half_across_m;
    // To its left lies the yard.
    const Point from = hall.center - (to_docks * (hall.half_along_m - 3.0)) * hall.along +
                       (face + to_docks * 0.5) * left_of(hall.along);
    const Point to = hall.center + (to_docks * (hall.half_along_m - 3.0)) * hall.along +
                     (face + to_docks * 0.5) * left_of(hall.along);
    builder_.survey().add_line(Theme::Road, {from, to}, {{"amenity", "loading_dock"}});
    if (cars_m < 10.0) return;
    double offices_m = 0.0;
    if (has_offices) {
      offices_m = std::min(0.5 * hall.half_across_m + 4.0, 14.0);
      builder_.build(part(hall, hall.half_along_m + 0.1, hall.half_along_m + 9.0,
                          -to_docks * hall.half_across_m + (to_docks > 0.0 ? 0.0 : -offices_m),
                          -to_docks * hall.half_across_m + (to_docks > 0.0 ? offices_m : 0.0))
                         .ring(),
                     HouseKind::Office, palette_, 9.0, 0.0, {{"building:levels", "3"}});
    }
    const double low = to_docks > 0.0 ? -b + kAside_m + offices_m : -b + 6.0;
    const double high = to_docks > 0.0 ? b - 6.0 : b - kAside_m - offices_m;
    if (high - low > 14.0) park(part(turned_plot, a - cars_m + 1.5, a - 0.5, low, high));
  }

  /// Halls and workshops of different sizes side by side.
  void build_works(const Rectangle& plot, std::uint64_t draw) {
    const double a = plot.half_along_m - 2.5, b = plot.half_across_m - 2.5;
    if (a < 6.0 || b < 5.0) return;
    const double scale = 0.5 + std::sqrt(area_m2(plot)) / 110.0;
    double at = -a;
    for (std::uint64_t k = 0; at < a - 9.0; ++k) {
      const double width_m = std::min((12.0 + 26.0 * random_unit(draw, 20, k)) * scale, a - at);
      const double depth_m = std::min(2.0 * b, width_m * (0.8 + 1.3 * random_unit(draw, 21, k)));
      const double back = random_unit(draw, 22, 0) < 0.5 ? 1.0 : -1.0;
      const double edge = back * b;
      if (random_unit(draw, 23, k) < 0.85)
        builder_.build(
            part(plot, at, at + width_m, std::min(edge, edge - back * depth_m),
                 std::max(edge, edge - back * depth_m))
                .ring(),
            random_unit(draw, 24, k) < 0.8 ? HouseKind::Industrial : HouseKind::Warehouse, palette_,
            std::min(width_m, depth_m), 0.0);
      at += width_m + (random_unit(draw, 25, k) < 0.4 ? 0.3 : 5.0 + 9.0 * random_unit(draw, 26, k));
    }
  }

  void store_containers(const Rectangle& plot) {
    builder_.survey().add_area(Theme::Harbour, part_within(plot, 4.0).ring(),
                               {{"landuse", "industrial"}, {"industrial", "container_yard"}});
  }

  /// Tanks of one size in rows, silos along an end.
  void build_tanks(const Rectangle& plot, std::uint64_t draw) {
    const double diameter_m = 12.0 + 20.0 * random_unit(draw, 30, 0);
    const double step_m = 1.4 * diameter_m + 3.0;
    const double a = plot.half_along_m - 0.5 * step_m, b = plot.half_across_m - 0.5 * step_m;
    const double silos_m = 26.0;
    for (double y = -b; y <= b; y += step_m)
      for (double x = -a; x <= a - silos_m; x += step_m)
        builder_.survey().add_point(
            Theme::Building, plot.center + x * plot.along + y * left_of(plot.along),
            {{"man_made", "storage_tank"}, {"diameter", text_of(std::round(diameter_m))}});
    const Point end = plot.center + (plot.half_along_m - 10.0) * plot.along;
    for (double y = -plot.half_across_m + 6.0; y < plot.half_across_m - 6.0; y += 8.0)
      if (random_unit(draw, 31, static_cast<std::uint64_t>(y + 1000.0)) < 0.6)
        builder_.survey().add_point(Theme::Building, end + y * left_of(plot.along),
                                    {{"man_made", "silo"}, {"diameter", "6"}, {"height", "22"}});
  }

  const PointsWorld& streets_;
  bool is_ring_;
  int palette_;
  Builder& builder_;
};

}  // namespace

void fill_industry(const Block& block, int palette, Builder& builder) {
  PlotBuilder(block.ring, true, palette, builder).fill(longest_edge(block));
}

double build_plot_at(const PointsWorld& street, double from_m, double half_m, int palette,
                     Builder& builder) {
  const std::uint64_t draw = builder.draw();
  const double room_m = length_of(street) - from_m;
  const double u = random_unit(draw, 40, 0);
  double wide_m = std::min(22.0 + 210.0 * u * u, room_m);
  double deep_m = std::min(wide_m * (0.55 + 0.6 * random_unit(draw, 41, 0)) + 12.0, 130.0);
  PlotBuilder plots(street, false, palette, builder);
  for (; wide_m > kNarrowestPlot_m; wide_m *= 0.6, deep_m = std::max(0.7 * deep_m, 24.0)) {
    const Point from = station_at(street, from_m).at;
    const Point chord = station_at(street, from_m + wide_m).at - from;
    if (chord.norm() < 0.97 * wide_m) continue;
    const Point along = chord.normalized();
    const double off_m = half_m + kBesideRoads_m + 0.6 + 0.5 * deep_m;
    if (plots.lay(
            {from + 0.5 * chord + off_m * left_of(along), along, 0.5 * chord.norm(), 0.5 * deep_m},
            draw))
      return wide_m;
  }
  return 0.0;
}

}  // namespace terracast::tiler::country
