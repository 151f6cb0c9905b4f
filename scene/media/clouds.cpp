#include "scene/media/clouds.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <tuple>

#include "scene/media/medium.h"

namespace terracast::scene {
namespace {

/// Nothing is looked for farther away: haze hides it.
constexpr double kFarthest_m = 300e3;
/// What is left of the light behind when the rest is not followed.
constexpr float kOpaque = 0.004f;
/// Steps of a wide sample are no longer than so many voxels.
constexpr double kLongestStep = 4.0;
constexpr double kShadowStep = 2.0;  ///< of rays to the sun, in voxels
/// Where nothing is in a block of so many voxels a side, steps go over it.
constexpr int kBlock = 8;

constexpr int kNumOrders = 8;
constexpr float kOrderWeight = 0.8f;
constexpr float kOrderDepth = 0.5f;
constexpr float kOrderCosine = 0.5f;

/// Optical depths toward the sun are kept on every third voxel, in steps of 1/64.
constexpr int kShadowCell = 3;
constexpr float kDepthSteps = 64.0f;
constexpr std::uint16_t kMostDepth = 65535;
/// What lies nearer toward the sun is looked at by itself, where clouds are seen so closely: in voxels.
constexpr double kNearShadow = 4.5;
constexpr int kNearSteps = 3;
constexpr double kCloseStep = 2.0;

/// Optical depths up and down through a volume are kept on cells of so many voxels a side.
constexpr int kColumnCell = 4;

/// Share of light from all sides of a half space that comes through a depth of cloud: two streams,
/// up and down (Bohren 1987).
float diffuse_transmittance(float depth, float mean_cosine) {
  return 1.0f / (1.0f + 0.75f * (1.0f - mean_cosine) * depth);
}

float phase_of(float cosine, float mean_cosine) {
  const float squared = mean_cosine * mean_cosine;
  const float below = 1.0f + squared - 2.0f * mean_cosine * cosine;
  return (1.0f - squared) /
         (4.0f * static_cast<float>(std::numbers::pi) * below * std::sqrt(below));
}

/// Linear between the cells' values, value(x, y, z), which is asked within the size only; 0 beyond.
template <class Value>
float trilinear(const Eigen::Vector3d& at, const Eigen::Vector3i& size, const Value& value) {
  const int x = static_cast<int>(std::floor(at.x()));
  const int y = static_cast<int>(std::floor(at.y()));
  const int z = static_cast<int>(std::floor(at.z()));
  const auto tx = static_cast<float>(at.x() - x);
  const auto ty = static_cast<float>(at.y() - y);
  const auto tz = static_cast<float>(at.z() - z);
  const auto one = [&](int i, int j, int k) {
    if (i < 0 || j < 0 || k < 0 || i >= size.x() || j >= size.y() || k >= size.z()) return 0.0f;
    return value(i, j, k);
  };
  const auto along = [&](int j, int k) {
    const float first = one(x, j, k);
    return first + tx * (one(x + 1, j, k) - first);
  };
  const auto plane = [&](int k) {
    const float first = along(y, k);
    return first + ty * (along(y + 1, k) - first);
  };
  const float below = plane(z);
  return below + tz * (plane(z + 1) - below);
}

}  // namespace

/// Which blocks of a volume hold anything that is seen at a place in them.
struct Clouds::Blocks {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint8_t> is_filled;

  explicit Blocks(const world::Volume& volume) {
    // A place between voxels takes both; those before the first are of the first block.
    size = (volume.size.array() + 1 + kBlock) / kBlock;
    is_filled.assign(static_cast<std::size_t>(size.prod()), 0);
    for (int z = 0; z < volume.size.z(); ++z)
      for (int y = 0; y < volume.size.y(); ++y)
        for (int x = 0; x < volume.size.x(); ++x) {
          if (volume.density[volume.index(x, y, z)] == 0) continue;
          for (const int bz : {z / kBlock, (z + 1) / kBlock})
            for (const int by : {y / kBlock, (y + 1) / kBlock})
              for (const int bx : {x / kBlock, (x + 1) / kBlock}) is_filled[index(bx, by, bz)] = 1;
        }
  }
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(x);
  }
  /// How far along a line from a place nothing is met: 0 in blocks that hold something.
  /// step   in voxels, of a metre
  double empty_m(const Eigen::Vector3d& at, const Eigen::Vector3d& step) const {
    Eigen::Vector3i block;
    for (int k = 0; k < 3; ++k)
      block[k] = std::clamp(static_cast<int>(std::floor(at[k] + 1.0)) / kBlock, 0, size[k] - 1);
    if (is_filled[index(block.x(), block.y(), block.z())] != 0) return 0.0;
    double exit_m = kFarthest_m;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(step[k]) < 1e-12) continue;
      const double side = (block[k] + (step[k] > 0.0 ? 1 : 0)) * kBlock - 1.0;
      exit_m = std::min(exit_m, (side - at[k]) / step[k]);
    }
    return std::max(exit_m, 0.0);
  }
};

