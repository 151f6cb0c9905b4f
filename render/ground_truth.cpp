#include "render/ground_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/channel.h"
#include "core/parallel.h"
#include "render/pixel_blocks.h"
#include "render/scratch_pool.h"

namespace terracast::render {
namespace {

constexpr int kUnitSide = 32;
constexpr std::size_t kUnitRays = static_cast<std::size_t>(kUnitSide) * kUnitSide;

/// A view that shall say whether it sees a pixel's point, and the bit that says so.
struct Target {
  const View* view;
  std::uint32_t flag;
};

struct UnitScratch {
  std::vector<world::WorldRay> rays;
  std::vector<world::SurfaceHit> hits;
  std::vector<world::SurfaceSample> surfaces;  ///< of the pixels' own rays
  std::vector<std::size_t> pixels;             ///< of the rays
  std::vector<std::size_t> ground;             ///< rays that met the ground
  std::vector<std::size_t> ground_pixels;
  std::vector<geo::VectorBlock> ground_points;  ///< the last point fills the last block
  GroundPacket packet;
  Lanes<std::uint8_t> classes;

  UnitScratch() {
    rays.reserve(kUnitRays);
    hits.reserve(kUnitRays);
    surfaces.reserve(kUnitRays);
    pixels.reserve(kUnitRays);
    ground.reserve(kUnitRays);
    ground_pixels.reserve(kUnitRays);
    ground_points.reserve(kUnitRays / geo::VectorBlock::kVectors);
  }
  void cast_pixels(const world::RayQuery& query) {
    hits.resize(rays.size());
    surfaces.resize(rays.size());
    query.intersect(rays, hits, world::Coherence::Coherent, surfaces);
  }
  std::span<const world::SurfaceHit> cast(const world::RayQuery& query) {
    hits.resize(rays.size());
    query.intersect(rays, hits, world::Coherence::Coherent);
    return hits;
  }
};

world::WorldRay ray_to(const View& view, const Eigen::Vector3d& point_world) {
  // A little beyond the point, so that the crossing at it is within.
  return {.origin_world = view.center_world,
          .direction_world = point_world - view.center_world,
          .t_min = 0.0,
          .t_max = 1.0 + 1e-6};
}

bool is_at_point(const world::SurfaceHit& hit) {
  return std::abs(hit.t - 1.0) <= kSamePointRelative;
}

/// One camera's image at one frame.
class TruthTracer {
 public:
  TruthTracer(const world::RayQuery& query, const Ground& ground, const ViewTable& views, int frame,
              int camera, TruthFrame& truth)
      : query_(query),
        ground_(ground),
        view_(views.at(frame, camera)),
        grid_{view_.model->width_px(), view_.model->height_px(), kUnitSide},
        truth_(truth) {
    if (frame + 1 < views.num_frames())
      targets_.push_back({&views.at(frame + 1, camera), capture::kVisibleNext});
    if (frame > 0) targets_.push_back({&views.at(frame - 1, camera), capture::kVisiblePrevious});
    for (const int other : views.companions(camera))
      targets_.push_back({&views.at(frame, other), capture::visible_in_camera(other)});

    const int width = grid_.width_px;
    const int height = grid_.height_px;
    const std::size_t num_pixels =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    truth_.range_m.assign(num_pixels, std::numeric_limits<double>::infinity());
    truth_.point_world.assign(num_pixels, Eigen::Vector3d::Zero());
    capture::CameraFrame& facts = truth_.facts;
    facts.range_m.assign(width, height, 1, capture::kSkyRange_m);
    facts.normal_world.assign(width, height, 3, 0.0f);
    facts.semantic_id.assign(width, height, 1,
                             static_cast<std::uint32_t>(capture::SemanticClass::Sky));
    facts.instance_id.assign(width, height, 1, 0u);
    facts.primitive_id.assign(width, height, 1, capture::kNoPrimitive);
    facts.flags.assign(width, height, 1, 0u);
  }

  void trace() {
    core::parallel_for_blocks(grid_.num_units(), 1, [&](std::int64_t begin, std::int64_t) {
      ScratchPool<UnitScratch>::Lease scratch(pool_);
      trace_unit(grid_.unit(begin), *scratch);
    });
    mark_edges();
  }

 private:
  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width_px) +
           static_cast<std::size_t>(x);
  }
  bool is_sky(std::size_t pixel) const { return std::isinf(truth_.range_m[pixel]); }

