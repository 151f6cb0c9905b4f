#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "core/random.h"
#include "geo/gps_time.h"
#include "geo/satellites/gps_constellation.h"
#include "geo/satellites/satellite_geometry.h"
#include "geo/satellites/signal_delays.h"
#include "geo/sun.h"
#include "geo/units.h"
#include "sensors/deviates.h"
#include "sensors/lidar/surfaces.h"
#include "sensors/sensor.h"

/// A receiver's observations of satellites: pseudorange, carrier phase and Doppler of GPS's L1 signal, satellite by
/// satellite, and which of them terrain, buildings, trees and vehicles hide.
namespace terracast::sensors {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kWavelength_m = geo::kLight_mps / geo::kGpsL1_hz;

/// The channels, in the order of channels().
enum Column : std::size_t {
  kPrn,
  kAzimuth,
  kElevation,
  kIsVisible,
  kBlockedByClass,
  kBlockedByInstance,
  kPseudorange,
  kCarrier,
  kDoppler,
  kTrueRange,
  kTrueRangeRate,
  kReceiverClock,
  kSatelliteClock,
  kIonosphere,
  kTroposphere,
  kSatelliteX,
  kSatelliteY,
  kSatelliteZ,
  kNumVisible,
  kHdop,
  kVdop,
  kPdop,
  kTdop,
  kNumColumns
};

/// A satellite above the horizon, as a receiver finds it.
struct Sighting {
  const geo::BroadcastOrbit* orbit = nullptr;
  geo::ReceivedSatellite signal;
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  bool is_visible = true;
  core::SemanticClass blocked_by = core::SemanticClass::Sky;
  std::uint32_t blocked_by_instance = 0;
};

/// An epoch's place and time.
struct Epoch {
  std::int64_t tick = 0;
  double time_s = 0.0;
  double gps_s = 0.0;
  double since_toe_s = 0.0;
  Vector3d antenna_world;
  geo::Geodetic antenna;
  Vector3d antenna_ecef_m;
  Vector3d velocity_ecef_mps;
  Eigen::Matrix3d ecef_from_enu;
};

class GnssObservations : public Scanner {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("mask_deg", mask_deg_, "Satellites lower than this above the horizon are left out.",
              core::between(1.0, 89.0));
    visit.key("plants", plants_,
              "block: trees and bushes hide satellites; pass: signals go through them unchanged.",
              core::one_of({"block", "pass"}));
    visit.key("ionosphere", ionosphere_,
              "klobuchar: code is delayed and carrier advanced by the broadcast model, with the "
              "numbers of a quiet day; none: not at all.",
              core::one_of({"none", "klobuchar"}));
    visit.key("troposphere", troposphere_,
              "saastamoinen: both are delayed by the standard atmosphere; none: not at all.",
              core::one_of({"none", "saastamoinen"}));
    visit.key("clock_offset_us", clock_offset_us_,
              "How far the receiver's clock is ahead of GPS time at the sequence's start.",
              core::between(-1000.0, 1000.0));
    visit.key("clock_drift_ppb", clock_drift_ppb_,
              "How much it gains; a crystal's are some hundreds.", core::between(-1e4, 1e4));
    visit.key("pseudorange_noise_m", pseudorange_noise_m_,
              "Deviation of a pseudorange of a satellite overhead; it grows by 1 / sin(elevation).",
              core::between(0.0, 1e3));
    visit.key("carrier_noise_mm", carrier_noise_mm_, "The same of carrier phases, as a length.",
              core::between(0.0, 1e3));
    visit.key("doppler_noise_hz", doppler_noise_hz_, "The same of Doppler shifts.",
              core::between(0.0, 1e4));
  }
  std::unique_ptr<Sensor> clone() const override {
    return std::make_unique<GnssObservations>(*this);
  }
  void check_times(double from_unix_s, double to_unix_s) const override {
    constexpr double kFirst_unix_s = 315964800.0;  // 1980-01-06
    if (from_unix_s < kFirst_unix_s)
      fail(ErrorKind::Config,
           "GPS time begins on 1980-01-06, before which there are no observations; take a later "
           "time of day and date, or no sensor of kind gnss_observations");
    (void)to_unix_s;
  }

