#include "sensors/camera/ground_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "capture/channel.h"
#include "core/lanes.h"
#include "core/packet_code.h"
#include "core/scratch_pool.h"
#include "scene/ground/marking.h"
#include "scene/light/directions.h"
#include "sensors/camera/pixel_blocks.h"
#include "sensors/camera/sight.h"
#include "sensors/camera/unit_rays.h"

namespace terracast::sensors {
namespace {

/// Where a ray that is shifted for the edge test ends at first, as a share of the pixel's range: a surface that is
/// seen by pixels of a milliradian does not lie farther there unless it is seen within half a degree of edgewise.
constexpr double kEdgeReach = 1.0 + 1e-4;

/// Units of an image: squares, or parts of lines where these are exposed one after the other, so that all
/// rays of a unit are of one time.
PixelGrid grid_of(const OpenView& view) {
  const int width_px = view.middle.model->width_px();
  const int height_px = view.middle.model->height_px();
  if (!view.is_rolling()) return PixelGrid::of_squares(width_px, height_px, kUnitSide);
  constexpr int kLength = kUnitSide * kUnitSide;
  return view.motion.shutter.has_columns() ? PixelGrid{width_px, height_px, 1, kLength}
                                           : PixelGrid{width_px, height_px, kLength, 1};
}

/// Points, normals (as SurfaceHit::normal_world) and ranges of hits of rays from one origin.
TERRACAST_PACKET_CODE void place_hits(const double* origin_world, const HitPacket& hits,
                                      core::Lanes<double>& __restrict range_m,
                                      scene::GroundPlaces& __restrict places) {
  const double origin_x = origin_world[0];
  const double origin_y = origin_world[1];
  const double origin_z = origin_world[2];
  for (int i = 0; i < core::kLanes; ++i) {
    const double x = hits.direction_world[0][i];
    const double y = hits.direction_world[1][i];
    const double z = hits.direction_world[2][i];
    const double t = hits.t[i];
    range_m[i] = t * std::sqrt(x * x + y * y + z * z);
    places.point_world[0][i] = origin_x + t * x;
    places.point_world[1][i] = origin_y + t * y;
    places.point_world[2][i] = origin_z + t * z;
  }
  for (int i = 0; i < core::kLanes; ++i) {
    const double x = hits.slope_x[i];
    const double y = hits.slope_y[i];
    const double shrink = 1.0 / std::sqrt(x * x + y * y + 1.0);
    places.normal_world[0][i] = -x * shrink;
    places.normal_world[1][i] = -y * shrink;
    places.normal_world[2][i] = shrink;
  }
}

/// One camera's image at one frame.
class TruthTracer {
 public:
  TruthTracer(const world::RayQuery& query, const scene::MovingBodies& moving,
              const scene::Ground& ground, const ViewTable& views, int frame, int camera,
              TruthFrame& truth, world::RayTrail* trail, const world::RayQuery* bed,
              std::uint32_t flags)
      : query_(query),
        bed_(bed),
        ground_(ground),
        view_(views.open(frame, camera)),
        grid_(grid_of(view_)),
        units_(grid_.units_by_place()),
        truth_(truth),
        trail_(trail),
        has_edges_((flags & capture::kEdge) != 0) {
    set_moving(moving, views, frame);
    const auto add_target = [&](int at, int by, std::uint32_t flag) {
      if ((flags & flag) != 0) targets_.push_back({views.open(at, by), at, flag, scene_at(at)});
    };
    if (frame + 1 < views.num_frames()) add_target(frame + 1, camera, capture::kVisibleNext);
    if (frame > 0) add_target(frame - 1, camera, capture::kVisiblePrevious);
    for (const int other : views.companions(camera))
      add_target(frame, other, capture::visible_in_camera(other));
    frame_ = frame;

    const int width = grid_.width_px;
    const int height = grid_.height_px;
    const std::size_t num_pixels =
        static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    truth_.range_m.resize(num_pixels);
    truth_.point_world.resize(num_pixels);
    truth_.crossing_error.assign(num_pixels, 0.0);
    capture::CameraFrame& facts = truth_.facts;
    facts.range_m.reshape(width, height, 1);
    facts.normal_world.reshape(width, height, 3);
    facts.semantic_id.reshape(width, height, 1);
    facts.instance_id.reshape(width, height, 1);
    facts.primitive_id.reshape(width, height, 1);
    facts.flags.reshape(width, height, 1);
    facts.bottom_range_m.reshape(bed != nullptr ? width : 0, bed != nullptr ? height : 0, 1);
    content_.resize(static_cast<std::size_t>(grid_.num_units()));
  }