/// How much of a volume lies straight above and below its places, in voxels of density 1.
struct Clouds::Columns {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<float> above;
  std::vector<float> below;

  explicit Columns(const world::Volume& volume) {
    size = (volume.size.array() + kColumnCell - 1) / kColumnCell;
    const auto layer = static_cast<std::size_t>(size.x()) * static_cast<std::size_t>(size.y());
    const auto num_layers = static_cast<std::size_t>(size.z());
    std::vector<std::uint32_t> sums(layer * num_layers);
    for (int z = 0; z < volume.size.z(); ++z)
      for (int y = 0; y < volume.size.y(); ++y)
        for (int x = 0; x < volume.size.x(); ++x)
          sums[index(x / kColumnCell, y / kColumnCell, z / kColumnCell)] +=
              volume.density[volume.index(x, y, z)];
    above.resize(sums.size());
    below.resize(sums.size());
    // A cell's own half lies on each side of its middle.
    constexpr float kScale = 1.0f / (255.0f * kColumnCell * kColumnCell);
    for (std::size_t column = 0; column < layer; ++column) {
      float sum = 0.0f;
      for (std::size_t z = 0; z < num_layers; ++z) {
        const float own = kScale * static_cast<float>(sums[z * layer + column]);
        below[z * layer + column] = sum + 0.5f * own;
        sum += own;
      }
      for (std::size_t z = 0; z < num_layers; ++z)
        above[z * layer + column] = sum - below[z * layer + column];
    }
  }
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y()) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(x);
  }
  float at(const std::vector<float>& columns, const Eigen::Vector3d& at_voxels) const {
    const Eigen::Vector3d cells = ((at_voxels.array() + 0.5) / kColumnCell - 0.5)
                                      .max(0.0)
                                      .min(size.cast<double>().array() - 1.0);
    return trilinear(cells, size, [&](int x, int y, int z) { return columns[index(x, y, z)]; });
  }
};

struct Clouds::Placed {
  const world::Volume* volume = nullptr;
  const Blocks* blocks = nullptr;
  const Columns* columns = nullptr;
  world::VolumePlace place;
  Eigen::Affine3d voxels_from_world;  ///< voxel centres at whole numbers
  double voxel_m = 0.0;               ///< in the world
  Eigen::Vector3d sun_voxels;         ///< direction of a metre
  Eigen::Vector3i shadow_size;
  /// What kMostDepth is above the optical depth toward the sun, each cell's when it is first needed; 0: not known
  /// yet (or so deep that it is computed each time).
  mutable std::vector<std::atomic<std::uint16_t>> shadow;

  float density(const Eigen::Vector3d& at_voxels) const {
    const std::uint8_t* values = volume->density.data();
    const world::Volume& v = *volume;
    return trilinear(
               at_voxels, v.size,
               [&](int x, int y, int z) { return static_cast<float>(values[v.index(x, y, z)]); }) *
           (1.0f / 255.0f);
  }
  float extinction_per_m(const Eigen::Vector3d& at_voxels) const {
    return density(at_voxels) * static_cast<float>(place.extinction_per_m);
  }
  Eigen::Vector3d lowest() const { return Eigen::Vector3d::Constant(-1.0); }
  Eigen::Vector3d highest() const { return volume->size.cast<double>(); }

