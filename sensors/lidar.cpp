#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/scratch_pool.h"
#include "sensors/deviates.h"
#include "sensors/lidar/beam.h"
#include "sensors/lidar/pattern.h"
#include "sensors/lidar/surfaces.h"
#include "sensors/sensor.h"

/// Scanners that measure ranges by pulses of light: each pulse at its own time from the body's own pose, in a world that
/// moves meanwhile.
namespace terracast::sensors {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

/// Share of light that a surface throws back, of each class.
struct Reflectances {
  double others = 0.2;
  std::array<double, core::kNumSemanticClasses> of_class = none_stated();

  static constexpr double kNotStated = -1.0;
  static std::array<double, core::kNumSemanticClasses> none_stated() {
    std::array<double, core::kNumSemanticClasses> none{};
    none.fill(kNotStated);
    return none;
  }

  void describe(core::SchemaVisitor& visit) {
    visit.key("others", others, "Of all that is not named below.", core::between(0.0, 1.0));
    const std::span<const std::string_view> names = core::semantic_class_names();
    for (std::size_t i = 0; i < names.size(); ++i)
      visit.key(names[i], of_class[i], "Of this class; -1: as `others`.",
                core::between(kNotStated, 1.0));
  }
  double of(core::SemanticClass one) const {
    const double stated = of_class[static_cast<std::size_t>(one)];
    return stated < 0.0 ? others : stated;
  }
};

/// Buffers for the rays of a block and their hits.
struct BlockScratch {
  std::vector<Vector3d> directions;
  std::vector<geo::Rigid3d> poses;  ///< world_from_sensor, of each pulse
  std::vector<world::WorldRay> rays;
  std::vector<double> offsets_s;
  std::vector<world::SurfaceHit> hits;
  std::vector<world::SurfaceSample> surfaces;
  std::vector<core::SemanticClass> classes;
  std::vector<lidar::Echo> echoes;
  std::vector<lidar::Return> returns;
};

/// The channels, in the order of channels().
enum Column : std::size_t {
  kX,
  kY,
  kZ,
  kRange,
  kTrueRange,
  kSpread,
  kPower,
  kReflectance,
  kIncidence,
  kRing,
  kPulse,
  kReturn,
  kReturns,
  kClass,
  kInstance,
  kWorldX,
  kWorldY,
  kWorldZ,
  kOriginX,
  kOriginY,
  kOriginZ,
  kNumColumns
};

class Lidar : public Scanner {
 public:
  Lidar() {
    pattern_options_.set(pattern_,
                         core::find_registered(lidar::scan_patterns(), "pattern", pattern_).make());
  }
  void describe(core::SchemaVisitor& visit) override;
  void validate() const override;
  std::unique_ptr<Sensor> clone() const override { return std::make_unique<Lidar>(*this); }
  std::vector<capture::StreamChannel> channels() const override;
  double rows_per_s(double rate_hz) const override {
    return static_cast<double>(most_returns_) * pattern_options_->pulses_per_s(rate_hz);
  }
  capture::Samples scan(const SensorSite& site, const capture::TickRange& ticks) const override;

 private:
  /// Pulses that are cast together: of so many, and within so long, the moving bodies' states go on from one frame's.
  static constexpr std::int64_t kBlock = 512;
  static constexpr double kBlock_s = 0.01;
  enum Draw : std::uint64_t { kTurn, kNoise };

  static std::vector<std::int64_t> blocks_of(std::span<const lidar::Pulse> pulses);
  void scan_block(const SensorSite& site, std::span<const lidar::Pulse> pulses,
                  std::uint64_t stream, std::int64_t first, capture::Samples& rows,
                  BlockScratch& scratch) const;
  void cast(const SensorSite& site, std::span<const lidar::Pulse> pulses, std::uint64_t stream,
            std::int64_t first, BlockScratch& scratch) const;
  void find_returns(std::size_t first_ray, BlockScratch& scratch) const;
  double power_of(const world::SurfaceHit& hit, const Vector3d& direction_world,
                  core::SemanticClass surface) const;
  /// The least power of an echo that is found.
  double least_power() const;

