// What a sequence saw of space: which voxels are free, which hold surface, and how far from surface those about it lie.
//
// Rays      one through the centre of each pixel, from where it starts when the pixel's line is exposed, to the range that
//           the capture holds; of the sky, and of what is farther, to reach_m.
// occupancy 0: free, a ray passed all through it; 1: a ray ended in it on what stands; 0.5, not active: unknown.
//           What is both is occupied.
// tsdf      of each voxel about surface the mean, each ray counting once, of r - d . (c - o) over the rays (from o
//           along d, which end at r) that pass it with a distance within the truncation: how far its centre c lies
//           before the surface along the ray; below 0 behind (B. Curless and M. Levoy, A Volumetric Method for Building
//           Complex Models from Range Images, SIGGRAPH 1996, with weight 1). With distance = "plane" the mean of
//           n . (c - p) instead, to the plane of the surface at the ray's end p.
// weight    how many rays that mean is of.
// What moves is no part of it: a ray that ends on it clears what lies before it, and tells no more.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/instance_id.h"
#include "core/json.h"
#include "core/log.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/stop.h"
#include "labels/finished.h"
#include "labels/label.h"
#include "labels/voxel_store.h"
#include "labels/voxel_walk.h"
#include "world/vdb/sparse_grid.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using core::Json;
using Eigen::Vector3d;

/// Distances are summed in steps of the truncation divided by this.
constexpr double kSteps = 1 << 30;

struct VolumeRule {
  double voxel_m = 0.5;
  double truncation_m = 2.0;
  double reach_m = 200.0;
  bool is_to_plane = false;
};

/// A pixel's ray.
struct SeenRay {
  Vector3d origin_world;
  Vector3d direction_world;  ///< unit
  double end_m = 0.0;        ///< nothing hides what lies before it
  bool ends_on_surface = false;
  Vector3d normal_world = Vector3d::Zero();  ///< there, toward the camera
};

class RayTeller {
 public:
  RayTeller(const VolumeRule& rule, VoxelStore& store) : rule_(rule), reader_(store) {}

  void tell(const SeenRay& ray) {
    // A voxel's centre lies less far along the ray than its side beside where the ray passes the voxel.
    const double beyond_m =
        ray.ends_on_surface ? ray.end_m + rule_.truncation_m + rule_.voxel_m : ray.end_m;
    const double from_m = ray.end_m - rule_.truncation_m - rule_.voxel_m;
    walk_voxels(ray.origin_world, ray.direction_world, beyond_m, rule_.voxel_m,
                [&](const Voxel& voxel, double t_in, double t_out) {
                  mark(ray, voxel, t_in, t_out);
                  if (ray.ends_on_surface && t_out >= from_m) add_distance(ray, voxel);
                });
  }

 private:
  void mark(const SeenRay& ray, const Voxel& voxel, double t_in, double t_out) {
    if (t_out <= ray.end_m)
      reader_.block_of(voxel).mark_free(VoxelStore::index_of(voxel));
    else if (ray.ends_on_surface && t_in <= ray.end_m)
      reader_.block_of(voxel).mark_occupied(VoxelStore::index_of(voxel));
  }

  void add_distance(const SeenRay& ray, const Voxel& voxel) {
    Vector3d center_world;
    for (int axis = 0; axis < 3; ++axis)
      center_world[axis] =
          (static_cast<double>(voxel[static_cast<std::size_t>(axis)]) + 0.5) * rule_.voxel_m;
    const Vector3d from_camera = center_world - ray.origin_world;
    const double along_m = ray.end_m - ray.direction_world.dot(from_camera);
    if (!(std::abs(along_m) <= rule_.truncation_m)) return;
    double distance_m = along_m;
    if (rule_.is_to_plane)
      distance_m = std::clamp(ray.normal_world.dot(from_camera - ray.end_m * ray.direction_world),
                              -rule_.truncation_m, rule_.truncation_m);
    VoxelBlock::Distances& distances = reader_.distances_of(reader_.block_of(voxel), voxel);
    const std::size_t at = VoxelStore::index_of(voxel);
    distances.sum[at].fetch_add(std::llround(distance_m / rule_.truncation_m * kSteps),
                                std::memory_order_relaxed);
    distances.count[at].fetch_add(1, std::memory_order_relaxed);
  }

  const VolumeRule& rule_;
  VoxelStore::Reader reader_;
};

/// Pixels of an image whose rays tell of what stands, and of those that end on what moves.
struct RayCounts {
  std::int64_t on_surface = 0;
  std::int64_t on_moving = 0;
};

