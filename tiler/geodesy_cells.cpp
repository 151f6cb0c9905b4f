#include "tiler/geodesy_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <unordered_map>

#include "core/error.h"
#include "core/parallel.h"
#include "geo/units.h"

namespace terracast::tiler {
namespace {

using Terms = GeodesyColumn::Terms;

constexpr double kCoarsestNodeSpacing_m = 512.0;
constexpr double kFinestNodeSpacing_m = 32.0;
constexpr double kMostNodes = 1e6;
/// Probes that stay apart by more than this tell of a seam or a pole in the projection.
constexpr double kLargestError_m = 1e-3;

/// Of the ellipsoid, squared.
constexpr double kEccentricity2 = geo::kWgs84Flattening * (2.0 - geo::kWgs84Flattening);

/// Of places at a height; a thousandth of it shows in their map coordinates.
constexpr double kPlaceTolerance_m = 1e-6;

/// Where the cubic in height is exact, in half ranges about the middle: the nodes of Chebyshev.
constexpr std::array<double, 4> kHeightNodes = {-0.92387953251128674, -0.38268343236508977,
                                                0.38268343236508977, 0.92387953251128674};

/// Coefficients of the cubic through values at kHeightNodes.
Eigen::Matrix4d coefficients_from_values() {
  Eigen::Matrix4d values_from_coefficients;
  for (int row = 0; row < 4; ++row)
    for (int power = 0; power < 4; ++power)
      values_from_coefficients(row, power) =
          std::pow(kHeightNodes[static_cast<std::size_t>(row)], power);
  return values_from_coefficients.inverse();
}

/// Weights of a quadratic through t = 0, 1/2, 1.
std::array<double, 3> quadratic_weights(double t) {
  return {(1.0 - 2.0 * t) * (1.0 - t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)};
}

Terms combined(const Terms& a, const Terms& b, const Terms& c, const std::array<double, 3>& w) {
  Terms sum;
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] = w[0] * a[k] + w[1] * b[k] + w[2] * c[k];
  return sum;
}

}  // namespace

PlaceAtHeight place_at_height(const geo::WorldFrame& frame, double x_world, double y_world,
                              double height_m, double tolerance_m) {
  // The sphere that bends like the ellipsoid at the origin, in the direction of the place.
  const double sin_lat = std::sin(geo::radians_from_degrees(frame.origin().lat_deg));
  const double w2 = 1.0 - kEccentricity2 * sin_lat * sin_lat;
  const double east_radius_m = geo::kWgs84SemiMajorAxis_m / std::sqrt(w2);
  const double north_radius_m = east_radius_m * (1.0 - kEccentricity2) / w2;
  const double distance2 = x_world * x_world + y_world * y_world;
  const double bend =
      distance2 > 0.0
          ? (x_world * x_world / east_radius_m + y_world * y_world / north_radius_m) / distance2
          : 1.0 / east_radius_m;
  const double radius_m = 1.0 / bend + height_m;
  const double lean2 = distance2 / (radius_m * radius_m);
  TERRACAST_CHECK(lean2 < 0.25, "({}, {}) is too far from the world's origin", x_world, y_world);
  const Eigen::Vector3d z_axis_ecef = frame.ecef_from_world().rotation * Eigen::Vector3d::UnitZ();
  PlaceAtHeight found;
  found.z_world = height_m - radius_m * (1.0 - std::sqrt(1.0 - lean2));
  for (int i = 0; i < 30; ++i) {
    found.place = frame.geodetic_from_world({x_world, y_world, found.z_world});
    const double lat_rad = geo::radians_from_degrees(found.place.lat_deg);
    const double lon_rad = geo::radians_from_degrees(found.place.lon_deg);
    const Eigen::Vector3d up_ecef(std::cos(lat_rad) * std::cos(lon_rad),
                                  std::cos(lat_rad) * std::sin(lon_rad), std::sin(lat_rad));
    found.height_per_z = up_ecef.dot(z_axis_ecef);
    const double missing_m = height_m - found.place.height_m;
    // The height bends along z by sin(lean)^2 / R: a step of 1 m leaves less than 1e-9 m.
    found.z_world += missing_m / found.height_per_z;
    if (std::abs(missing_m) < tolerance_m) break;
  }
  return found;
}

