#include "sensors/camera/tracks.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.h"
#include "core/thread_crew.h"
#include "geo/units.h"
#include "sensors/camera/sight.h"

namespace terracast::sensors {
namespace {

constexpr int kMaxRounds = 8;
// Of the images that have a point within their borders, as many are asked by ray, evenly over the
// sequence.
constexpr std::size_t kAskedImages = 16;
constexpr int kWantedImages = 3;
/// How many candidates are graded together: large enough that they share loads of tiles, small enough for four blocks a
/// processor and a megabyte of rays.
constexpr std::int64_t kLeastBlock = 64, kMostBlock = 512;
constexpr std::int64_t kBlocksOfAProcessor = 4;
const double kWantedParallax_rad = geo::radians_from_degrees(0.5);
constexpr std::uint64_t kStream = 0x747261636b73;  // "tracks"

/// How good a candidate is for triangulation.
using Grade = std::size_t;
constexpr Grade kUnseen = 0;
constexpr Grade kSeenOnce = 1;
constexpr Grade kSeenTwice = 2;
constexpr Grade kSeenOften = 3;
constexpr Grade kWellSeen = 4;
constexpr std::size_t kNumGrades = 5;

struct Candidate {
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();
  Grade grade = kUnseen;
};

/// The ray of candidate `number`: views are taken in turn by the golden ratio, so that any run of
/// candidates is spread over the sequence; the place in the image is random.
world::WorldRay candidate_ray(const ViewTable& views, std::uint64_t number, std::uint64_t seed) {
  const int num_views = views.num_frames() * views.num_cameras();
  const double turn = 0.6180339887498949 * static_cast<double>(number) + 0.5;
  const int index = static_cast<int>((turn - std::floor(turn)) * num_views);
  const View& view = views.at(index / views.num_cameras(), index % views.num_cameras());
  const Eigen::Vector2d pixel(
      core::random_unit(seed, kStream, 2 * number) * view.model->width_px(),
      core::random_unit(seed, kStream, 2 * number + 1) * view.model->height_px());
  const Eigen::Vector3d ray = view.ray_world(pixel);
  if (ray.allFinite()) return {.origin_world = view.origin_world(pixel), .direction_world = ray};
  // Beyond the image circle: nothing is asked for.
  return {.origin_world = view.center_world,
          .direction_world = view.world_from_camera.col(2),
          .t_max = 0.0};
}

Grade grade_of(const std::vector<Eigen::Vector3d>& directions) {
  if (directions.size() < 3) return directions.size();
  double widest = 1.0;
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) widest = std::min(widest, directions[i].dot(directions[j]));
  return std::acos(std::clamp(widest, -1.0, 1.0)) >= kWantedParallax_rad ? kWellSeen : kSeenOften;
}

/// Casts the rays of candidates [begin, end) and asks the views that could see their hits.
void grade_candidates(const world::RayQuery& query, const ViewTable& views, std::uint64_t seed,
                      std::uint64_t first_number, std::int64_t begin, std::int64_t end,
                      std::vector<Candidate>& candidates) {
  std::vector<world::WorldRay> rays;
  for (std::int64_t i = begin; i < end; ++i)
    rays.push_back(candidate_ray(views, first_number + static_cast<std::uint64_t>(i), seed));
  std::vector<world::SurfaceHit> hits(rays.size());
  query.intersect(rays, hits, world::Coherence::Incoherent);

  // All candidates' rays at once: they share the tiles.
  std::vector<world::WorldRay> sights;
  std::vector<std::size_t> ends;  // of each candidate's sights
  std::vector<const View*> in_image;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    ends.push_back(sights.size());
    if (hits[i].is_sky()) continue;
    Candidate& candidate = candidates[static_cast<std::size_t>(begin) + i];
    candidate.point_world = rays[i].origin_world + hits[i].t * rays[i].direction_world;
    in_image.clear();
    for (int frame = 0; frame < views.num_frames(); ++frame)
      for (int camera = 0; camera < views.num_cameras(); ++camera)
        if (views.at(frame, camera).has_in_image(candidate.point_world))
          in_image.push_back(&views.at(frame, camera));
    const std::size_t num_asked = std::min(in_image.size(), kAskedImages);
    for (std::size_t k = 0; k < num_asked; ++k) {
      const View& view = *in_image[k * in_image.size() / num_asked];
      const Eigen::Vector3d origin = view.origin_toward(candidate.point_world);
      sights.push_back({.origin_world = origin,
                        .direction_world = candidate.point_world - origin,
                        .t_min = 0.0,
                        .t_max = 1.0 + 1e-6});
    }
    ends.back() = sights.size();
  }
  std::vector<world::SurfaceHit> sight_hits(sights.size());
  query.intersect(sights, sight_hits, world::Coherence::Incoherent);

  std::vector<Eigen::Vector3d> directions;
  std::size_t sight = 0;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    directions.clear();
    for (; sight < ends[i]; ++sight)
      if (is_at_point(sight_hits[sight].t))
        directions.push_back(sights[sight].direction_world.normalized());
    if (!hits[i].is_sky())
      candidates[static_cast<std::size_t>(begin) + i].grade = grade_of(directions);
  }
}

}  // namespace

void TrackOptions::describe(core::SchemaVisitor& visit) {
  visit.key("num_points", num_points, "Points of the ground that are followed through a sequence.",
            core::between(0, 1e6));
}

std::vector<capture::TrackPoint> choose_tracks(const world::RayQuery& query, const ViewTable& views,
                                               std::int64_t num_points, std::uint64_t seed,
                                               const core::Log& log) {
  std::vector<Candidate> all;
  std::array<std::int64_t, kNumGrades> count{};
  const std::int64_t num_a_round = std::max<std::int64_t>(num_points, 64);
  const std::int64_t block_size =
      std::clamp(num_a_round / (kBlocksOfAProcessor * core::num_threads_allowed()), kLeastBlock,
                 kMostBlock);
  for (int round = 0; round < kMaxRounds && count[kWellSeen] < num_points; ++round) {
    std::vector<Candidate> candidates(static_cast<std::size_t>(num_a_round));
    query.run_units((num_a_round - 1) / block_size + 1, [&](std::int64_t block) {
      const std::int64_t begin = block * block_size;
      grade_candidates(query, views, seed, static_cast<std::uint64_t>(all.size()), begin,
                       std::min(begin + block_size, num_a_round), candidates);
    });
    for (const Candidate& candidate : candidates) ++count[candidate.grade];
    all.insert(all.end(), candidates.begin(), candidates.end());
  }
  // How many of each grade to take, the best first.
  std::array<std::int64_t, kNumGrades> wanted{};
  std::int64_t left = num_points;
  for (const Grade grade : {kWellSeen, kSeenOften, kSeenTwice, kSeenOnce}) {
    wanted[grade] = std::min(left, count[grade]);
    left -= wanted[grade];
  }
  std::vector<capture::TrackPoint> tracks;
  for (const Candidate& candidate : all) {
    if (wanted[candidate.grade] == 0) continue;
    --wanted[candidate.grade];
    tracks.push_back(
        {.id = static_cast<std::int64_t>(tracks.size()), .point_world = candidate.point_world});
  }
  if (left > 0) {
    log.warn("only {} of {} track points found: the images show too little ground", tracks.size(),
             num_points);
  } else if (count[kWellSeen] < num_points) {
    log.info("{} of {} track points are seen by fewer than {} images or at less than 0.5 degrees",
             num_points - count[kWellSeen], num_points, kWantedImages);
  }
  return tracks;
}

}  // namespace terracast::sensors
