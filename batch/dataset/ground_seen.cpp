#include "batch/dataset/ground_seen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "batch/dataset/ground_hull.h"
#include "capture/channel.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/parallel.h"
#include "geo/geodesy.h"
#include "geo/units.h"

namespace terracast::batch {

namespace {

using Eigen::Vector3d;

/// Over this distance a line that is straight in latitude and longitude is one on the ground, to 2 m.
constexpr double kLongestLine_m = 10000.0;

/// A move along the ground changes latitude and longitude at most as on the ellipsoid itself, but for
/// land below it, which the last percent covers.
constexpr double kMetresPerDegreeNorth = 0.99 * 110574.0;
constexpr double kMetresPerDegreeEast = 0.99 * 111319.0;  ///< at the equator

constexpr int kImagesInFlight = 32;
/// Images overlap: their runs are joined now and then, so that a long flight takes no more memory.
constexpr std::size_t kRunsBeforeJoining = 1 << 18;

/// What a pixel shows.
struct Hit {
  Vector3d point_world = Vector3d::Zero();
  GroundCell cell;
  std::optional<MapPlace> place;  ///< once it was asked for
  bool is_ground = false;
  bool is_counted = false;  ///< ground that is near enough
};

/// Gathers the cells that one image shows.
class ImageGround {
 public:
  ImageGround(const geo::WorldFrame& frame, const Vector3d& camera_world, double within_m)
      : frame_(frame), camera_world_(camera_world), within_m_(within_m) {}

  void add_image(const capture::CameraFrame& facts, const capture::CameraView& view) {
    const int width = facts.range_m.width();
    std::vector<Hit> above(static_cast<std::size_t>(width)), row(above.size());
    for (int y = 0; y < facts.range_m.height(); ++y) {
      for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = hit_of(facts, view, x, y);
      for (std::size_t x = 0; x + 1 < row.size() && y > 0; ++x)
        add_between({&above[x], &above[x + 1], &row[x], &row[x + 1]});
      std::swap(above, row);
    }
  }

  std::vector<CellRun> take() {
    join_runs(runs_);
    return std::move(runs_);
  }

 private:
  Hit hit_of(const capture::CameraFrame& facts, const capture::CameraView& view, int x, int y) {
    Hit hit;
    const auto semantic = static_cast<capture::SemanticClass>(facts.semantic_id(x, y));
    hit.is_ground = semantic != capture::SemanticClass::Sky &&
                    semantic != capture::SemanticClass::Nothing &&
                    semantic != capture::SemanticClass::Outside;
    if (!hit.is_ground) return hit;
    const auto range_m = static_cast<double>(facts.range_m(x, y));
    hit.point_world = capture::point_world(view, capture::pixel_center(x, y), range_m);
    hit.is_counted = range_m <= within_m_;
    if (!hit.is_counted) return hit;
    find_cell(hit);
    const CellRun run{hit.cell.band, hit.cell.column, 1};
    if (runs_.empty() || runs_.back() != run) runs_.push_back(run);
    return hit;
  }

  /// Most hits lie in the cell of the hit before: so near to it that they cannot be beyond the cell's
  /// border.
  void find_cell(Hit& hit) {
    if ((hit.point_world - known_world_).squaredNorm() >= known_reach_m_ * known_reach_m_) {
      const MapPlace place = place_of(hit);
      known_world_ = hit.point_world;
      known_cell_ = ground_cell_at(place.lat_deg, place.lon_deg);
      known_reach_m_ = distance_to_border_m(place, known_cell_);
    }
    hit.cell = known_cell_;
  }

  static double distance_to_border_m(const MapPlace& place, const GroundCell& cell) {
    const CellBounds bounds = bounds_of(cell);
    const double width_deg = bounds.east_deg - bounds.west_deg;
    const double from_middle_deg =
        std::remainder(place.lon_deg - (bounds.west_deg + 0.5 * width_deg), 360.0);
    const double east_m = kMetresPerDegreeEast * std::cos(geo::radians_from_degrees(place.lat_deg));
    return std::max(0.0, std::min({kMetresPerDegreeNorth * (place.lat_deg - bounds.south_deg),
                                   kMetresPerDegreeNorth * (bounds.north_deg - place.lat_deg),
                                   east_m * (0.5 * width_deg - std::abs(from_middle_deg))}));
  }

  /// The hull of the ground that four neighbouring pixels show.
  void add_between(const std::array<Hit*, 4>& hits) {
    const Hit* first = nullptr;
    bool is_within_cell = true;
    for (const Hit* hit : hits) {
      if (hit->is_counted && first == nullptr) first = hit;
      is_within_cell =
          is_within_cell && (!hit->is_ground || (hit->is_counted && hit->cell == first->cell));
    }
    if (first == nullptr || is_within_cell) return;
    lines_.clear();
    for (std::size_t i = 0; i < hits.size(); ++i)
      for (std::size_t k = i + 1; k < hits.size(); ++k) add_line(*hits[i], *hits[k]);
    if (lines_.empty()) return;
    double lowest_deg = 90.0;
    double highest_deg = -90.0;
    for (const std::pair<MapPlace, MapPlace>& line : lines_)
      for (const double lat_deg : {line.first.lat_deg, line.second.lat_deg}) {
        lowest_deg = std::min(lowest_deg, lat_deg);
        highest_deg = std::max(highest_deg, lat_deg);
      }
    hull_.start(lowest_deg, highest_deg);
    for (const std::pair<MapPlace, MapPlace>& line : lines_)
      hull_.add_line(line.first, line.second);
    hull_.append_to(runs_);
  }

