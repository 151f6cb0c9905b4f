#include "validate/page_ground.h"

#include <algorithm>
#include <cmath>

#include "validate/page_values.h"

namespace terracast::validate {

namespace {

/// A point of the ground and its colour.
struct GroundPoint {
  Eigen::Vector3d local;
  std::array<std::uint8_t, 3> color{190, 190, 190};
};

/// Calls `take` with every stride-th pixel that has depth and is not too far.
template <class Take>
void for_each_point(const PageImage& image, const Intrinsics& camera, std::size_t stride,
                    std::size_t& phase, const Take& take) {
  if (image.depth.empty() || !image.local_from_camera) return;
  const bool has_color = image.color.width() == image.width && image.color.height() == image.height;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const auto depth_m = static_cast<double>(image.depth(x, y));
      if (!(depth_m <= kFarDepths * image.median_depth_m)) continue;
      if (phase++ % stride != 0) continue;
      const Eigen::Vector2d pixel(image.step * x + image.step / 2 + 0.5,
                                  image.step * y + image.step / 2 + 0.5);
      GroundPoint point;
      point.local = local_point(image, camera, pixel, camera.point_from_pixel(pixel, depth_m));
      if (!point.local.allFinite()) continue;
      if (has_color)
        for (int c = 0; c < 3; ++c) point.color[static_cast<std::size_t>(c)] = image.color(x, y, c);
      take(point);
    }
}

const Intrinsics& intrinsics_of(const Sequence& sequence, const PageImage& image) {
  return sequence.cameras[static_cast<std::size_t>(image.place.camera)].intrinsics;
}

/// A cell of the relief.
struct Cell {
  double height_m = 0.0;
  std::array<double, 3> color{};
  double count = 0.0;
  void operator+=(const Cell& other) {
    height_m += other.height_m;
    for (std::size_t c = 0; c < 3; ++c) color[c] += other.color[c];
    count += other.count;
  }
  void divide() {
    if (count <= 0.0) return;
    height_m /= count;
    for (double& c : color) c /= count;
    count = 1.0;
  }
};

}  // namespace

std::optional<MapArea> area_of(const Sequence& sequence,
                               const std::vector<const PageImage*>& images) {
  Eigen::AlignedBox2d box;
  constexpr double kFarthest_m = 1e8;
  for (const Camera& camera : sequence.cameras)
    for (const auto& pose : camera.local_from_camera)
      if (pose && pose->translation.allFinite() && pose->translation.norm() < kFarthest_m)
        box.extend(pose->translation.head<2>().eval());
  // Of the footprints' corners the outermost few would leave too little room for all others.
  std::array<std::vector<double>, 2> places;
  for (const PageImage* image : images)
    for (const Eigen::Vector3d& point : image->footprint)
      if (point.allFinite() && point.norm() < kFarthest_m)
        for (std::size_t axis = 0; axis < 2; ++axis)
          places[axis].push_back(point[static_cast<int>(axis)]);
  if (!places[0].empty()) {
    Eigen::Vector2d low, high;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::sort(places[axis].begin(), places[axis].end());
      const std::size_t cut = places[axis].size() / 50;
      low[static_cast<int>(axis)] = places[axis][cut];
      high[static_cast<int>(axis)] = places[axis][places[axis].size() - 1 - cut];
    }
    box.extend(low);
    box.extend(high);
  }
  if (box.isEmpty()) return std::nullopt;
  const double longer_m = std::max(box.sizes().maxCoeff(), 1.0);
  // No side shorter than half the other: a flight along a line has a map too.
  const Eigen::Vector2d half =
      (0.5 * box.sizes()).cwiseMax(Eigen::Vector2d::Constant(0.25 * longer_m)) +
      Eigen::Vector2d::Constant(0.06 * longer_m);
  const Eigen::Vector2d centre = box.center();
  return MapArea{sequence.origin.lat_deg, sequence.origin.lon_deg, sequence.origin.height_m,
                 centre.x() - half.x(),   centre.x() + half.x(),   centre.y() - half.y(),
                 centre.y() + half.y()};
}