  std::vector<capture::StreamChannel> channels() const override {
    using capture::NumberType;
    constexpr NumberType kReal = NumberType::Float64;
    constexpr NumberType kShort = NumberType::Float32;
    return {{.name = "prn", .unit = "", .type = NumberType::Count8},
            {.name = "azimuth_deg", .unit = "deg", .type = kReal},
            {.name = "elevation_deg", .unit = "deg", .type = kReal},
            {.name = "is_visible", .unit = "", .type = NumberType::Count8},
            {.name = "blocked_by_class_id", .unit = "", .type = NumberType::Count8},
            {.name = "blocked_by_instance_id", .unit = "", .type = NumberType::Count32},
            {.name = "pseudorange_m", .unit = "m", .type = kReal},
            {.name = "carrier_cycles", .unit = "cycles", .type = kReal},
            {.name = "doppler_hz", .unit = "Hz", .type = kReal},
            {.name = "true_range_m", .unit = "m", .type = kReal},
            {.name = "true_range_rate_mps", .unit = "m/s", .type = kReal},
            {.name = "receiver_clock_s", .unit = "s", .type = kReal},
            {.name = "satellite_clock_s", .unit = "s", .type = kReal},
            {.name = "ionosphere_m", .unit = "m", .type = kReal},
            {.name = "troposphere_m", .unit = "m", .type = kReal},
            {.name = "satellite_x_ecef_m", .unit = "m", .type = kReal},
            {.name = "satellite_y_ecef_m", .unit = "m", .type = kReal},
            {.name = "satellite_z_ecef_m", .unit = "m", .type = kReal},
            {.name = "num_visible", .unit = "", .type = NumberType::Count8},
            {.name = "hdop", .unit = "", .type = kShort},
            {.name = "vdop", .unit = "", .type = kShort},
            {.name = "pdop", .unit = "", .type = kShort},
            {.name = "tdop", .unit = "", .type = kShort}};
  }
  double rows_per_s(double rate_hz) const override { return kMostSatellites * rate_hz; }
  capture::Samples scan(const SensorSite& site, const capture::TickRange& ticks) const override;

 private:
  static constexpr double kMostSatellites = 24.0;
  /// Of the way to a satellite, what may lie on it: farther off nothing of a world of 100 km rises above the mask.
  static constexpr double kReach_m = 2e5;
  enum Draw : std::uint64_t { kOfPseudorange = 1, kOfCarrier, kOfDoppler, kOfWholeWaves };

  std::vector<Sighting> sightings(const Epoch& epoch,
                                  const std::vector<geo::BroadcastOrbit>& orbits) const;
  void look(const SensorSite& site, const Epoch& epoch, std::vector<Sighting>& satellites) const;
  void add_row(const SensorSite& site, const Epoch& epoch, const Sighting& satellite,
               const geo::DilutionOfPrecision& dilution, int num_visible,
               capture::Samples& rows) const;
  double noise(const SensorSite& site, Draw draw, int prn, std::int64_t tick) const;

  double mask_deg_ = 5.0;
  std::string plants_ = "block";
  std::string ionosphere_ = "klobuchar";
  std::string troposphere_ = "saastamoinen";
  double clock_offset_us_ = 0.0;
  double clock_drift_ppb_ = 0.0;
  double pseudorange_noise_m_ = 0.0;
  double carrier_noise_mm_ = 0.0;
  double doppler_noise_hz_ = 0.0;
};

std::vector<Sighting> GnssObservations::sightings(
    const Epoch& epoch, const std::vector<geo::BroadcastOrbit>& orbits) const {
  std::vector<Sighting> above;
  for (const geo::BroadcastOrbit& orbit : orbits) {
    Sighting one{.orbit = &orbit,
                 .signal = geo::received(orbit, epoch.since_toe_s, epoch.antenna_ecef_m,
                                         epoch.velocity_ecef_mps)};
    const Vector3d enu = epoch.ecef_from_enu.transpose() * one.signal.direction_ecef;
    one.elevation_rad = std::atan2(enu.z(), std::hypot(enu.x(), enu.y()));
    one.azimuth_rad = std::atan2(enu.x(), enu.y());
    if (one.azimuth_rad < 0.0) one.azimuth_rad += 2.0 * std::numbers::pi;
    if (one.elevation_rad >= geo::radians_from_degrees(mask_deg_)) above.push_back(one);
  }
  return above;
}