  /// The part of the line between two hits that is near enough, in pieces that are short enough.
  void add_line(Hit& a, Hit& b) {
    if (!a.is_ground || !b.is_ground || (!a.is_counted && !b.is_counted)) return;
    const Vector3d from = a.is_counted ? a.point_world : last_within(b.point_world, a.point_world);
    const Vector3d to = b.is_counted ? b.point_world : last_within(a.point_world, b.point_world);
    MapPlace place = a.is_counted ? place_of(a) : place_of(from);
    const int num_pieces = 1 + static_cast<int>((to - from).norm() / kLongestLine_m);
    for (int i = 1; i < num_pieces; ++i) {
      const MapPlace next = place_of(from + (to - from) * (static_cast<double>(i) / num_pieces));
      lines_.emplace_back(place, next);
      place = next;
    }
    lines_.emplace_back(place, b.is_counted ? place_of(b) : place_of(to));
  }

  /// Where the line from a point that is near enough to one that is not leaves what is near enough.
  Vector3d last_within(const Vector3d& near_world, const Vector3d& far_world) const {
    const Vector3d along = far_world - near_world;
    const Vector3d from_camera = near_world - camera_world_;
    // |from_camera + t along| = within_m; the larger root.
    const double a = along.squaredNorm();
    const double b = from_camera.dot(along);
    const double c = from_camera.squaredNorm() - within_m_ * within_m_;
    const double t = (-b + std::sqrt(std::max(b * b - a * c, 0.0))) / a;
    return near_world + std::clamp(t, 0.0, 1.0) * along;
  }

  /// Longitudes of one world's neighbourhood, counted on from its origin's.
  MapPlace place_of(const Vector3d& point_world) const {
    const geo::Geodetic place = frame_.geodetic_from_world(point_world);
    const double origin_deg = frame_.origin().lon_deg;
    return {place.lat_deg, origin_deg + std::remainder(place.lon_deg - origin_deg, 360.0)};
  }

  MapPlace place_of(Hit& hit) const {
    if (!hit.place) hit.place = place_of(hit.point_world);
    return *hit.place;
  }

  const geo::WorldFrame& frame_;
  Vector3d camera_world_;
  double within_m_;
  Vector3d known_world_ = Vector3d::Zero();
  double known_reach_m_ = 0.0;  ///< no place this near to known_world_ is outside known_cell_
  GroundCell known_cell_;
  std::vector<std::pair<MapPlace, MapPlace>> lines_;
  GroundHull hull_;
  std::vector<CellRun> runs_;
};

}  // namespace

std::string ground_identity(const world::WorldManifest& manifest) {
  const bool is_measured =
      std::any_of(manifest.sources.begin(), manifest.sources.end(),
                  [](const world::SourceInfo& source) { return source.kind == "raster"; });
  return is_measured ? "earth" : manifest.input_hash;
}

GroundSeen ground_seen(const capture::SequenceReader& sequence, const GroundOptions& options) {
  if (!(options.within_m > 0.0))
    core::fail(core::ErrorKind::Config,
               "ground within {} m of the camera cannot be seen; give more than 0",
               options.within_m);
  const capture::SequenceInfo& info = sequence.info();
  const geo::WorldFrame frame(info.origin);
  std::vector<std::unique_ptr<geo::CameraModel>> models;
  for (const capture::CameraCalibration& camera : info.cameras)
    models.push_back(geo::make_camera(camera.intrinsics));

  const auto num_cameras = static_cast<std::int64_t>(info.cameras.size());
  std::vector<std::vector<CellRun>> in_flight(kImagesInFlight);
  const auto slot = [&](std::int64_t image) -> std::vector<CellRun>& {
    return in_flight[static_cast<std::size_t>(image % kImagesInFlight)];
  };
  std::vector<CellRun> runs;
  std::size_t num_joined = 0;
  core::parallel_in_order(
      info.num_frames * num_cameras, kImagesInFlight,
      [&](std::int64_t image) {
        const int index = static_cast<int>(image / num_cameras);
        const int camera = static_cast<int>(image % num_cameras);
        const capture::CameraView view =
            sequence.view(*models[static_cast<std::size_t>(camera)], index, camera);
        ImageGround ground(frame, view.world_from_camera.translation, options.within_m);
        ground.add_image(sequence.read_camera(index, camera, capture::SequenceReader::kFacts),
                         view);
        slot(image) = ground.take();
      },
      [&](std::int64_t image) {
        runs.insert(runs.end(), slot(image).begin(), slot(image).end());
        if (runs.size() < 2 * num_joined + kRunsBeforeJoining) return;
        join_runs(runs);
        num_joined = runs.size();
      });
  join_runs(runs);
  return {.ground = options.ground, .within_m = options.within_m, .runs = std::move(runs)};
}

}  // namespace terracast::batch