  std::string pattern_ = "spinning";
  core::KindOptions<lidar::ScanPatternInfo> pattern_options_;
  lidar::BeamOptions beam_;
  Reflectances reflectances_;
  double least_range_m_ = 0.5;
  double most_range_m_ = 200.0;
  double range_at_10_percent_m_ = 0.0;
  double extinction_per_km_ = 0.0;
  std::int64_t most_returns_ = 1;
  double pulse_ns_ = 5.0;
  double range_noise_m_ = 0.0;
  double range_step_m_ = 0.0;
};

void Lidar::describe(core::SchemaVisitor& visit) {
  visit.key("pattern", pattern_, "How the beam is led; it decides further keys.",
            core::one_of(core::registry_names(lidar::scan_patterns())));
  pattern_options_.describe(visit, lidar::scan_patterns(), "pattern", pattern_);
  beam_.describe(visit);
  visit.key("least_range_m", least_range_m_, "What is nearer ends the beam without a point.",
            core::between(0.0, 1e5));
  visit.key("most_range_m", most_range_m_, "What is farther has no point.",
            core::between(1e-3, 1e6));
  visit.key("range_at_10_percent_m", range_at_10_percent_m_,
            "So far off a wall that throws back a tenth is just found; what brings back less power "
            "is lost. 0: nothing is lost.",
            core::between(0.0, 1e6));
  visit.key("extinction_per_km", extinction_per_km_,
            "Of the air at the laser's wavelength; light is lost there and back.",
            core::between(0.0, 1e4));
  visit.key("most_returns", most_returns_,
            "Points of a pulse, the nearest first; more than 1 take a beam of several rays.",
            core::between(1.0, 15.0));
  visit.key("pulse_ns", pulse_ns_,
            "Length of a pulse (full width at half its height). Echoes that lie nearer behind each "
            "other than light goes in half of it are one return.",
            core::between(0.0, 1e4));
  visit.key("range_noise_m", range_noise_m_, "Standard deviation of a range's noise.",
            core::between(0.0, 100.0));
  visit.key("range_step_m", range_step_m_, "Step of the measured ranges; 0: none.",
            core::between(0.0, 100.0));
  visit.section("reflectances", reflectances_,
                "Shares of light that surfaces throw back at the laser's wavelength, evenly to all "
                "sides.");
}

void Lidar::validate() const {
  pattern_options_.validate();
  beam_.validate();
  if (!(least_range_m_ < most_range_m_))
    fail(ErrorKind::Config,
         "least_range_m = {} is not below most_range_m = {}; take more of the latter",
         least_range_m_, most_range_m_);
  if (most_returns_ > 1 && beam_.rays == 1)
    fail(ErrorKind::Config,
         "most_returns = {} of beams of one ray, which have one return; take rays = 7 or more, and "
         "divergence_mrad",
         most_returns_);
}

std::vector<capture::StreamChannel> Lidar::channels() const {
  using capture::NumberType;
  constexpr NumberType kReal = NumberType::Float64;
  constexpr NumberType kShort = NumberType::Float32;
  return {{.name = "x_m", .unit = "m", .type = kReal},
          {.name = "y_m", .unit = "m", .type = kReal},
          {.name = "z_m", .unit = "m", .type = kReal},
          {.name = "range_m", .unit = "m", .type = kReal},
          {.name = "true_range_m", .unit = "m", .type = kReal},
          {.name = "spread_m", .unit = "m", .type = kShort},
          {.name = "power_per_m2", .unit = "1/m^2", .type = kShort},
          {.name = "reflectance", .unit = "", .type = kShort},
          {.name = "incidence_rad", .unit = "rad", .type = kShort},
          {.name = "ring", .unit = "", .type = NumberType::Count16},
          {.name = "pulse", .unit = "", .type = NumberType::Count32},
          {.name = "return_number", .unit = "", .type = NumberType::Count8},
          {.name = "num_returns", .unit = "", .type = NumberType::Count8},
          {.name = "class_id", .unit = "", .type = NumberType::Count8},
          {.name = "instance_id", .unit = "", .type = NumberType::Count32},
          {.name = "world_x_m", .unit = "m", .type = kReal},
          {.name = "world_y_m", .unit = "m", .type = kReal},
          {.name = "world_z_m", .unit = "m", .type = kReal},
          {.name = "world_origin_x_m", .unit = "m", .type = kReal},
          {.name = "world_origin_y_m", .unit = "m", .type = kReal},
          {.name = "world_origin_z_m", .unit = "m", .type = kReal}};
}

double Lidar::power_of(const world::SurfaceHit& hit, const Vector3d& direction_world,
                       core::SemanticClass surface) const {
  const double cosine = std::abs(hit.normal_world().dot(direction_world));
  return reflectances_.of(surface) * cosine * std::exp(-2e-3 * extinction_per_km_ * hit.t) /
         (hit.t * hit.t);
}

double Lidar::least_power() const {
  if (range_at_10_percent_m_ == 0.0) return 0.0;
  return 0.1 * std::exp(-2e-3 * extinction_per_km_ * range_at_10_percent_m_) /
         (range_at_10_percent_m_ * range_at_10_percent_m_);
}

void Lidar::cast(const SensorSite& site, std::span<const lidar::Pulse> pulses, std::uint64_t stream,
                 std::int64_t first, BlockScratch& scratch) const {
  const double middle_s = 0.5 * (pulses.front().time_s + pulses.back().time_s);
  scratch.poses.clear();
  scratch.rays.clear();
  scratch.offsets_s.clear();
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const lidar::Pulse& pulse = pulses[i];
    // Those that leave together have one pose.
    scratch.poses.push_back(i > 0 && pulse.time_s == pulses[i - 1].time_s
                                ? scratch.poses.back()
                                : site.world_from_sensor(pulse.time_s));
    const geo::Rigid3d& pose = scratch.poses.back();
    const double turn_rad = 2.0 * std::numbers::pi *
                            core::random_unit(site.stream_seed, core::stream_of(stream, kTurn),
                                              static_cast<std::uint64_t>(first) + i);
    beam_.directions(pulse, turn_rad, scratch.directions);
    for (const Vector3d& direction : scratch.directions) {
      scratch.rays.push_back({.origin_world = pose * pulse.origin_m,
                              .direction_world = pose.rotation * direction,
                              .t_max = most_range_m_});
      scratch.offsets_s.push_back(pulse.time_s - middle_s);
    }
  }
  scratch.hits.assign(scratch.rays.size(), {});
  scratch.surfaces.resize(scratch.rays.size());
  const double reach_s = pulses.back().time_s - middle_s;
  site.scene.at(middle_s, reach_s)
      .trace(scratch.rays, scratch.offsets_s, scratch.hits, world::Coherence::Coherent,
             scratch.surfaces, site.trail);
  lidar::classify(site.scene.ground(), scratch.rays, scratch.hits, scratch.surfaces,
                  scratch.classes);
}