  void trace() {
    for_each_unit([this](int unit, UnitScratch& scratch) { trace_unit(unit, scratch); });
    if (!has_edges_) return;
    for_each_unit([this](int unit, UnitScratch& scratch) {
      if (may_see_edges(unit)) mark_edges(unit, scratch);
    });
  }

 private:
  static constexpr std::uint8_t kHasSky = 1;
  static constexpr std::uint8_t kHasGround = 2;
  static constexpr std::uint8_t kHasObjects = 4;
  static constexpr std::uint64_t kSky = std::uint64_t{1} << 32;  ///< beside all instance ids

  /// What moves about this frame and those beside it.
  void set_moving(const scene::MovingBodies& moving, const ViewTable& views, int frame) {
    for (int at = std::max(frame - 1, 0); at <= std::min(frame + 1, views.num_frames() - 1); ++at)
      moving_.emplace(at, moving.scene(at, views.longest_reach_s()));
  }
  world::TimedQuery scene_at(int frame) const { return {query_, moving_.at(frame)}; }

  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(grid_.width_px) +
           static_cast<std::size_t>(x);
  }
  /// What a pixel shows: an instance id, 0 for the ground, or kSky.
  std::uint64_t shown_at(std::size_t pixel) const {
    if (std::isinf(truth_.range_m[pixel])) return kSky;
    return truth_.facts.instance_id.data()[pixel];
  }

  template <class Work>
  void for_each_unit(const Work& work) {
    query_.run_units(grid_.num_units(), [&](std::int64_t i) {
      core::ScratchPool<UnitScratch>::Lease scratch(pool_);
      work(units_[static_cast<std::size_t>(i)], *scratch);
    });
  }

  /// When a unit's pixels are exposed, counted from the frame's time.
  double offset_of(const PixelUnit& unit) const {
    return view_.offset_of_line_s({0.5 * (unit.x0 + unit.x1), 0.5 * (unit.y0 + unit.y1)});
  }

  void trace_unit(int unit, UnitScratch& scratch) {
    const double offset_s = offset_of(grid_.unit(unit));
    scratch.view = view_.at(offset_s);
    set_pixel_rays(grid_.unit(unit), scratch);
    const std::size_t num_rays = scratch.directions.size();
    scratch.intersect(scene_at(frame_), offset_s, trail_, world::SurfaceNeed::Facts);
    MetPoints& ground = scratch.ground;
    MetPoints& objects = scratch.objects;
    ground.rays.clear();
    objects.rays.clear();
    scratch.moving_rays.clear();
    for (std::size_t i = 0; i < num_rays; ++i) {
      if (scratch.hits[i].is_sky())
        set_sky(scratch.pixels[i]);
      else if (scratch.hits[i].is_moving())
        scratch.moving_rays.push_back(i);
      else if (scratch.hits[i].is_ground())
        ground.rays.push_back(i);
      else
        objects.rays.push_back(i);
    }
    const std::size_t num_objects = objects.rays.size() + scratch.moving_rays.size();
    const bool has_sky = ground.rays.size() + num_objects < num_rays;
    content_[static_cast<std::size_t>(unit)] =
        static_cast<std::uint8_t>((has_sky ? kHasSky : 0) | (ground.rays.empty() ? 0 : kHasGround) |
                                  (num_objects == 0 ? 0 : kHasObjects));
    set_ground(scratch);
    set_objects(scratch);
    for (const std::size_t ray : scratch.moving_rays) set_object(ray, scratch);
    if (bed_ != nullptr) set_bottom(offset_s, scratch);
    look_from_targets(ground, scratch);
    look_from_targets(objects, scratch);
    if (!scratch.moving_rays.empty()) look_at_moving(offset_s, scratch);
  }