/// Whether signals go through what has this class.
bool is_plant(core::SemanticClass surface) {
  return surface == core::SemanticClass::Tree || surface == core::SemanticClass::Bush ||
         surface == core::SemanticClass::Plant;
}

void GnssObservations::look(const SensorSite& site, const Epoch& epoch,
                            std::vector<Sighting>& satellites) const {
  const Eigen::Quaterniond world_from_ecef =
      site.scene.frame().ecef_from_world().rotation.conjugate();
  const scene::SceneAt scene = site.scene.at(epoch.time_s);
  std::vector<double> begins_m(satellites.size(), 0.0);
  std::vector<std::size_t> open(satellites.size());
  for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
  while (!open.empty()) {
    std::vector<world::WorldRay> rays;
    for (const std::size_t i : open)
      rays.push_back({.origin_world = epoch.antenna_world,
                      .direction_world = world_from_ecef * satellites[i].signal.direction_ecef,
                      .t_min = begins_m[i],
                      .t_max = kReach_m});
    std::vector<world::SurfaceHit> hits(rays.size());
    std::vector<world::SurfaceSample> surfaces(rays.size());
    std::vector<core::SemanticClass> classes;
    scene.trace(rays, {}, hits, world::Coherence::Incoherent, surfaces, site.trail);
    lidar::classify(site.scene.ground(), rays, hits, surfaces, classes);
    std::vector<std::size_t> still_open;
    for (std::size_t k = 0; k < open.size(); ++k) {
      if (hits[k].is_sky()) continue;
      if (plants_ == "pass" && !hits[k].is_ground() && is_plant(classes[k])) {
        // On behind this leaf.
        begins_m[open[k]] = std::nextafter(hits[k].t * (1.0 + 1e-9) + 1e-6, kInfinity);
        still_open.push_back(open[k]);
        continue;
      }
      Sighting& one = satellites[open[k]];
      one.is_visible = false;
      one.blocked_by = classes[k];
      one.blocked_by_instance = hits[k].is_ground() ? 0 : surfaces[k].provenance.instance_id;
    }
    open = std::move(still_open);
  }
}

double GnssObservations::noise(const SensorSite& site, Draw draw, int prn,
                               std::int64_t tick) const {
  return normal_deviate(open_unit(
      core::random_bits(site.stream_seed, core::stream_of(draw, static_cast<std::uint64_t>(prn)),
                        static_cast<std::uint64_t>(tick))));
}

void GnssObservations::add_row(const SensorSite& site, const Epoch& epoch,
                               const Sighting& satellite, const geo::DilutionOfPrecision& dilution,
                               int num_visible, capture::Samples& rows) const {
  const geo::ReceivedSatellite& signal = satellite.signal;
  const int prn = satellite.orbit->prn;
  const double clock_s = 1e-6 * clock_offset_us_ + 1e-9 * clock_drift_ppb_ * epoch.time_s;
  const double clock_rate = 1e-9 * clock_drift_ppb_;
  const double ionosphere_m =
      ionosphere_ == "none"
          ? 0.0
          : geo::ionosphere_delay_m(geo::klobuchar_of_2004(), epoch.antenna, satellite.azimuth_rad,
                                    satellite.elevation_rad, epoch.gps_s);
  double troposphere_m = 0.0;
  if (troposphere_ != "none") {
    const double altitude_msl_m =
        epoch.antenna.height_m -
        SensorSite::mean_sea_level()->undulation_m(epoch.antenna.lat_deg, epoch.antenna.lon_deg);
    troposphere_m = geo::troposphere_delay_m(geo::radians_from_degrees(epoch.antenna.lat_deg),
                                             altitude_msl_m, satellite.elevation_rad);
  }
  const double clocks_m = geo::kLight_mps * (clock_s - signal.sent.clock_s);
  const double clock_rates_mps = geo::kLight_mps * (clock_rate - signal.sent.clock_rate);
  const double whole_waves = std::floor(core::random_between(
      -1e6, 1e6, site.stream_seed, kOfWholeWaves, static_cast<std::uint64_t>(prn)));
  const double slant = 1.0 / std::sin(satellite.elevation_rad);
  const auto noisy = [&](double truth, double deviation, Draw draw) {
    if (!satellite.is_visible) return kInfinity;
    return deviation > 0.0 ? truth + deviation * slant * noise(site, draw, prn, epoch.tick) : truth;
  };

  rows.times_s.push_back(epoch.time_s);
  std::array<double, kNumColumns> row{};
  row[kPrn] = prn;
  row[kAzimuth] = geo::degrees_from_radians(satellite.azimuth_rad);
  row[kElevation] = geo::degrees_from_radians(satellite.elevation_rad);
  row[kIsVisible] = satellite.is_visible ? 1.0 : 0.0;
  row[kBlockedByClass] = static_cast<double>(satellite.blocked_by);
  row[kBlockedByInstance] = satellite.blocked_by_instance;
  row[kPseudorange] = noisy(signal.range_m + clocks_m + ionosphere_m + troposphere_m,
                            pseudorange_noise_m_, kOfPseudorange);
  row[kCarrier] = noisy(
      (signal.range_m + clocks_m - ionosphere_m + troposphere_m) / kWavelength_m + whole_waves,
      1e-3 * carrier_noise_mm_ / kWavelength_m, kOfCarrier);
  row[kDoppler] = noisy(-(signal.range_rate_mps + clock_rates_mps) / kWavelength_m,
                        doppler_noise_hz_, kOfDoppler);
  row[kTrueRange] = signal.range_m;
  row[kTrueRangeRate] = signal.range_rate_mps;
  row[kReceiverClock] = clock_s;
  row[kSatelliteClock] = signal.sent.clock_s;
  row[kIonosphere] = ionosphere_m;
  row[kTroposphere] = troposphere_m;
  for (int axis = 0; axis < 3; ++axis)
    row[kSatelliteX + static_cast<std::size_t>(axis)] = signal.place_ecef_m[axis];
  row[kNumVisible] = num_visible;
  row[kHdop] = dilution.horizontal;
  row[kVdop] = dilution.vertical;
  row[kPdop] = dilution.position;
  row[kTdop] = dilution.time;
  rows.values.insert(rows.values.end(), row.begin(), row.end());
}