RayCounts tell_image(const capture::SequenceReader& sequence, int frame, int camera,
                     const VolumeRule& rule, VoxelStore& store) {
  const auto model =
      geo::make_camera(sequence.info().cameras[static_cast<std::size_t>(camera)].intrinsics);
  const capture::CameraView view = sequence.view(*model, frame, camera);
  const capture::CameraFrame facts =
      sequence.read_camera(frame, camera, capture::SequenceReader::kFacts);
  RayTeller teller(rule, store);
  RayCounts counts;
  for (int y = 0; y < facts.range_m.height(); ++y) {
    core::throw_if_stop_asked();
    for (int x = 0; x < facts.range_m.width(); ++x) {
      const auto range_m = static_cast<double>(facts.range_m(x, y));
      if (std::isnan(range_m)) continue;  // no ray comes in
      const Eigen::Vector2d center = capture::pixel_center(x, y);
      const geo::Rigid3d world_from_camera = view.pose_of_line(center);
      const bool is_moving = core::is_moving_id(facts.instance_id(x, y));
      SeenRay ray{.origin_world = world_from_camera * model->origin_from_pixel(center),
                  .direction_world =
                      world_from_camera.rotation * model->ray_from_pixel(center).normalized(),
                  .end_m = std::min(range_m, rule.reach_m)};
      ray.ends_on_surface = range_m <= rule.reach_m && !is_moving;
      for (int axis = 0; axis < 3; ++axis)
        ray.normal_world[axis] = static_cast<double>(facts.normal_world(x, y, axis));
      if (ray.normal_world.dot(ray.direction_world) > 0.0) ray.normal_world = -ray.normal_world;
      counts.on_surface += ray.ends_on_surface ? 1 : 0;
      counts.on_moving += is_moving ? 1 : 0;
      teller.tell(ray);
    }
  }
  return counts;
}

/// Blocks are copied voxel by voxel.
static_assert(VoxelBlock::kVoxels == world::SparseBlock::kVoxels);

/// The three grids, and how much they hold.
class VolumeGrids {
 public:
  VolumeGrids(const VolumeRule& rule, const capture::SequenceInfo& info, const VoxelStore& store)
      : rule_(rule), blocks_(store.sorted()) {
    for (const VoxelStore::Placed& placed : blocks_) {
      places_.push_back(placed.place);
      if (placed.block->distances() == nullptr) continue;
      near_.push_back(placed);
      near_places_.push_back(placed.place);
    }
    notes_ = {
        {"terracast_frame",
         fmt::format("x east, y north, z up, m, at latitude {} longitude {} height {} of WGS84",
                     info.origin.lat_deg, info.origin.lon_deg, info.origin.height_m)},
        {"terracast_sequence", info.name},
        {"terracast_truncation_m", fmt::format("{}", rule.truncation_m)},
        {"terracast_distance", rule.is_to_plane ? "plane" : "ray"}};
  }

  std::vector<std::byte> encode() {
    const std::array grids = {
        world::SparseGrid{
            .name = "occupancy",
            .voxel_m = rule_.voxel_m,
            .unknown = 0.5F,
            .notes = notes_,
            .blocks = places_,
            .fill = [this](std::size_t i,
                           world::SparseBlock& out) { fill_occupancy(*blocks_[i].block, out); }},
        world::SparseGrid{.name = "tsdf",
                          .voxel_m = rule_.voxel_m,
                          .unknown = static_cast<float>(rule_.truncation_m),
                          .notes = notes_,
                          .blocks = near_places_,
                          .fill =
                              [this](std::size_t i, world::SparseBlock& out) {
                                fill_distances(*near_[i].block->distances(), out);
                              }},
        world::SparseGrid{.name = "weight",
                          .voxel_m = rule_.voxel_m,
                          .unknown = 0.0F,
                          .notes = notes_,
                          .blocks = near_places_,
                          .fill = [this](std::size_t i, world::SparseBlock& out) {
                            fill_weights(*near_[i].block->distances(), out);
                          }}};
    return world::encode_sparse_vdb(grids);
  }

  std::int64_t num_free() const { return num_free_; }
  std::int64_t num_occupied() const { return num_occupied_; }
  std::int64_t num_distances() const { return num_distances_; }

 private:
  void fill_occupancy(const VoxelBlock& block, world::SparseBlock& out) {
    for (std::size_t i = 0; i < VoxelBlock::kVoxels; ++i) {
      const bool is_occupied = block.is_occupied(i);
      out.is_known[i] = is_occupied || block.is_free(i);
      out.values[i] = is_occupied ? 1.0F : 0.0F;
      num_occupied_ += is_occupied ? 1 : 0;
      num_free_ += out.is_known[i] && !is_occupied ? 1 : 0;
    }
  }
  void fill_distances(const VoxelBlock::Distances& distances, world::SparseBlock& out) {
    for (std::size_t i = 0; i < VoxelBlock::kVoxels; ++i) {
      const std::uint32_t count = distances.count[i].load();
      out.is_known[i] = count > 0;
      if (count == 0) continue;
      ++num_distances_;
      out.values[i] =
          static_cast<float>(static_cast<double>(distances.sum[i].load()) /
                             (static_cast<double>(count) * kSteps) * rule_.truncation_m);
    }
  }
  static void fill_weights(const VoxelBlock::Distances& distances, world::SparseBlock& out) {
    for (std::size_t i = 0; i < VoxelBlock::kVoxels; ++i) {
      const std::uint32_t count = distances.count[i].load();
      out.is_known[i] = count > 0;
      out.values[i] = static_cast<float>(count);
    }
  }