  /// Sets bottom_range_m of the unit's pixels. The rays' own buffer is used again.
  void set_bottom(double offset_s, UnitScratch& scratch) {
    capture::CameraFrame& facts = truth_.facts;
    for (const std::size_t pixel : scratch.pixels)
      facts.bottom_range_m.data()[pixel] = facts.range_m.data()[pixel];
    std::vector<Eigen::Vector3d> directions;
    std::vector<world::WorldRay> rays;  // with origins of their own
    std::vector<std::size_t> pixels;
    for (const std::size_t i : scratch.ground.rays) {
      if (!world::is_water(scratch.surfaces[i].cover)) continue;
      directions.push_back(scratch.directions[i]);
      if (!view_.is_central())
        rays.push_back(
            {.origin_world = scratch.origin_world(i), .direction_world = directions.back()});
      pixels.push_back(scratch.pixels[i]);
    }
    if (pixels.empty()) return;
    scratch.directions.clear(kUnitRays);
    for (const Eigen::Vector3d& direction : directions) scratch.directions.add(direction);
    scratch.t.resize(scratch.directions.size());
    const std::vector<double>& t = scratch.t;
    const world::TimedQuery bed(*bed_, moving_.at(frame_));
    if (view_.is_central()) {
      bed.intersect(scratch.directions.from(scratch.view.center_world), offset_s, scratch.t,
                    world::Coherence::Coherent, trail_);
    } else {
      std::vector<world::SurfaceHit> hits(rays.size());
      bed.intersect(rays, std::vector<double>(rays.size(), offset_s), hits,
                    world::Coherence::Coherent, {}, trail_);
      for (std::size_t i = 0; i < hits.size(); ++i) scratch.t[i] = hits[i].t;
    }
    for (std::size_t i = 0; i < pixels.size(); ++i)
      facts.bottom_range_m.data()[pixels[i]] = std::max(
          static_cast<float>(t[i] * directions[i].norm()), facts.range_m.data()[pixels[i]]);
  }

  /// Sets the flags of points by which targets see them.
  void look_from_targets(MetPoints& met, UnitScratch& scratch) {
    met.flags.assign(met.pixels.size(), 0);
    if (met.pixels.empty()) return;
    for (const Target& target : targets_) see_standing(target, met, scratch, trail_);
    for (std::size_t i = 0; i < met.pixels.size(); ++i)
      truth_.facts.flags.data()[met.pixels[i]] = met.flags[i];
  }

  void set_pixel_rays(const PixelUnit& unit, UnitScratch& scratch) {
    constexpr std::size_t kBlock = geo::PixelBlock::kPixels;
    scratch.directions.clear(kUnitRays);
    scratch.origins_world.clear();
    scratch.pixels.clear();
    scratch.t_ends.clear();
    const bool is_central = view_.is_central();
    geo::PixelBlock pixels{};
    std::array<std::size_t, kBlock> indices{};
    std::size_t count = 0;
    const auto add_rays = [&] {
      geo::VectorBlock directions;
      scratch.view.find_rays(pixels, directions);
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d direction(directions.x[i], directions.y[i], directions.z[i]);
        if (!direction.allFinite()) {
          set_nothing(indices[i]);
          continue;
        }
        scratch.directions.add(direction);
        if (!is_central)
          scratch.origins_world.push_back(scratch.view.origin_world({pixels.x[i], pixels.y[i]}));
        scratch.pixels.push_back(indices[i]);
      }
      count = 0;
    };
    for_each_pixel(unit, [&](int x, int y) {
      pixels.x[count] = x + 0.5;
      pixels.y[count] = y + 0.5;
      indices[count] = pixel_index(x, y);
      if (++count == kBlock) add_rays();
    });
    add_rays();
  }

  void set_sky(std::size_t pixel) {
    set_no_surface(pixel, capture::kSkyRange_m, capture::SemanticClass::Sky);
  }
  /// Of pixels into which no ray comes.
  void set_nothing(std::size_t pixel) {
    set_no_surface(pixel, capture::kNoRange_m, capture::SemanticClass::Nothing);
    if (bed_ != nullptr) truth_.facts.bottom_range_m.data()[pixel] = capture::kNoRange_m;
  }
  void set_no_surface(std::size_t pixel, float range_m, capture::SemanticClass semantic_class) {
    truth_.range_m[pixel] = static_cast<double>(range_m);
    truth_.point_world[pixel] = Eigen::Vector3d::Zero();
    capture::CameraFrame& facts = truth_.facts;
    facts.range_m.data()[pixel] = range_m;
    for (std::size_t k = 0; k < 3; ++k) facts.normal_world.data()[3 * pixel + k] = 0.0f;
    facts.semantic_id.data()[pixel] = static_cast<std::uint32_t>(semantic_class);
    facts.instance_id.data()[pixel] = 0;
    facts.primitive_id.data()[pixel] = capture::kNoPrimitive;
    facts.flags.data()[pixel] = 0;
  }