/// What nodes are computed from when they are needed, and those of the cells that were.
struct GeodesyCells::OnDemand {
  const geo::WorldFrame& frame;
  const MapProjection& projection;
  const geo::Geoid* geoid;
  std::mutex mutex;
  std::unordered_map<std::int64_t, Cell> cells = {};  // whose elements never move
};

GeodesyCells::GeodesyCells(double half_side_m, double lowest_m, double highest_m)
    : half_side_m_(half_side_m),
      middle_m_(0.5 * (lowest_m + highest_m)),
      half_range_m_(std::max(0.5 * (highest_m - lowest_m), 10.0)) {}

GeodesyCells::GeodesyCells(const geo::WorldFrame& frame, const MapProjection& projection,
                           const geo::Geoid* geoid, double half_side_m, double lowest_m,
                           double highest_m)
    : GeodesyCells(half_side_m, lowest_m, highest_m) {
  for (double spacing_m = kCoarsestNodeSpacing_m;; spacing_m /= 2.0) {
    set_spacing(spacing_m);
    fill(frame, projection, geoid);
    largest_probe_error_m_ = probe(frame, projection);
    if (largest_probe_error_m_ <= kTolerance_m || node_spacing_m_ <= kFinestNodeSpacing_m) break;
    // Twice the nodes make the error of a quadratic eight times smaller; a projection with a seam
    // in the square would never get there.
    if (static_cast<double>(num_nodes_) * num_nodes_ > kMostNodes) break;
  }
  if (largest_probe_error_m_ > kLargestError_m)
    core::fail(core::ErrorKind::Input,
               "the projection jumps or bends within the world's square: places are "
               "off by {:.2g} m between nodes {} m apart; warp the raster to a projection without "
               "a seam or pole there, such as its UTM zone's, with gdalwarp -t_srs",
               largest_probe_error_m_, node_spacing_m_);
}

GeodesyCells::~GeodesyCells() = default;

std::unique_ptr<GeodesyCells> GeodesyCells::on_demand(const geo::WorldFrame& frame,
                                                      const MapProjection& projection,
                                                      const geo::Geoid* geoid, double half_side_m,
                                                      double lowest_m, double highest_m,
                                                      double node_spacing_m) {
  std::unique_ptr<GeodesyCells> cells(new GeodesyCells(half_side_m, lowest_m, highest_m));
  cells->set_spacing(node_spacing_m);
  cells->on_demand_.reset(new OnDemand{frame, projection, geoid, {}});
  return cells;
}

void GeodesyCells::set_spacing(double node_spacing_m) {
  node_spacing_m_ = node_spacing_m;
  num_cells_ = 2 * static_cast<int>(std::ceil(half_side_m_ / (2.0 * node_spacing_m_)));
  num_nodes_ = 2 * num_cells_ + 1;
}

void GeodesyCells::compute_nodes(const geo::WorldFrame& frame, const MapProjection& projection,
                                 const geo::Geoid* geoid, int row, int first_column,
                                 std::span<Terms> nodes) const {
  const Eigen::Matrix4d coefficients = coefficients_from_values();
  const std::size_t count = nodes.size() * 4;
  std::vector<geo::Geodetic> places(count);
  std::vector<double> z_world(count);
  std::vector<Eigen::Vector2d> map(count);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k) {
      const int column = first_column + static_cast<int>(i);
      const PlaceAtHeight found = place_at_height(
          frame, (column - num_cells_) * node_spacing_m_, (row - num_cells_) * node_spacing_m_,
          middle_m_ + half_range_m_ * kHeightNodes[k], kPlaceTolerance_m);
      z_world[4 * i + k] = found.z_world;
      places[4 * i + k] = found.place;
    }
  projection.map_from_geodetic(places, map);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Eigen::Matrix4d values;  // row: height; column: component
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t at = 4 * i + k;
      const double undulation_m =
          geoid == nullptr ? 0.0 : geoid->undulation_m(places[at].lat_deg, places[at].lon_deg);
      values.row(static_cast<int>(k)) << z_world[at], map[at].x(), map[at].y(), undulation_m;
    }
    const Eigen::Matrix4d terms = coefficients * values;
    for (int component = 0; component < 4; ++component)
      for (int power = 0; power < 4; ++power)
        nodes[i][static_cast<std::size_t>(4 * component + power)] = terms(power, component);
  }
}