capture::Samples GnssObservations::scan(const SensorSite& site,
                                        const capture::TickRange& ticks) const {
  const geo::WorldFrame& frame = site.scene.frame();
  const geo::Rigid3d& ecef_from_world = frame.ecef_from_world();
  const double start_gps_s =
      geo::gps_seconds_from_unix(geo::unix_seconds_from_utc(site.scene.utc_start()));
  std::vector<geo::BroadcastOrbit> orbits;
  capture::Samples rows;
  for (std::int64_t tick = ticks.first; tick < ticks.end; ++tick) {
    Epoch epoch;
    epoch.tick = tick;
    epoch.time_s = static_cast<double>(tick) / site.rate_hz;
    epoch.gps_s = start_gps_s + epoch.time_s;
    const double toe_gps_s = geo::toe_of(epoch.gps_s);
    if (orbits.empty() || orbits.front().toe_gps_s != toe_gps_s)
      orbits = geo::baseline_constellation(toe_gps_s);
    epoch.since_toe_s = (start_gps_s - toe_gps_s) + epoch.time_s;
    const PointMotion antenna = site.point_at(epoch.time_s);
    epoch.antenna_world = antenna.place_world;
    epoch.antenna = frame.geodetic_from_world(antenna.place_world);
    epoch.antenna_ecef_m = ecef_from_world * antenna.place_world;
    epoch.velocity_ecef_mps = ecef_from_world.rotation * antenna.velocity_world_mps;
    epoch.ecef_from_enu =
        ecef_from_world.rotation.toRotationMatrix() * frame.world_from_enu(antenna.place_world);

    std::vector<Sighting> satellites = sightings(epoch, orbits);
    look(site, epoch, satellites);
    std::vector<Vector3d> seen_enu;
    for (const Sighting& one : satellites)
      if (one.is_visible)
        seen_enu.push_back(epoch.ecef_from_enu.transpose() * one.signal.direction_ecef);
    const geo::DilutionOfPrecision dilution = geo::dilution_of_precision(seen_enu);
    for (const Sighting& one : satellites)
      add_row(site, epoch, one, dilution, static_cast<int>(seen_enu.size()), rows);
  }
  return rows;
}

}  // namespace

SensorInfo gnss_observations_sensor() {
  return {.name = "gnss_observations",
          .summary = "signals of satellites, and which of them the world hides",
          .make = [] { return std::unique_ptr<Sensor>(std::make_unique<GnssObservations>()); }};
}

}  // namespace terracast::sensors