  /// Sets all facts but the flags of scratch.ground, packet by packet, and keeps pixels and points.
  void set_ground(UnitScratch& scratch) {
    constexpr std::size_t kBlock = geo::VectorBlock::kVectors;
    MetPoints& ground = scratch.ground;
    const std::size_t num_ground = ground.rays.size();
    ground.pixels.clear();
    ground.points_world.clear();
    for (std::size_t begin = 0; begin < num_ground; begin += core::kLanes) {
      const std::size_t count = std::min<std::size_t>(core::kLanes, num_ground - begin);
      const std::span<const std::size_t> rays(&ground.rays[begin], count);
      gather_hits(rays, scratch);
      if (view_.is_central()) {
        place_hits(scratch.view.center_world.data(), scratch.packet_hits, scratch.range_m,
                   scratch.places);
      } else {
        place_hits(Eigen::Vector3d::Zero().eval().data(), scratch.packet_hits, scratch.range_m,
                   scratch.places);
        add_origins(rays, scratch);
      }
      ground_.set(scratch.places, scratch.packet);
      ground_.classify(scratch.packet, scratch.classes);
      for (std::size_t lane = 0; lane < count; ++lane) {
        const std::size_t pixel = scratch.pixels[rays[lane]];
        set_facts(pixel, rays[lane], static_cast<int>(lane), scratch);
        ground.pixels.push_back(pixel);
      }
      for (std::size_t first = 0; first < count; first += kBlock) {
        geo::VectorBlock& block = ground.points_world.emplace_back();
        std::copy_n(scratch.places.point_world[0].values + first, kBlock, block.x);
        std::copy_n(scratch.places.point_world[1].values + first, kBlock, block.y);
        std::copy_n(scratch.places.point_world[2].values + first, kBlock, block.z);
      }
    }
  }

  /// To points that are placed as if all rays started at the world's origin.
  static void add_origins(std::span<const std::size_t> rays, UnitScratch& scratch) {
    for (std::size_t k = 0; k < core::kLanes; ++k) {
      const Eigen::Vector3d origin = scratch.origin_world(rays[std::min(k, rays.size() - 1)]);
      for (std::size_t axis = 0; axis < 3; ++axis)
        scratch.places.point_world[axis][static_cast<int>(k)] += origin[static_cast<int>(axis)];
    }
  }

  /// The last ray fills the lanes that are left.
  static void gather_hits(std::span<const std::size_t> rays, UnitScratch& scratch) {
    for (std::size_t k = 0; k < core::kLanes; ++k) {
      const std::size_t i = rays[std::min(k, rays.size() - 1)];
      const int lane = static_cast<int>(k);
      const world::SurfaceHit& hit = scratch.hits[i];
      const Eigen::Vector3d direction = scratch.directions[i];
      scratch.packet_hits.direction_world[0][lane] = direction.x();
      scratch.packet_hits.direction_world[1][lane] = direction.y();
      scratch.packet_hits.direction_world[2][lane] = direction.z();
      scratch.packet_hits.t[lane] = hit.t;
      scratch.packet_hits.slope_x[lane] = hit.slope_x;
      scratch.packet_hits.slope_y[lane] = hit.slope_y;
      scratch.places.footprint_m[lane] = 0.0;
      scratch.places.set_surface(lane, scratch.surfaces[i]);
    }
  }

  void set_facts(std::size_t pixel, std::size_t ray, int lane, const UnitScratch& scratch) {
    const core::Lanes3d& point = scratch.places.point_world;
    const core::Lanes3d& normal = scratch.places.normal_world;
    truth_.range_m[pixel] = scratch.range_m[lane];
    truth_.point_world[pixel] = {point[0][lane], point[1][lane], point[2][lane]};
    capture::CameraFrame& facts = truth_.facts;
    facts.range_m.data()[pixel] = static_cast<float>(scratch.range_m[lane]);
    for (std::size_t k = 0; k < 3; ++k)
      facts.normal_world.data()[3 * pixel + k] = static_cast<float>(normal[k][lane]);
    const world::SurfaceSample& surface = scratch.surfaces[ray];
    facts.semantic_id.data()[pixel] =
        surface.paint.is_painted ? static_cast<std::uint32_t>(scene::class_of(surface.paint))
                                 : scratch.classes[lane];
    facts.instance_id.data()[pixel] = 0;
    facts.primitive_id.data()[pixel] = primitive_id(scratch.hits[ray]);
  }

