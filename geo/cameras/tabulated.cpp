#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <system_error>

#include "core/error.h"
#include "geo/camera_model.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kFewest = 4;
constexpr int kMost = 4096;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

constexpr std::array kParameters = {
    CameraParameter{"columns", "Nodes of the table across; its rays follow.", 4, kFewest, kMost},
    CameraParameter{"rows", "Nodes down.", 4, kFewest, kMost}};

/// A direction and how it changes along the table's columns and rows.
struct Interpolated {
  Vector3d ray;
  Vector3d by_column;
  Vector3d by_row;
};

/// Weights of four neighbours about a place between the middle two, and their slopes.
struct CubicWeights {
  std::array<double, 4> value;
  std::array<double, 4> slope;

  explicit CubicWeights(double t)
      : value{t * (-0.5 + t * (1.0 - 0.5 * t)), 1.0 + t * t * (1.5 * t - 2.5),
              t * (0.5 + t * (2.0 - 1.5 * t)), t * t * (0.5 * t - 0.5)},
        slope{-0.5 + t * (2.0 - 1.5 * t), t * (4.5 * t - 5.0), 0.5 + t * (4.0 - 4.5 * t),
              t * (1.5 * t - 1.0)} {}
};

/// Rays at the nodes of a grid over the image, cubic in between: node (i, j) stands at the image point
/// (cx + i fx, cy + j fy), where its ray is known. Any lens can be told so, to what its table resolves.
/// domain   the grid and half a step around it, which takes in the whole image of a ray for each pixel;
///          rays on one half-space or more, as long as neighbours are less than 90 deg apart
/// source   T. Schoeps et al., Why having 10,000 parameters in your camera model is better than twelve,
///          CVPR 2020; the interpolation: R. Keys, Cubic convolution interpolation for digital image
///          processing, IEEE ASSP 29 (1981)
class TabulatedCamera final : public CameraModel {
 public:
  explicit TabulatedCamera(const CameraIntrinsics& intrinsics)
      : CameraModel(intrinsics),
        step_(intrinsics.parameters[0], intrinsics.parameters[1]),
        first_(intrinsics.parameters[2], intrinsics.parameters[3]),
        columns_(static_cast<int>(intrinsics.parameters[4])),
        rows_(static_cast<int>(intrinsics.parameters[5])) {
    for (std::size_t i = 6; i + 2 < intrinsics.parameters.size(); i += 3) {
      const Vector3d ray(intrinsics.parameters[i], intrinsics.parameters[i + 1],
                         intrinsics.parameters[i + 2]);
      if (!(ray.norm() > 1e-12))
        fail(ErrorKind::Config, "camera model tabulated: ray {} has no length", nodes_.size());
      nodes_.push_back(ray.normalized());
    }
    check_one_to_one();
    measure_finest();
  }

  Vector3d ray_from_pixel(const Vector2d& pixel) const override {
    const Vector2d place = (pixel - first_).cwiseQuotient(step_);
    if (!is_inside(place)) return Vector3d::Constant(kNone);
    return at(place).ray.normalized();
  }