  const VolumeRule rule_;
  std::vector<VoxelStore::Placed> blocks_, near_;
  std::vector<Eigen::Vector3i> places_, near_places_;
  std::vector<std::pair<std::string, std::string>> notes_;
  std::int64_t num_free_ = 0, num_occupied_ = 0, num_distances_ = 0;
};

class VolumeLabel final : public LabelMaker {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("voxel_m", voxel_m_, "Side of the voxels.", core::between(0.001, 10000.0));
    visit.key("truncation_m", truncation_m_,
              "Distances reach so far before and behind surface; 0: four voxels.",
              core::between(0.0, 10000.0));
    visit.key("reach_m", reach_m_, "Rays are followed so far from the camera.",
              core::between(0.01, 1e6));
    visit.key("distance", distance_,
              "What the tsdf is a mean of. ray: distances to the surface along the rays; plane: "
              "to the surface's plane where each ray ends.",
              core::one_of({"ray", "plane"}));
    visit.key("memory_bytes", memory_bytes_,
              "Bound on what voxels take, and on the file's grids; what needs more is an error.",
              core::between(1e6, 1e13));
  }
  void validate() const override {
    if (truncation_m_ > 0.0 && truncation_m_ < voxel_m_)
      fail(ErrorKind::Config,
           "truncation_m = {} is less than voxel_m = {}: surface would pass between voxels; make "
           "it as large, or 0",
           truncation_m_, voxel_m_);
  }
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<VolumeLabel>(*this);
  }

  LabelFiles make(const LabelInputs& inputs) const override {
    const capture::SequenceReader& sequence = inputs.sequence;
    const VolumeRule rule = this->rule();
    const fs::path folder = sequence.folder() / capture::kLabelsFolder / "volume";
    const fs::path record = folder / "volume.json";
    const fs::path file = folder / "volume.vdb";
    const LabelFiles files = {"volume.json", "volume.vdb"};
    Json wanted = Json::object();
    wanted.set("format", "terracast volume")
        .set("version", 1)
        .set("capture", capture::labels_source(sequence))
        .set("voxel_m", rule.voxel_m)
        .set("truncation_m", rule.truncation_m)
        .set("reach_m", rule.reach_m)
        .set("distance", distance_);
    if (is_label_finished(record, file, wanted)) {
      inputs.context.log.info("{}: its volume is there already", sequence.info().name);
      return files;
    }
    VoxelStore store(memory_bytes_);
    const RayCounts counts = tell_all(sequence, rule, store, inputs.context);
    VolumeGrids grids(rule, sequence.info(), store);
    const std::vector<std::byte> bytes = grids.encode();
    core::write_file(file, bytes);
    wanted.set("rays_on_surface", counts.on_surface)
        .set("rays_on_what_moves", counts.on_moving)
        .set("free_voxels", grids.num_free())
        .set("occupied_voxels", grids.num_occupied())
        .set("tsdf_voxels", grids.num_distances())
        .set("xxh3_128", core::content_hash(bytes));
    wanted.write(record);
    inputs.context.log.info("{}: {} voxels free, {} occupied", file.string(), grids.num_free(),
                            grids.num_occupied());
    return files;
  }

 private:
  VolumeRule rule() const {
    constexpr double kVoxels = 4.0;
    const double truncation_m = truncation_m_ > 0.0 ? truncation_m_ : kVoxels * voxel_m_;
    return {.voxel_m = voxel_m_,
            .truncation_m = truncation_m,
            .reach_m = reach_m_,
            .is_to_plane = distance_ == "plane"};
  }

  static RayCounts tell_all(const capture::SequenceReader& sequence, const VolumeRule& rule,
                            VoxelStore& store, const core::Context& context) {
    const auto num_cameras = static_cast<std::int64_t>(sequence.info().cameras.size());
    const std::int64_t num_images =
        num_cameras * static_cast<std::int64_t>(sequence.frames().size());
    std::vector<RayCounts> counts(static_cast<std::size_t>(num_images));
    core::Progress progress(context, "images", num_images);
    core::parallel_for(num_images, [&](std::int64_t i) {
      counts[static_cast<std::size_t>(i)] =
          tell_image(sequence, static_cast<int>(i / num_cameras), static_cast<int>(i % num_cameras),
                     rule, store);
      progress.advance();
    });
    RayCounts sum;
    for (const RayCounts& one : counts) {
      sum.on_surface += one.on_surface;
      sum.on_moving += one.on_moving;
    }
    return sum;
  }

  double voxel_m_ = 0.5;
  double truncation_m_ = 0.0;
  double reach_m_ = 200.0;
  std::string distance_ = "ray";
  double memory_bytes_ = 4e9;
};

}  // namespace

LabelInfo volume_label() {
  return {.name = "volume",
          .summary =
              "What was seen of space, as OpenVDB grids: occupancy, and truncated signed "
              "distances.",
          .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<VolumeLabel>(); }};
}

}  // namespace terracast::labels