  void trace_unit(const PixelUnit& unit, UnitScratch& scratch) {
    scratch.rays.clear();
    scratch.pixels.clear();
    for_each_pixel(unit, [&](int x, int y) {
      scratch.rays.push_back({.origin_world = view_.center_world,
                              .direction_world = view_.ray_world({x + 0.5, y + 0.5})});
      scratch.pixels.push_back(pixel_index(x, y));
    });
    scratch.cast_pixels(query_);
    scratch.ground.clear();
    const std::span<float> normals = truth_.facts.normal_world.data();
    for (std::size_t i = 0; i < scratch.rays.size(); ++i) {
      const world::SurfaceHit& hit = scratch.hits[i];
      if (hit.is_sky()) continue;
      const world::WorldRay& ray = scratch.rays[i];
      const std::size_t pixel = scratch.pixels[i];
      const double range_m = hit.t * ray.direction_world.norm();
      truth_.range_m[pixel] = range_m;
      truth_.point_world[pixel] = ray.origin_world + hit.t * ray.direction_world;
      truth_.facts.range_m.data()[pixel] = static_cast<float>(range_m);
      truth_.facts.primitive_id.data()[pixel] = primitive_id(hit);
      const Eigen::Vector3d normal = hit.normal_world();
      for (std::size_t k = 0; k < 3; ++k)
        normals[3 * pixel + k] = static_cast<float>(normal[static_cast<int>(k)]);
      scratch.ground.push_back(i);
    }
    classify(scratch);
    keep_ground(scratch);
    for (const Target& target : targets_) see_from(target, scratch);
  }

  /// scratch.ground: rays that met the ground.
  void classify(UnitScratch& scratch) {
    const std::span<std::uint32_t> semantic = truth_.facts.semantic_id.data();
    for (std::size_t begin = 0; begin < scratch.ground.size(); begin += kLanes) {
      const std::size_t count = std::min<std::size_t>(kLanes, scratch.ground.size() - begin);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const std::size_t i = scratch.ground[begin + std::min(lane, count - 1)];
        const world::SurfaceHit& hit = scratch.hits[i];
        const Eigen::Vector3d& point = truth_.point_world[scratch.pixels[i]];
        ground_.set(scratch.packet, static_cast<int>(lane), point, hit.normal_world(),
                    scratch.surfaces[i], 0.0);
      }
      ground_.classify(scratch.packet, scratch.classes);
      for (std::size_t lane = 0; lane < count; ++lane)
        semantic[scratch.pixels[scratch.ground[begin + lane]]] =
            scratch.classes[static_cast<int>(lane)];
    }
  }

  /// Sets ground_pixels and ground_points: rays and pixels are used again for the visibility rays.
  void keep_ground(UnitScratch& scratch) const {
    constexpr std::size_t kBlock = geo::VectorBlock::kVectors;
    scratch.ground_pixels.clear();
    for (const std::size_t i : scratch.ground) scratch.ground_pixels.push_back(scratch.pixels[i]);
    scratch.ground_points.resize((scratch.ground.size() + kBlock - 1) / kBlock);
    for (std::size_t i = 0; i < scratch.ground_points.size() * kBlock; ++i) {
      const std::size_t pixel = scratch.ground_pixels[std::min(i, scratch.ground.size() - 1)];
      const Eigen::Vector3d& point = truth_.point_world[pixel];
      geo::VectorBlock& block = scratch.ground_points[i / kBlock];
      block.x[i % kBlock] = point.x();
      block.y[i % kBlock] = point.y();
      block.z[i % kBlock] = point.z();
    }
  }

  void see_from(const Target& target, UnitScratch& scratch) {
    scratch.rays.clear();
    scratch.pixels.clear();
    for (std::size_t block = 0; block < scratch.ground_points.size(); ++block) {
      const std::size_t first = block * geo::VectorBlock::kVectors;
      const std::size_t count =
          std::min<std::size_t>(geo::VectorBlock::kVectors, scratch.ground_pixels.size() - first);
      const std::uint32_t in_image = target.view->find_in_image(scratch.ground_points[block]);
      for (std::size_t i = 0; i < count; ++i) {
        if (((in_image >> i) & 1U) == 0) continue;
        const std::size_t pixel = scratch.ground_pixels[first + i];
        scratch.rays.push_back(ray_to(*target.view, truth_.point_world[pixel]));
        scratch.pixels.push_back(pixel);
      }
    }
    const std::span<const world::SurfaceHit> hits = scratch.cast(query_);
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (is_at_point(hits[i])) truth_.facts.flags.data()[scratch.pixels[i]] |= target.flag;
  }

  /// Only a pixel beside the horizon can change between ground and sky within a thousandth of a
  /// pixel: terrain is one object, and a gap narrower than a pixel that no centre meets has no
  /// neighbour that tells of it.
  void mark_edges() {
    const std::vector<std::size_t> candidates = pixels_beside_horizon();
    static constexpr double kShifts[4][2] = {
        {-kEdgeShift_px, 0.0}, {kEdgeShift_px, 0.0}, {0.0, -kEdgeShift_px}, {0.0, kEdgeShift_px}};
    core::parallel_for_blocks(
        static_cast<std::int64_t>(candidates.size()), kUnitRays / 4,
        [&](std::int64_t begin, std::int64_t end) {
          ScratchPool<UnitScratch>::Lease lease(pool_);
          UnitScratch& scratch = *lease;
          scratch.rays.clear();
          for (std::int64_t i = begin; i < end; ++i) {
            const std::size_t pixel = candidates[static_cast<std::size_t>(i)];
            const auto width = static_cast<std::size_t>(grid_.width_px);
            const std::size_t x = pixel % width;
            const std::size_t y = pixel / width;
            const Eigen::Vector2d center(static_cast<double>(x) + 0.5,
                                         static_cast<double>(y) + 0.5);
            for (const auto& shift : kShifts) {
              const Eigen::Vector2d place = center + Eigen::Vector2d(shift[0], shift[1]);
              scratch.rays.push_back(
                  {.origin_world = view_.center_world, .direction_world = view_.ray_world(place)});
            }
          }
          const std::span<const world::SurfaceHit> hits = scratch.cast(query_);
          for (std::size_t i = 0; i < hits.size(); ++i) {
            const std::size_t pixel = candidates[static_cast<std::size_t>(begin) + i / 4];
            if (hits[i].is_sky() != is_sky(pixel))
              truth_.facts.flags.data()[pixel] |= capture::kEdge;
          }
        });
  }

  /// Pixels with a neighbour that is sky while they are ground, or the other way round.
  std::vector<std::size_t> pixels_beside_horizon() const {
    const auto width = static_cast<std::size_t>(grid_.width_px);
    const auto height = static_cast<std::size_t>(grid_.height_px);
    std::vector<std::uint8_t> sky(width * height);
    for (std::size_t i = 0; i < sky.size(); ++i) sky[i] = is_sky(i) ? 1 : 0;
    std::vector<std::size_t> pixels;
    std::vector<std::uint8_t> num_sky(width);  // of the rows around, in each column
    for (std::size_t y = 0; y < height; ++y) {
      const std::size_t first = y > 0 ? y - 1 : y;
      const std::size_t last = std::min(y + 1, height - 1);
      std::fill(num_sky.begin(), num_sky.end(), std::uint8_t{0});
      for (std::size_t row = first; row <= last; ++row)
        for (std::size_t x = 0; x < width; ++x)
          num_sky[x] = static_cast<std::uint8_t>(num_sky[x] + sky[row * width + x]);
      const auto all = static_cast<std::uint8_t>(last - first + 1);
      for (std::size_t x = 0; x < width; ++x) {
        const std::uint8_t same = sky[y * width + x] != 0 ? all : 0;
        if (num_sky[x] != same || num_sky[x > 0 ? x - 1 : x] != same ||
            num_sky[std::min(x + 1, width - 1)] != same)
          pixels.push_back(y * width + x);
      }
    }
    return pixels;
  }

  const world::RayQuery& query_;
  const Ground& ground_;
  const View& view_;
  const PixelGrid grid_;
  TruthFrame& truth_;
  std::vector<Target> targets_;
  ScratchPool<UnitScratch> pool_;
};

}  // namespace