  /// As set_ground, for scratch.objects, one by one.
  void set_objects(UnitScratch& scratch) {
    constexpr std::size_t kBlock = geo::VectorBlock::kVectors;
    MetPoints& objects = scratch.objects;
    objects.pixels.clear();
    objects.points_world.clear();
    for (const std::size_t i : objects.rays) {
      set_object(i, scratch);
      const std::size_t pixel = scratch.pixels[i];
      const Eigen::Vector3d& point = truth_.point_world[pixel];
      const std::size_t at = objects.pixels.size() % kBlock;
      if (at == 0) objects.points_world.emplace_back();
      geo::VectorBlock& block = objects.points_world.back();
      std::fill(block.x + at, block.x + kBlock, point.x());
      std::fill(block.y + at, block.y + kBlock, point.y());
      std::fill(block.z + at, block.z + kBlock, point.z());
      objects.pixels.push_back(pixel);
    }
  }

  /// Sets all facts but the flags of a pixel whose ray met an object.
  void set_object(std::size_t ray, const UnitScratch& scratch) {
    const std::size_t pixel = scratch.pixels[ray];
    const world::SurfaceHit& hit = scratch.hits[ray];
    const world::SurfaceSample& surface = scratch.surfaces[ray];
    const Eigen::Vector3d direction = scratch.directions[ray];
    truth_.range_m[pixel] = hit.t * direction.norm();
    truth_.point_world[pixel] = scratch.origin_world(ray) + hit.t * direction;
    truth_.crossing_error[pixel] = surface.crossing_error;
    capture::CameraFrame& facts = truth_.facts;
    facts.range_m.data()[pixel] = static_cast<float>(truth_.range_m[pixel]);
    for (std::size_t k = 0; k < 3; ++k)
      facts.normal_world.data()[3 * pixel + k] =
          static_cast<float>(hit.object_normal_world[static_cast<int>(k)]);
    facts.semantic_id.data()[pixel] = static_cast<std::uint32_t>(surface.finish.semantic_class);
    facts.instance_id.data()[pixel] = surface.provenance.instance_id;
    facts.primitive_id.data()[pixel] = primitive_id(hit);
  }

  /// Sets the flags of what moves.
  void look_at_moving(double offset_s, UnitScratch& scratch) {
    const std::vector<world::MovingBody>& bodies = moving_.at(frame_).bodies();
    const std::span<std::uint32_t> flags = truth_.facts.flags.data();
    std::vector<MovingPoint> points;
    for (const std::size_t ray : scratch.moving_rays) {
      const std::size_t pixel = scratch.pixels[ray];
      flags[pixel] = 0;
      points.push_back({truth_.point_world[pixel], &bodies[scratch.hits[ray].object], pixel});
    }
    for (const Target& target : targets_)
      see_moving(target, moving_.at(target.frame), points, offset_s, flags, trail_);
  }