  /// Where a line is in the volume, in metres along it.
  bool cross(const Eigen::Vector3d& at, const Eigen::Vector3d& step, double& from_m,
             double& until_m) const {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(step[k]) < 1e-12) {
        if (at[k] < -1.0 || at[k] > highest()[k]) return false;
        continue;
      }
      const double a = (lowest()[k] - at[k]) / step[k];
      const double b = (highest()[k] - at[k]) / step[k];
      from_m = std::max(from_m, std::min(a, b));
      until_m = std::min(until_m, std::max(a, b));
    }
    return from_m < until_m;
  }

  /// Of what lies between two places along a line.
  double depth(const Eigen::Vector3d& at, const Eigen::Vector3d& step, double from_m,
               double until_m, double step_m, double jitter) const {
    double sum = 0.0;
    for (double t = from_m; t < until_m; t += step_m) {
      const double length_m = std::min(step_m, until_m - t);
      const Eigen::Vector3d here = at + (t + jitter * length_m) * step;
      if (const double empty_m = blocks->empty_m(here, step); empty_m > 0.0)
        t += std::floor(empty_m / step_m) * step_m;
      else
        sum += length_m * static_cast<double>(extinction_per_m(here));
    }
    return sum;
  }

  void lay_out_shadow() {
    shadow_size = (volume->size.array() + kShadowCell + 1) / kShadowCell + 1;  // beyond each face
    shadow = std::vector<std::atomic<std::uint16_t>>(
        static_cast<std::size_t>(shadow_size.cast<double>().prod()));
  }
  /// Optical depth from a cell toward the sun, in steps.
  std::uint16_t cast_shadow(int x, int y, int z) const {
    const Eigen::Vector3d at =
        kShadowCell * Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(0.5 * kShadowCell);
    double from_m = 0.0;
    double until_m = kFarthest_m;
    if (!cross(at, sun_voxels, from_m, until_m)) return 0;
    const double tau = depth(at, sun_voxels, from_m, until_m, kShadowStep * voxel_m, 0.5);
    return static_cast<std::uint16_t>(
        std::min(tau * static_cast<double>(kDepthSteps), double{kMostDepth}));
  }
  /// The same, kept: threads that need a cell at once compute the same.
  std::uint16_t shadow_at(int x, int y, int z) const {
    std::atomic<std::uint16_t>& kept =
        shadow[(static_cast<std::size_t>(z) * static_cast<std::size_t>(shadow_size.y()) +
                static_cast<std::size_t>(y)) *
                   static_cast<std::size_t>(shadow_size.x()) +
               static_cast<std::size_t>(x)];
    const std::uint16_t known = kept.load(std::memory_order_relaxed);
    if (known != 0) return kMostDepth - known;
    const std::uint16_t steps = cast_shadow(x, y, z);
    kept.store(kMostDepth - steps, std::memory_order_relaxed);
    return steps;
  }
  /// Optical depth from a place in the volume toward the sun.
  float depth_to_sun(const Eigen::Vector3d& at_voxels) const {
    const Eigen::Vector3d at =
        (at_voxels + Eigen::Vector3d::Constant(0.5 * kShadowCell)) / kShadowCell;
    return trilinear(at, shadow_size,
                     [&](int x, int y, int z) { return static_cast<float>(shadow_at(x, y, z)); }) *
           (1.0f / kDepthSteps);
  }
  /// The same, finer near the place: billows shade each other.
  float close_depth_to_sun(const Eigen::Vector3d& at_voxels) const {
    const double near_m = kNearShadow * voxel_m;
    const double step_m = near_m / kNearSteps;
    float sum = 0.0f;
    for (int k = 0; k < kNearSteps; ++k)
      sum += extinction_per_m(at_voxels + (k + 0.5) * step_m * sun_voxels);
    return sum * static_cast<float>(step_m) + depth_to_sun(at_voxels + near_m * sun_voxels);
  }
};

Clouds::~Clouds() = default;
Clouds::Clouds(Clouds&&) noexcept = default;
Clouds& Clouds::operator=(Clouds&&) noexcept = default;

Clouds::Clouds(const world::TileStore& store, const Eigen::Vector3d& sun_direction_world)
    : sun_world_(sun_direction_world) {
  for (std::size_t row = 0; row < store.manifest().volumes.size(); ++row)
    volumes_.push_back(store.load_volume(row));
  place(store.manifest().volume_places, geo::WorldFrame(store.manifest().origin));
}

Clouds::Clouds(std::vector<world::Volume> volumes, const std::vector<world::VolumePlace>& places,
               const geo::WorldFrame& frame, const Eigen::Vector3d& sun_direction_world)
    : sun_world_(sun_direction_world), volumes_(std::move(volumes)) {
  place(places, frame);
}