std::optional<GroundPicture> relief_of(const std::vector<const PageImage*>& images,
                                       const Sequence& sequence, const MapArea& area) {
  const double width_m = area.east_m - area.west_m;
  const double height_m = area.north_m - area.south_m;
  std::vector<GroundPoint> points;
  std::size_t phase = 0;
  for (const PageImage* image : images)
    for_each_point(*image, intrinsics_of(sequence, *image), 1, phase,
                   [&](const GroundPoint& point) {
                     if (point.local.x() > area.west_m && point.local.x() < area.east_m &&
                         point.local.y() > area.south_m && point.local.y() < area.north_m)
                       points.push_back(point);
                   });
  constexpr std::size_t kEnough = 100;
  if (points.size() < kEnough) return std::nullopt;
  constexpr double kMostCells = 640.0;
  constexpr double kPointsACell = 2.0;
  const double cell_m =
      std::max(std::max(width_m, height_m) / kMostCells,
               std::sqrt(kPointsACell * width_m * height_m / static_cast<double>(points.size())));
  const int width = std::max(2, static_cast<int>(width_m / cell_m));
  const int height = std::max(2, static_cast<int>(height_m / cell_m));
  std::vector<Cell> cells(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto at = [&](int x, int y) -> Cell& {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                 static_cast<std::size_t>(x)];
  };
  for (const GroundPoint& point : points) {
    Cell& cell =
        at(std::clamp(static_cast<int>((point.local.x() - area.west_m) / width_m * width), 0,
                      width - 1),
           std::clamp(static_cast<int>((area.north_m - point.local.y()) / height_m * height), 0,
                      height - 1));
    Cell one{point.local.z(), {}, 1.0};
    for (std::size_t c = 0; c < 3; ++c) one.color[c] = point.color[c];
    cell += one;
  }
  for (Cell& cell : cells) cell.divide();
  // Holes of a cell or three, which the far ends of images leave.
  for (int pass = 0; pass < 3; ++pass) {
    const std::vector<Cell> before = cells;
    for (int y = 1; y + 1 < height; ++y)
      for (int x = 1; x + 1 < width; ++x) {
        if (at(x, y).count > 0.0) continue;
        Cell sum;
        for (int dy = -1; dy <= 1; ++dy)
          for (int dx = -1; dx <= 1; ++dx)
            sum += before[static_cast<std::size_t>(y + dy) * static_cast<std::size_t>(width) +
                          static_cast<std::size_t>(x + dx)];
        if (sum.count < 3.0) continue;
        sum.divide();
        at(x, y) = sum;
      }
  }
  GroundPicture picture{core::Image8(width, height, 4), area};
  const Eigen::Vector3d light = Eigen::Vector3d(-1.0, 1.0, 1.2).normalized();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Cell& cell = at(x, y);
      if (cell.count <= 0.0) continue;
      const auto height_at = [&](int i, int j) {
        const Cell& other = at(std::clamp(i, 0, width - 1), std::clamp(j, 0, height - 1));
        return other.count > 0.0 ? other.height_m : cell.height_m;
      };
      const double east = (height_at(x + 1, y) - height_at(x - 1, y)) / (2.0 * width_m / width);
      const double north = (height_at(x, y - 1) - height_at(x, y + 1)) / (2.0 * height_m / height);
      const double shade =
          std::max(Eigen::Vector3d(-east, -north, 1.0).normalized().dot(light), 0.0);
      for (int c = 0; c < 3; ++c) {
        // Half of the ground's own colour, half a light grey: the relief must stay readable.
        const double color = 0.5 * cell.color[static_cast<std::size_t>(c)] + 105.0;
        picture.image(x, y, c) =
            static_cast<std::uint8_t>(std::clamp(color * (0.35 + 0.95 * shade), 0.0, 255.0));
      }
      picture.image(x, y, 3) = 255;
    }
  return picture;
}

core::Json cloud_of(const std::vector<const PageImage*>& images, const Sequence& sequence,
                    std::size_t most) {
  std::size_t num_points = 0;
  std::size_t phase = 0;
  for (const PageImage* image : images)
    for_each_point(*image, intrinsics_of(sequence, *image), 1, phase,
                   [&](const GroundPoint&) { ++num_points; });
  const std::size_t stride = std::max<std::size_t>(1, (num_points + most - 1) / most);
  // About the middle of the cameras, where a float's steps are smallest.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double num_poses = 0.0;
  for (const PageImage* image : images)
    if (image->local_from_camera) {
      origin += image->local_from_camera->translation;
      num_poses += 1.0;
    }
  if (num_poses > 0.0) origin /= num_poses;
  std::array<std::vector<float>, 3> positions;
  std::array<std::vector<std::uint8_t>, 3> colors;
  phase = 0;
  for (const PageImage* image : images)
    for_each_point(
        *image, intrinsics_of(sequence, *image), stride, phase, [&](const GroundPoint& point) {
          for (std::size_t k = 0; k < 3; ++k) {
            positions[k].push_back(
                static_cast<float>(point.local[static_cast<int>(k)] - origin[static_cast<int>(k)]));
            colors[k].push_back(point.color[k]);
          }
        });
  std::vector<float> all_positions;
  std::vector<std::uint8_t> all_colors;
  for (std::size_t k = 0; k < 3; ++k) {
    all_positions.insert(all_positions.end(), positions[k].begin(), positions[k].end());
    all_colors.insert(all_colors.end(), colors[k].begin(), colors[k].end());
  }
  return core::Json::object()
      .set("count", static_cast<std::uint64_t>(positions[0].size()))
      .set("num_pixels", static_cast<std::uint64_t>(num_points))
      .set("origin", core::Json::array_of({origin.x(), origin.y(), origin.z()}))
      .set("positions", packed(all_positions))
      .set("colors", packed(all_colors));
}

}  // namespace terracast::validate