  /// Whether a unit and those around it hold both sky and ground, or objects.
  bool may_see_edges(int unit) const {
    const int columns = grid_.columns();
    const int rows = grid_.num_units() / columns;
    const int column = unit % columns;
    const int row = unit / columns;
    unsigned content = 0;
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows - 1); ++r) {
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns - 1); ++c) {
        const int there = r * columns + c;
        content |= content_[static_cast<std::size_t>(there)];
      }
    }
    return content == (kHasSky | kHasGround) || (content & kHasObjects) != 0;
  }

  /// Whether a neighbour shows something else.
  bool is_beside_edge(int x, int y) const {
    const std::uint64_t here = shown_at(pixel_index(x, y));
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, grid_.height_px - 1); ++j)
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, grid_.width_px - 1); ++i)
        if (shown_at(pixel_index(i, j)) != here) return true;
    return false;
  }

  /// Only a pixel beside another object, sky and terrain being one each, can change from one to the
  /// other within a thousandth of a pixel; what is narrower than a pixel and met by no centre has no
  /// neighbour that tells of it. Nearly all shifted rays meet the same object within kEdgeReach: nothing
  /// beyond is looked for, unless nothing is met before.
  void mark_edges(int unit, UnitScratch& scratch) {
    static constexpr double kShifts[4][2] = {
        {-kEdgeShift_px, 0.0}, {kEdgeShift_px, 0.0}, {0.0, -kEdgeShift_px}, {0.0, kEdgeShift_px}};
    const double offset_s = offset_of(grid_.unit(unit));
    scratch.view = view_.at(offset_s);
    clear_rays(scratch);
    for_each_pixel(grid_.unit(unit), [&](int x, int y) {
      const std::size_t pixel = pixel_index(x, y);
      if (!is_beside_edge(x, y) || std::isnan(truth_.range_m[pixel])) return;
      for (const auto& shift : kShifts) {
        const Eigen::Vector2d place(x + 0.5 + shift[0], y + 0.5 + shift[1]);
        const Eigen::Vector3d ray = scratch.view.ray_world(place);
        if (!ray.allFinite()) continue;
        scratch.directions.add(ray);
        if (!view_.is_central()) scratch.origins_world.push_back(scratch.view.origin_world(place));
        scratch.pixels.push_back(pixel);
        scratch.t_ends.push_back(kEdgeReach * truth_.range_m[pixel] / ray.norm());
      }
    });
    mark_where_others_are_met(offset_s, scratch);
    keep_rays_that_met_nothing(scratch);
    if (scratch.pixels.empty()) return;
    scratch.t_ends.clear();
    mark_where_others_are_met(offset_s, scratch);
  }

  static void clear_rays(UnitScratch& scratch) {
    scratch.directions.clear(4 * kUnitRays);
    scratch.origins_world.clear();
    scratch.pixels.clear();
    scratch.t_ends.clear();
  }

  /// Rays that end before they meet something say nothing.
  void mark_where_others_are_met(double offset_s, UnitScratch& scratch) {
    scratch.intersect(scene_at(frame_), offset_s, trail_, world::SurfaceNeed::Object);
    for (std::size_t i = 0; i < scratch.hits.size(); ++i) {
      const world::SurfaceHit& hit = scratch.hits[i];
      std::uint64_t shown = kSky;
      if (!hit.is_sky())
        shown = hit.is_ground() ? 0 : scratch.surfaces[i].provenance.instance_id;
      else if (!scratch.t_ends.empty() && std::isfinite(scratch.t_ends[i]))
        continue;
      if (shown != shown_at(scratch.pixels[i]))
        truth_.facts.flags.data()[scratch.pixels[i]] |= capture::kEdge;
    }
  }

  /// Of the rays that have an end.
  void keep_rays_that_met_nothing(UnitScratch& scratch) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < scratch.hits.size(); ++i) {
      if (!scratch.hits[i].is_sky() || !std::isfinite(scratch.t_ends[i])) continue;
      scratch.directions.move(i, kept);
      if (!scratch.origins_world.empty()) scratch.origins_world[kept] = scratch.origins_world[i];
      scratch.pixels[kept++] = scratch.pixels[i];
    }
    scratch.directions.keep(kept);
    if (!scratch.origins_world.empty()) scratch.origins_world.resize(kept);
    scratch.pixels.resize(kept);
  }

  const world::RayQuery& query_;
  const world::RayQuery* const bed_;
  const scene::Ground& ground_;
  const OpenView view_;
  const PixelGrid grid_;
  const std::vector<int> units_;  ///< of the grid, in the order in which they are traced
  TruthFrame& truth_;
  world::RayTrail* const trail_;
  const bool has_edges_;  ///< edges are asked for
  int frame_ = 0;
  std::map<int, world::MovingScene> moving_;  ///< by frame
  std::vector<Target> targets_;
  std::vector<std::uint8_t> content_;  ///< of each unit: kHasSky, kHasGround, kHasObjects
  core::ScratchPool<UnitScratch> pool_;
};

}  // namespace

void trace_truth(const world::RayQuery& query, const scene::MovingBodies& moving,
                 const scene::Ground& ground, const ViewTable& views, int frame, int camera,
                 TruthFrame& truth, world::RayTrail* trail, const world::RayQuery* bed,
                 std::uint32_t flags) {
  TruthTracer(query, moving, ground, views, frame, camera, truth, trail, bed, flags).trace();
}

}  // namespace terracast::sensors