  std::optional<Vector2d> pixel_from_ray(const Vector3d& ray_camera) const override {
    const std::optional<Vector2d> place = place_of(ray_camera);
    if (!place) return std::nullopt;
    return Vector2d(first_ + place->cwiseProduct(step_));
  }

  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Vector3d& ray_camera) const override {
    return step_.asDiagonal() * place_jacobian(at(*place_of(ray_camera)), ray_camera.norm());
  }

  double finest_pixels_per_radian() const override { return finest_pixels_per_radian_; }

 private:
  bool is_inside(const Vector2d& place) const {
    return place.x() >= -0.5 && place.y() >= -0.5 && place.x() <= columns_ - 0.5 &&
           place.y() <= rows_ - 0.5;
  }

  /// Beyond the border neighbours go on as straight lines do.
  Vector3d node(int column, int row) const {
    const auto along = [](int index, int count, const auto& value) {
      if (index < 0) return Vector3d((1 - index) * value(0) + index * value(1));
      if (index >= count) {
        const int over = index - count + 1;
        return Vector3d((1 + over) * value(count - 1) - over * value(count - 2));
      }
      return Vector3d(value(index));
    };
    return along(row, rows_, [&](int j) {
      return along(column, columns_, [&](int i) { return nodes_[index(i, j)]; });
    });
  }
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  Interpolated at(const Vector2d& place) const {
    const int column = std::clamp(static_cast<int>(std::floor(place.x())), -1, columns_ - 1);
    const int row = std::clamp(static_cast<int>(std::floor(place.y())), -1, rows_ - 1);
    const CubicWeights across(place.x() - column), down(place.y() - row);
    Interpolated result{Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
    for (int j = 0; j < 4; ++j) {
      const auto b = static_cast<std::size_t>(j);
      for (int i = 0; i < 4; ++i) {
        const auto a = static_cast<std::size_t>(i);
        const Vector3d ray = node(column - 1 + i, row - 1 + j);
        result.ray += across.value[a] * down.value[b] * ray;
        result.by_column += across.slope[a] * down.value[b] * ray;
        result.by_row += across.value[a] * down.slope[b] * ray;
      }
    }
    return result;
  }

  /// d place / d ray of a ray of a length that points where the table does: of directions only what is
  /// across them moves the place.
  static Eigen::Matrix<double, 2, 3> place_jacobian(const Interpolated& there, double length) {
    // Rows of the inverse of (by_column, by_row, ray).
    const Vector3d of_column = there.by_row.cross(there.ray);
    const Vector3d of_row = there.ray.cross(there.by_column);
    const double volume = there.by_column.dot(of_column);
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << of_column.transpose(), of_row.transpose();
    return jacobian * (there.ray.norm() / (length * volume));
  }

  /// Newton's steps from the nearest node, shortened where they do not come nearer.
  std::optional<Vector2d> place_of(const Vector3d& ray_camera) const {
    const double length = ray_camera.norm();
    if (!(length > 0.0) || !std::isfinite(length)) return std::nullopt;
    const Vector3d ray = ray_camera / length;
    Vector2d place = nearest_node(ray);
    const auto miss_of = [&](const Interpolated& there) {
      return Vector3d(ray - there.ray.normalized());
    };
    Interpolated there = at(place);
    Vector3d miss = miss_of(there);
    constexpr int kMostSteps = 60;
    constexpr double kLeastShare = 1e-6;
    for (int i = 0; i < kMostSteps; ++i) {
      const Vector2d step = place_jacobian(there, 1.0) * (ray - there.ray.normalized());
      double share = 1.0;
      for (; share > kLeastShare; share *= 0.5) {
        const Vector2d next = place + share * step;
        if (!is_inside(next)) continue;
        const Interpolated next_there = at(next);
        const Vector3d next_miss = miss_of(next_there);
        if (!(next_miss.squaredNorm() < miss.squaredNorm())) continue;
        place = next;
        there = next_there;
        miss = next_miss;
        break;
      }
      if (!(share > kLeastShare)) break;
    }
    constexpr double kRounding = 1e-14;
    if (!(miss.norm() < kRounding)) return std::nullopt;
    return place;
  }

  /// By a coarse look over the table, then from node to node.
  Vector2d nearest_node(const Vector3d& ray) const {
    constexpr int kLooks = 16;
    const int stride = std::max({1, columns_ / kLooks, rows_ / kLooks});
    int column = 0, row = 0;
    double nearest = -2.0;
    const auto look = [&](int i, int j) {
      const double cosine = ray.dot(nodes_[index(i, j)]);
      if (!(cosine > nearest)) return false;
      nearest = cosine;
      column = i;
      row = j;
      return true;
    };
    for (int j = 0; j < rows_; j += stride)
      for (int i = 0; i < columns_; i += stride) look(i, j);
    for (bool has_moved = true; has_moved;) {
      has_moved = false;
      const int i0 = column, j0 = row;
      for (int j = std::max(j0 - 1, 0); j <= std::min(j0 + 1, rows_ - 1); ++j)
        for (int i = std::max(i0 - 1, 0); i <= std::min(i0 + 1, columns_ - 1); ++i)
          has_moved |= look(i, j);
    }
    return {column, row};
  }

  /// Columns to the right, rows down, looked at along the ray: everywhere the same hand.
  void check_one_to_one() const {
    constexpr int kParts = 3;
    for (int j = 0; j <= (rows_ - 1) * kParts; ++j) {
      for (int i = 0; i <= (columns_ - 1) * kParts; ++i) {
        const Vector2d place(static_cast<double>(i) / kParts, static_cast<double>(j) / kParts);
        const Interpolated there = at(place);
        if (!(there.by_column.cross(there.by_row).dot(there.ray) > 0.0))
          fail(ErrorKind::Config,
               "camera model tabulated: rays fold about column {:.1f}, row {:.1f}; x is to the "
               "right "
               "and grows with the columns, y down with the rows",
               place.x(), place.y());
      }
    }
  }

  void measure_finest() {
    constexpr int kParts = 8;
    constexpr double kBetweenLooks = 1.005;  // a table may be a little finer between two looks
    constexpr double kMostParts = 256.0;
    const auto parts = [&](int size_px, double step_px) {
      return static_cast<int>(std::min(std::ceil(size_px / step_px * kParts), kMostParts));
    };
    const int across = parts(width_px(), step_.x()), down = parts(height_px(), step_.y());
    for (int j = 0; j <= down; ++j) {
      for (int i = 0; i <= across; ++i) {
        const Vector2d pixel(width_px() * static_cast<double>(i) / across,
                             height_px() * static_cast<double>(j) / down);
        const Vector2d place = (pixel - first_).cwiseQuotient(step_);
        if (!is_inside(place)) continue;
        const Eigen::Matrix<double, 2, 3> jacobian =
            step_.asDiagonal() * place_jacobian(at(place), 1.0);
        // The rays' own part moves nothing: the largest singular value of what is left.
        const Eigen::Matrix2d square = jacobian * jacobian.transpose();
        const double middle = 0.5 * square.trace();
        finest_pixels_per_radian_ = std::max(
            finest_pixels_per_radian_,
            std::sqrt(middle + std::hypot(0.5 * (square(0, 0) - square(1, 1)), square(0, 1))));
      }
    }
    finest_pixels_per_radian_ *= kBetweenLooks;
  }

  Vector2d step_;
  Vector2d first_;
  int columns_;
  int rows_;
  std::vector<Vector3d> nodes_;
  double finest_pixels_per_radian_ = 0.0;
};