void GeodesyCells::fill(const geo::WorldFrame& frame, const MapProjection& projection,
                        const geo::Geoid* geoid) {
  const auto stride = static_cast<std::size_t>(num_nodes_);
  nodes_.resize(stride * stride);
  core::parallel_for(num_nodes_, [&](std::int64_t row) {
    compute_nodes(frame, projection, geoid, static_cast<int>(row), 0,
                  std::span(nodes_).subspan(static_cast<std::size_t>(row) * stride, stride));
  });
}

const GeodesyCells::Cell& GeodesyCells::cell_on_demand(int cell_x, int cell_y) const {
  const std::scoped_lock lock(on_demand_->mutex);
  const auto [found, is_new] =
      on_demand_->cells.try_emplace(std::int64_t{cell_y} * num_cells_ + cell_x);
  if (!is_new) return found->second;
  try {
    for (int row = 0; row < 3; ++row)
      compute_nodes(on_demand_->frame, on_demand_->projection, on_demand_->geoid, 2 * cell_y + row,
                    2 * cell_x,
                    std::span(found->second).subspan(3 * static_cast<std::size_t>(row), 3));
  } catch (...) {
    on_demand_->cells.erase(found);
    throw;
  }
  return found->second;
}

double GeodesyCells::probe(const geo::WorldFrame& frame, const MapProjection& projection) const {
  // The cubic's and the quadratic's worst places: between nodes, at the corners and the middle of
  // the square.
  double worst_m = 0.0;
  const double last = half_side_m_ - 0.5 * node_spacing_m_;
  for (const double fx : {-1.0, -0.31, 0.0, 0.47, 1.0})
    for (const double fy : {-1.0, -0.53, 0.0, 0.29, 1.0})
      for (const double fh : {-1.0, 0.0, 0.7}) {
        const double inset = 0.288 * node_spacing_m_;
        const double x = fx * (last - inset) + inset * 0.5;
        const double y = fy * (last - inset) - inset * 0.5;
        const double height_m = middle_m_ + fh * half_range_m_;
        const PlaceAtHeight truth = place_at_height(frame, x, y, height_m, kPlaceTolerance_m);
        Eigen::Vector2d map;
        projection.map_from_geodetic({&truth.place, 1}, {&map, 1});
        const ColumnPoint point = column(x, y).at(height_m);
        worst_m = std::max({worst_m, std::abs(point.z_world - truth.z_world),
                            (point.map - map).norm() * projection.metres_per_map_unit()});
      }
  return worst_m;
}

int GeodesyCells::cell_of(double coordinate) const {
  const double cell = std::floor(coordinate / (2.0 * node_spacing_m_));
  return std::clamp(static_cast<int>(cell) + num_cells_ / 2, 0, num_cells_ - 1);
}

GeodesyColumn GeodesyCells::column(double x_world, double y_world) const {
  return Row(*this, y_world).column(x_world);
}

GeodesyCells::Row::Row(const GeodesyCells& cells, double y_world)
    : cells_(cells), y_world_(y_world) {}

GeodesyColumn GeodesyCells::Row::column(double x_world) {
  const double side_m = 2.0 * cells_.node_spacing_m_;
  const int cell_x = cells_.cell_of(x_world);
  if (cell_x != cell_x_) {
    cell_x_ = cell_x;
    const int cell_y = cells_.cell_of(y_world_);
    const auto weights = quadratic_weights(y_world_ / side_m - (cell_y - cells_.num_cells_ / 2));
    const bool is_filled = cells_.on_demand_ == nullptr;
    const std::size_t stride = is_filled ? static_cast<std::size_t>(cells_.num_nodes_) : 3;
    const Terms* corner = is_filled ? &cells_.nodes_[static_cast<std::size_t>(2 * cell_y) * stride +
                                                     static_cast<std::size_t>(2 * cell_x)]
                                    : cells_.cell_on_demand(cell_x, cell_y).data();
    for (std::size_t i = 0; i < 3; ++i)
      nodes_[i] = combined(corner[i], corner[i + stride], corner[i + 2 * stride], weights);
  }
  const auto weights = quadratic_weights(x_world / side_m - (cell_x - cells_.num_cells_ / 2));
  return GeodesyColumn(combined(nodes_[0], nodes_[1], nodes_[2], weights), cells_.middle_m_,
                       cells_.half_range_m_);
}

}  // namespace terracast::tiler