void Clouds::place(const std::vector<world::VolumePlace>& places, const geo::WorldFrame& frame) {
  std::vector<geo::Box3d> boxes;
  std::vector<std::unique_ptr<Placed>> given;
  for (const world::Volume& volume : volumes_) {
    blocks_.push_back(std::make_unique<Blocks>(volume));
    columns_.push_back(std::make_unique<Columns>(volume));
  }
  for (const world::VolumePlace& one : places) {
    auto placed = std::make_unique<Placed>();
    placed->volume = &volumes_[static_cast<std::size_t>(one.volume)];
    placed->blocks = blocks_[static_cast<std::size_t>(one.volume)].get();
    placed->place = one;
    placed->columns = columns_[static_cast<std::size_t>(one.volume)].get();
    const world::Volume& volume = *placed->volume;
    placed->voxel_m = volume.voxel_m * one.scale;
    placed->lay_out_shadow();
    const Eigen::Matrix3d world_from_volume =
        frame.world_from_enu(one.place_world) *
        Eigen::AngleAxisd(one.heading_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    Eigen::Affine3d world_from_voxels;
    world_from_voxels.linear() = world_from_volume * placed->voxel_m;
    world_from_voxels.translation() =
        one.place_world +
        world_from_volume *
            (one.scale * (volume.lowest_m + Eigen::Vector3d::Constant(0.5 * volume.voxel_m)));
    placed->voxels_from_world = world_from_voxels.inverse();
    placed->sun_voxels = placed->voxels_from_world.linear() * sun_world_;
    const geo::Box3d own(placed->lowest(), placed->highest());
    geo::Box3d box;
    for (int corner = 0; corner < 8; ++corner)
      box.extend(world_from_voxels * own.corner(static_cast<geo::Box3d::CornerType>(corner)));
    boxes.push_back(box);
    given.push_back(std::move(placed));
  }
  world::BoxTree::Leaves leaves;
  tree_ = world::BoxTree(boxes, 1, leaves);
  for (const world::BoxTree::Leaf& leaf : leaves.leaves)
    placed_.push_back(std::move(given[leaves.order[leaf.begin]]));
}

void Clouds::intervals(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
                       double until_m, std::vector<Interval>& found) const {
  found.clear();
  if (is_empty()) return;
  const Eigen::Vector3d inverse(world::safe_inverse(direction_world.x(), 1.0),
                                world::safe_inverse(direction_world.y(), 1.0),
                                world::safe_inverse(direction_world.z(), 1.0));
  const double end_m = std::min(until_m, kFarthest_m);
  world::BoxTree::Ray ray;
  if (!tree_.enter(origin_world, direction_world, inverse, 1.0, 0.0, end_m, ray)) return;
  tree_.traverse(ray, [&](std::uint32_t leaf, float) {
    const Placed& placed = *placed_[leaf];
    double from = 0.0;
    double until = end_m;
    if (placed.cross(placed.voxels_from_world * origin_world,
                     placed.voxels_from_world.linear() * direction_world, from, until))
      found.push_back({from, until, leaf});
    return false;
  });
  std::sort(found.begin(), found.end(), [](const Interval& a, const Interval& b) {
    return std::tie(a.from_m, a.placed) < std::tie(b.from_m, b.placed);
  });
}

double Clouds::optical_depth(const Eigen::Vector3d& origin_world,
                             const Eigen::Vector3d& direction_world, double until_m,
                             double steps_per_voxel, double jitter) const {
  std::vector<Interval> found;
  intervals(origin_world, direction_world, until_m, found);
  double sum = 0.0;
  for (const Interval& one : found) {
    const Placed& placed = *placed_[one.placed];
    sum += placed.depth(placed.voxels_from_world * origin_world,
                        placed.voxels_from_world.linear() * direction_world, one.from_m,
                        one.until_m, placed.voxel_m / steps_per_voxel, jitter);
  }
  return sum;
}

double Clouds::sun_transmittance(const Eigen::Vector3d& point_world) const {
  std::vector<Interval> found;
  intervals(point_world, sun_world_, kFarthest_m, found);
  float sum = 0.0f;
  for (const Interval& one : found) {
    const Placed& placed = *placed_[one.placed];
    sum += placed.depth_to_sun(placed.voxels_from_world * point_world +
                               one.from_m * placed.sun_voxels);
  }
  return static_cast<double>(std::exp(-sum));
}

Clouds::Seen Clouds::look(const Eigen::Vector3d& origin_world,
                          const Eigen::Vector3d& direction_world, double until_m,
                          const SampleWidth& sample_width, double jitter, const Sky& sky) const {
  Seen seen;
  std::vector<Interval> found;
  intervals(origin_world, direction_world, until_m, found);
  if (found.empty()) return seen;
  const auto cos_sun = static_cast<float>(direction_world.dot(sun_world_));
  const Eigen::Vector3f up = sky.daylight().up_world.cast<float>();
  const auto pi = static_cast<float>(std::numbers::pi);
  // Mean radiance from above and from below: half of what a plane's irradiance over pi says each.
  const Color from_above = 0.5f * sky.ambient().irradiance(up) / pi;
  const Color from_below = 0.5f * sky.ambient().irradiance(-up) / pi;
  double weighted_m = 0.0;
  for (const Interval& one : found) {
    const Placed& placed = *placed_[one.placed];
    const Eigen::Vector3d at = placed.voxels_from_world * origin_world;
    const Eigen::Vector3d step = placed.voxels_from_world.linear() * direction_world;
    std::array<float, kNumOrders> phases;
    float mean_cosine = static_cast<float>(placed.place.anisotropy);
    float weight = 1.0f;
    for (float& phase : phases) {
      phase = weight * phase_of(cos_sun, mean_cosine);
      mean_cosine *= kOrderCosine;
      weight *= kOrderWeight;
    }
    const double width_m = sample_width.at(one.from_m);
    const double step_m = placed.voxel_m * std::clamp(width_m / placed.voxel_m, 1.0, kLongestStep);
    const bool is_close = step_m < kCloseStep * placed.voxel_m;
    const auto albedo = static_cast<float>(placed.place.albedo);
    const auto column_depth =
        static_cast<float>(placed.voxel_m * placed.place.extinction_per_m);  // of a voxel
    const auto anisotropy = static_cast<float>(placed.place.anisotropy);
    for (double t = one.from_m; t < one.until_m; t += step_m) {
      const double length_m = std::min(step_m, one.until_m - t);
      const double middle_m = t + jitter * length_m;
      const Eigen::Vector3d here = at + middle_m * step;
      if (const double empty_m = placed.blocks->empty_m(here, step); empty_m > 0.0) {
        t += std::floor(empty_m / step_m) * step_m;
        continue;
      }
      const float extinction = placed.extinction_per_m(here);
      if (extinction <= 0.0f) continue;
      const float tau = sky.is_night() ? 0.0f
                        : is_close     ? placed.close_depth_to_sun(here)
                                       : placed.depth_to_sun(here);
      float scattered = 0.0f;
      float through = tau;
      for (const float phase : phases) {
        scattered += phase * std::exp(-through);
        through *= kOrderDepth;
      }
      const Columns& columns = *placed.columns;
      const float open_above =
          diffuse_transmittance(column_depth * columns.at(columns.above, here), anisotropy);
      const float open_below =
          diffuse_transmittance(column_depth * columns.at(columns.below, here), anisotropy);
      const Color source = albedo * (scattered * sky.sun_irradiance() + open_above * from_above +
                                     open_below * from_below);
      const float kept = std::exp(-extinction * static_cast<float>(length_m));
      const float taken = seen.transmittance * (1.0f - kept);
      seen.radiance += taken * source;
      weighted_m += static_cast<double>(taken) * middle_m;
      seen.transmittance *= kept;
      if (seen.transmittance < kOpaque) break;
    }
    if (seen.transmittance < kOpaque) {
      seen.transmittance = 0.0f;
      break;
    }
  }
  const double share = 1.0 - static_cast<double>(seen.transmittance);
  if (share > 0.0) seen.distance_m = weighted_m / share;
  return seen;
}

namespace {

/// The volumes of a scene's world.
class CloudMedium : public Medium {
 public:
  explicit CloudMedium(const MediumSite& site)
      : sky_(site.sky), clouds_(site.store, site.sky.daylight().sun_direction_world) {}

  bool is_any() const override { return !clouds_.is_empty(); }
  double sun_transmittance(const Eigen::Vector3d& point_world) const override {
    return clouds_.sun_transmittance(point_world);
  }
  SeenMedium look(const MediumRay& ray) const override {
    const Clouds::Seen seen = clouds_.look(ray.origin_world, ray.direction_world, ray.until_m,
                                           ray.sample_width, ray.jitter, sky_);
    return {.transmittance = Color::Constant(seen.transmittance),
            .radiance = seen.radiance,
            .distance_m = seen.distance_m};
  }

 private:
  const Sky& sky_;
  Clouds clouds_;
};

/// What volumes hang in the air is the world's to say.
struct CloudOptions : MediumOptions {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<MediumOptions> clone() const override {
    return std::make_unique<CloudOptions>(*this);
  }
  std::unique_ptr<Medium> make(const MediumSite& site) const override {
    return std::make_unique<CloudMedium>(site);
  }
};

}  // namespace

MediumInfo clouds_medium() {
  return {.name = "clouds",
          .summary = "clouds, fog and smoke: the volumes of the world's layers",
          .make = [] { return std::unique_ptr<MediumOptions>(std::make_unique<CloudOptions>()); },
          .is_always = true};
}

}  // namespace terracast::scene