void Lidar::find_returns(std::size_t first_ray, BlockScratch& scratch) const {
  scratch.echoes.clear();
  const std::span<const lidar::BeamRay> beam = lidar::beam_rays(static_cast<int>(beam_.rays));
  for (std::size_t k = 0; k < beam.size(); ++k) {
    const world::SurfaceHit& hit = scratch.hits[first_ray + k];
    if (hit.is_sky() || hit.t < least_range_m_) continue;
    const double power = beam[k].weight * power_of(hit, scratch.rays[first_ray + k].direction_world,
                                                   scratch.classes[first_ray + k]);
    if (!(power > 0.0)) continue;
    scratch.echoes.push_back({.range_m = hit.t, .power = power, .ray = first_ray + k});
  }
  constexpr double kLight_mps = 299792458.0;
  lidar::separate_returns(scratch.echoes, 0.5e-9 * pulse_ns_ * kLight_mps, scratch.returns);
  std::erase_if(scratch.returns,
                [least = least_power()](const lidar::Return& one) { return one.power < least; });
  if (scratch.returns.size() > static_cast<std::size_t>(most_returns_))
    scratch.returns.resize(static_cast<std::size_t>(most_returns_));
}

void Lidar::scan_block(const SensorSite& site, std::span<const lidar::Pulse> pulses,
                       std::uint64_t stream, std::int64_t first, capture::Samples& rows,
                       BlockScratch& scratch) const {
  cast(site, pulses, stream, first, scratch);
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const lidar::Pulse& pulse = pulses[i];
    find_returns(i * static_cast<std::size_t>(beam_.rays), scratch);
    for (std::size_t k = 0; k < scratch.returns.size(); ++k) {
      const lidar::Return& one = scratch.returns[k];
      double range_m = one.range_m;
      if (range_noise_m_ > 0.0)
        range_m += range_noise_m_ *
                   normal_deviate(open_unit(core::random_bits(
                       site.stream_seed, core::stream_of(core::stream_of(stream, kNoise), k),
                       static_cast<std::uint64_t>(first) + i)));
      if (range_step_m_ > 0.0) range_m = range_step_m_ * std::round(range_m / range_step_m_);
      const Vector3d shown = pulse.origin_m + range_m * pulse.direction;
      const Vector3d origin_world = scratch.poses[i] * pulse.origin_m;
      const Vector3d point_world =
          scratch.poses[i] * (pulse.origin_m + one.range_m * pulse.direction);
      const world::SurfaceHit& hit = scratch.hits[one.ray];
      const double cosine = std::abs(hit.normal_world().dot(scratch.rays[one.ray].direction_world));
      rows.times_s.push_back(pulse.time_s);
      const std::size_t row = rows.values.size();
      rows.values.resize(row + kNumColumns);
      double* const values = &rows.values[row];
      for (int axis = 0; axis < 3; ++axis) {
        values[kX + static_cast<std::size_t>(axis)] = shown[axis];
        values[kWorldX + static_cast<std::size_t>(axis)] = point_world[axis];
        values[kOriginX + static_cast<std::size_t>(axis)] = origin_world[axis];
      }
      values[kRange] = range_m;
      values[kTrueRange] = one.range_m;
      values[kSpread] = one.spread_m;
      values[kPower] = one.power;
      values[kReflectance] = one.power * one.range_m * one.range_m;
      values[kIncidence] = std::acos(std::min(1.0, cosine));
      values[kRing] = pulse.ring;
      values[kPulse] = static_cast<double>(first) + static_cast<double>(i);
      values[kReturn] = static_cast<double>(k + 1);
      values[kReturns] = static_cast<double>(scratch.returns.size());
      values[kClass] = static_cast<double>(scratch.classes[one.ray]);
      values[kInstance] = hit.is_ground() ? 0.0 : scratch.surfaces[one.ray].provenance.instance_id;
    }
  }
}