void trace_truth(const world::RayQuery& query, const Ground& ground, const ViewTable& views,
                 int frame, int camera, TruthFrame& truth) {
  TruthTracer(query, ground, views, frame, camera, truth).trace();
}

std::vector<std::uint8_t> visible_in_view(const world::RayQuery& query, const View& view,
                                          std::span<const Eigen::Vector3d> points_world) {
  std::vector<std::uint8_t> is_visible(points_world.size(), 0);
  core::parallel_for_blocks(static_cast<std::int64_t>(points_world.size()), kUnitRays,
                            [&](std::int64_t begin, std::int64_t end) {
                              std::vector<world::WorldRay> rays;
                              std::vector<std::size_t> points;
                              for (auto i = static_cast<std::size_t>(begin);
                                   i < static_cast<std::size_t>(end); ++i) {
                                if (!view.has_in_image(points_world[i])) continue;
                                rays.push_back(ray_to(view, points_world[i]));
                                points.push_back(i);
                              }
                              std::vector<world::SurfaceHit> hits(rays.size());
                              query.intersect(rays, hits, world::Coherence::Incoherent);
                              for (std::size_t i = 0; i < hits.size(); ++i)
                                is_visible[points[i]] = is_at_point(hits[i]) ? 1 : 0;
                            });
  return is_visible;
}

}  // namespace terracast::render