std::unique_ptr<CameraModel> make_tabulated(const CameraIntrinsics& intrinsics) {
  const std::vector<double>& p = intrinsics.parameters;
  const double num_rays = p[4] * p[5];
  if (p[4] != std::floor(p[4]) || p[5] != std::floor(p[5]) ||
      static_cast<double>(p.size()) != 6.0 + 3.0 * num_rays)
    fail(ErrorKind::Config,
         "camera model tabulated: {} columns, {} rows and {} numbers of rays; each node has three",
         p[4], p[5], p.size() - 6);
  return std::make_unique<TabulatedCamera>(intrinsics);
}

/// A text file with a line `u v x y z` for each node, row by row: an image point (px, pixel centres at
/// +0.5) and its ray (x right, y down, z forward; any length). Lines that begin with # are left out.
std::vector<double> read_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file)
    fail(ErrorKind::Io, "{}: the table of rays cannot be read: {}", path.string(),
         std::generic_category().message(errno));
  std::vector<Vector2d> places;
  std::vector<double> rays;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    double u = 0, v = 0, x = 0, y = 0, z = 0;
    if (!(words >> u >> v >> x >> y >> z))
      fail(ErrorKind::Input, "{}:{}: no line of five numbers: u v x y z", path.string(), number);
    if (places.size() >= static_cast<std::size_t>(kMost) * kMost)
      fail(ErrorKind::Input, "{}: more than {} x {} rays", path.string(), kMost, kMost);
    places.emplace_back(u, v);
    rays.insert(rays.end(), {x, y, z});
  }
  std::size_t columns = 0;
  while (columns < places.size() && places[columns].y() == places[0].y()) ++columns;
  if (columns < kFewest || places.size() % columns != 0 || places.size() / columns < kFewest)
    fail(ErrorKind::Input,
         "{}: {} rays, {} of them in the first row; a table has {} whole rows and columns or more",
         path.string(), places.size(), columns, kFewest);
  const std::size_t rows = places.size() / columns;
  const Vector2d last = places.back();
  const Vector2d step =
      (last - places[0])
          .cwiseQuotient(Vector2d(static_cast<double>(columns - 1), static_cast<double>(rows - 1)));
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Vector2d expected =
        places[0] + step.cwiseProduct(Vector2d(static_cast<double>(i % columns),
                                               static_cast<double>(i / columns)));
    constexpr double kTolerance_px = 1e-6;  // of decimals of places
    if (!((places[i] - expected).norm() <= kTolerance_px))
      fail(ErrorKind::Input,
           "{}: ray {} is at ({}, {}); of a table with equal steps it is at ({}, {})",
           path.string(), i, places[i].x(), places[i].y(), expected.x(), expected.y());
  }
  std::vector<double> parameters{step.x(),
                                 step.y(),
                                 places[0].x(),
                                 places[0].y(),
                                 static_cast<double>(columns),
                                 static_cast<double>(rows)};
  parameters.insert(parameters.end(), rays.begin(), rays.end());
  return parameters;
}

}  // namespace

CameraModelInfo tabulated_camera() {
  return {.name = "tabulated",
          .summary = "Rays at the nodes of a grid over the image, from a file.",
          .parameters = kParameters,
          .make = make_tabulated,
          .read = read_table};
}

}  // namespace terracast::geo