/// The first pulse of each block, and after them the number of all.
std::vector<std::int64_t> Lidar::blocks_of(std::span<const lidar::Pulse> pulses) {
  std::vector<std::int64_t> begins;
  for (std::size_t i = 0; i < pulses.size(); ++i) {
    const bool is_in_block =
        !begins.empty() && static_cast<std::int64_t>(i) - begins.back() < kBlock &&
        pulses[i].time_s - pulses[static_cast<std::size_t>(begins.back())].time_s < kBlock_s;
    if (!is_in_block) begins.push_back(static_cast<std::int64_t>(i));
  }
  begins.push_back(static_cast<std::int64_t>(pulses.size()));
  return begins;
}

capture::Samples Lidar::scan(const SensorSite& site, const capture::TickRange& ticks) const {
  capture::Samples rows;
  core::ScratchPool<BlockScratch> pool;
  for (std::int64_t tick = ticks.first; tick < ticks.end; ++tick) {
    const std::vector<lidar::Pulse> pulses = pattern_options_->pulses(tick, site.rate_hz);
    const std::vector<std::int64_t> begins = blocks_of(pulses);
    std::vector<capture::Samples> blocks(begins.size() - 1);
    site.scene.viewed().run_units(
        static_cast<std::int64_t>(blocks.size()), [&](std::int64_t block) {
          const auto at = static_cast<std::size_t>(block);
          const std::int64_t first = begins[at];
          core::ScratchPool<BlockScratch>::Lease scratch(pool);
          scan_block(site,
                     std::span(pulses).subspan(static_cast<std::size_t>(first),
                                               static_cast<std::size_t>(begins[at + 1] - first)),
                     static_cast<std::uint64_t>(tick), first, blocks[at], *scratch);
        });
    for (capture::Samples& block : blocks) {
      rows.times_s.insert(rows.times_s.end(), block.times_s.begin(), block.times_s.end());
      rows.values.insert(rows.values.end(), block.values.begin(), block.values.end());
      block = {};
    }
  }
  return rows;
}

}  // namespace

SensorInfo lidar_sensor() {
  return {.name = "lidar",
          .summary = "a scanning laser's points, each at its own time, with truth and labels",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<Lidar>()); }};
}

}  // namespace terracast::sensors
